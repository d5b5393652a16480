#!/usr/bin/env bash
# Open3D 0.20.0: `io.read_triangle_mesh` of a cube of quads returns an empty mesh; `t.io.read_triangle_mesh` reads it.
#
# Input: a unit cube as OBJ, eight vertices and six quads, as modelling programs write it by default.
# Guess: the reader of meshes cuts quads into triangles, as the other reader of the same package does, or raises.
# Seen: 0 vertices and 0 triangles from the one, with a line at the level INFO; 8 and 12 from the other.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check open3d==0.20.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import open3d

CORNERS = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
QUADS = [(1, 4, 3, 2), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]
with open("cube.obj", "w") as file:
    file.writelines("v {} {} {}\n".format(*corner) for corner in CORNERS)
    file.writelines("f {} {} {} {}\n".format(*quad) for quad in QUADS)
mesh, tensor = open3d.io.read_triangle_mesh("cube.obj"), open3d.t.io.read_triangle_mesh("cube.obj")
seen = [
    (len(mesh.vertices), len(mesh.triangles)),
    (len(tensor.vertex.positions), len(tensor.triangle.indices)),
]
print(f"io.read_triangle_mesh: {seen[0]} vertices and triangles; t.io.read_triangle_mesh: {seen[1]}")
sys.exit(seen != [(0, 0), (8, 12)])
PYTHON
