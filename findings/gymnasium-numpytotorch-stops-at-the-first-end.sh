#!/usr/bin/env bash
# Gymnasium 1.4.0: `vector.NumpyToTorch` around its own CartPole raises a BufferError at the first end in mode SAME_STEP.
#
# Input: two CartPole-v1 in a SyncVectorEnv whose autoreset mode is SAME_STEP, the one that torch trainers ask for.
# Guess: a wrapper for tensors carries what Gymnasium's own vector environment puts into the info.
# Seen: all is well until an episode ends; then the info has `final_obs`, an array of objects, and DLPack takes none.
# NEXT_STEP, the default, has no such key and runs on.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check 'gymnasium[array-api]==1.4.0' torch==2.13.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import gymnasium
import torch
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import NumpyToTorch


def steps_until_it_stops(mode):
    envs = NumpyToTorch(SyncVectorEnv([lambda: gymnasium.make("CartPole-v1")] * 2, autoreset_mode=mode))
    envs.reset(seed=0)
    for step in range(1, 31):  # pushed one way, a pole falls within ten
        try:
            envs.step(torch.zeros(2, dtype=torch.int64))
        except BufferError as error:
            return f"BufferError in step {step}: {error}"
    return "30 steps"


seen = [steps_until_it_stops(mode) for mode in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP)]
print(f"NEXT_STEP: {seen[0]}; SAME_STEP: {seen[1]}")
sys.exit(seen[0] != "30 steps" or not seen[1].startswith("BufferError"))
PYTHON
