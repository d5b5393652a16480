#!/usr/bin/env bash
# skrl 2.1.1: `import skrl.models.torch` switches off the argument checks of torch's Categorical, for the whole process.
#
# Input: logits with a NaN, as a diverging network gives, to `torch.distributions.Categorical`, before and after the import.
# Guess: what another library imports changes nothing: ValueError both times, as the documentation of torch has it.
# Seen: ValueError before; after the import a distribution is made of them, without a word.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check skrl==2.1.1 torch==2.13.0 gymnasium==1.4.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import torch
from torch.distributions import Categorical


def made():
    try:
        Categorical(logits=torch.tensor([0.0, float("nan"), 0.0]))
    except ValueError:
        return "ValueError"
    return "a distribution"


before = made()
import skrl.models.torch  # noqa: E402, F401

after = made()
print(f"NaN among the logits: {before} before the import of skrl.models.torch, {after} after it")
sys.exit((before, after) != ("ValueError", "a distribution"))
PYTHON
