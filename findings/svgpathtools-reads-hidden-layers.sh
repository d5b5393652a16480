#!/usr/bin/env bash
# svgpathtools 1.8.0: `svg2paths` returns what is in a hidden group, and nothing in the answer tells it from the rest.
#
# Input: a drawing of two layers, each a square; one has style="display:none", as Inkscape writes layers that are off.
# Guess: one path, as any program that draws it shows; or two, and the group's style among the attributes of the one.
# Seen: two, and the attributes of both are alike but for their ids.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check svgpathtools==1.8.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import svgpathtools

with open("layers.svg", "w") as file:
    file.write(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 2 2">'
        '<g style="display:none"><path id="hidden" d="M 0 0 L 1 0 L 1 1 L 0 1 Z"/></g>'
        '<g><path id="shown" d="M 1 1 L 2 1 L 2 2 L 1 2 Z"/></g></svg>'
    )
paths, attributes = svgpathtools.svg2paths("layers.svg")
print(f"{len(paths)} paths: {attributes}")
sys.exit(not (len(paths) == 2 and all(set(one) == {"id", "d"} for one in attributes)))
PYTHON
