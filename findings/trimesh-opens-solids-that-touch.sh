#!/usr/bin/env bash
# trimesh 5.2.0: two closed boxes that touch along an edge are watertight in memory, and no longer once read from OBJ.
#
# Input: two unit boxes that share an upright edge in space, but no vertex: 16 vertices, written to OBJ by trimesh itself.
# Guess: OBJ names vertices by number, so what is read is what was written, and is watertight as it was.
# Seen: watertight before; after reading, 14 vertices and not watertight, for vertices in one place are merged and the edge
# has four faces then. `load_mesh(..., process=False)` leaves them alone.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check trimesh==5.2.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import trimesh

one, other = trimesh.creation.box(), trimesh.creation.box()
other.apply_translation((1, 1, 0))
both = trimesh.util.concatenate([one, other])
both.export("boxes.obj")
meshes = both, trimesh.load_mesh("boxes.obj"), trimesh.load_mesh("boxes.obj", process=False)
seen = [(len(mesh.vertices), bool(mesh.is_watertight)) for mesh in meshes]
for name, (n, is_watertight) in zip(("in memory", "read", "read with process=False"), seen):
    print(f"{name}: {n} vertices, watertight {is_watertight}")
sys.exit(seen != [(16, True), (14, False), (16, True)])
PYTHON
