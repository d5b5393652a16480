#!/usr/bin/env bash
# PyMeshLab 2025.7.post1 reads a concave face of six corners right and a concave face of four corners wrong.
#
# Input: two OBJ files of one flat face each: an L of three unit squares, and an arrow head of area 1.5.
# Guess: who cuts an L right cuts an arrow right, too; four corners are the easier case.
# Seen: the L has 3, the arrow 2.5: quads go another way, and are cut from the first corner to the third. With another
# corner first, the arrow has 1.5.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check pymeshlab==2025.7.post1 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import pymeshlab

ELL = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nf 1 2 3 4 5 6\n"
ARROW = "v -1 -1 0\nv 0 -0.5 0\nv 1 -1 0\nv 0 1 0\n"
seen = []
for name, text in (("L", ELL), ("arrow", ARROW + "f 1 2 3 4\n"), ("arrow from its notch", ARROW + "f 2 3 4 1\n")):
    with open("shape.obj", "w") as file:
        file.write(text)
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh("shape.obj")
    seen.append(round(meshes.get_geometric_measures()["surface_area"], 6))
    print(f"{name}: area {seen[-1]:g}")
sys.exit(seen != [3.0, 2.5, 1.5])
PYTHON
