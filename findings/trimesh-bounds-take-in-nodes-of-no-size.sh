#!/usr/bin/env bash
# trimesh 5.2.0: the bounds of a scene take in a node that is scaled to nothing; nothing of it can be seen.
#
# Input: a unit cube at (5, 5, 5), and another one in a node of scale 0, which glTF 2.0 names as the way to hide a node.
# Guess: hidden things do not count: bounds from 4.5 to 5.5.
# Seen: from 0 to 5.5: the hidden cube has shrunk into the origin, and its vertices there count; the middle of the scene is
# off by more than two cubes.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check trimesh==5.2.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import numpy as np
import trimesh

scene = trimesh.Scene()
scene.add_geometry(trimesh.creation.box(), transform=np.diag((0.0, 0.0, 0.0, 1.0)))
shown = trimesh.creation.box()
shown.apply_translation((5, 5, 5))
scene.add_geometry(shown)
scene.export("scene.glb")
seen = trimesh.load_scene("scene.glb").bounds.round(6).tolist()
print(f"bounds {seen}; of what can be seen {shown.bounds.tolist()}")
sys.exit(seen != [[0.0] * 3, [5.5] * 3])
PYTHON
