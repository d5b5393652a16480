#!/usr/bin/env bash
# PyMeshLab 2025.7.post1: of a glTF node that is moved and scaled, the surface area heeds the node, the bounding box not.
#
# Input: a unit cube in a node that makes it twice as large and moves it by 5, as .glb.
# Guess: both heed the node (area 24, box from 4 to 6), or neither (area 6, box from -0.5 to 0.5).
# Seen: area 24, box from -0.5 to 0.5.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check pymeshlab==2025.7.post1 trimesh==5.2.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import numpy as np
import pymeshlab
import trimesh

node = np.diag((2.0, 2.0, 2.0, 1.0))
node[0, 3] = 5.0
scene = trimesh.Scene()
scene.add_geometry(trimesh.creation.box(), transform=node)
scene.export("cube.glb")
meshes = pymeshlab.MeshSet()
meshes.load_new_mesh("cube.glb")
area = round(meshes.get_geometric_measures()["surface_area"], 6)
box = meshes.current_mesh().bounding_box()
print(f"area {area:g} (24 with the node), box in x from {box.min()[0]:g} to {box.max()[0]:g} (4 to 6 with the node)")
sys.exit((area, box.min()[0], box.max()[0]) != (24.0, -0.5, 0.5))
PYTHON
