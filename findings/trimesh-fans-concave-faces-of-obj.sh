#!/usr/bin/env bash
# trimesh 5.2.0 and libigl 2.6.3 read a concave face of an OBJ file as a fan from its first corner.
#
# Input: an L of three unit squares, one face of six corners; OBJ sets no limit to the corners of a face and asks for
# flat ones only, not for convex ones.
# Guess: both cut it into triangles that do not overlap, of area 3; or refuse it.
# Seen: area 4 in both, without a word: a triangle lies outside the L, on top of another one. Which corner the file names
# first decides whether that happens: from the inner corner the area is 3.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check trimesh==5.2.0 libigl==2.6.3 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import igl
import trimesh

PLACES = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\n"
seen = {}
for first, face in (("an outer corner", "f 1 2 3 4 5 6\n"), ("the inner corner", "f 3 4 5 6 1 2\n")):
    with open("ell.obj", "w") as file:
        file.write(PLACES + face)
    vertices, faces = igl.read_triangle_mesh("ell.obj")[:2]
    seen[first] = float(trimesh.load_mesh("ell.obj").area), float(igl.doublearea(vertices, faces).sum() / 2)
    print(f"first named {first}: trimesh {seen[first][0]:g}, libigl {seen[first][1]:g}; the L has 3")
sys.exit(seen != {"an outer corner": (4.0, 4.0), "the inner corner": (3.0, 3.0)})
PYTHON
