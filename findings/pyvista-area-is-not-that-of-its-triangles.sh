#!/usr/bin/env bash
# PyVista 0.49.1 (VTK 9.7.2): `mesh.area` is not the area of `mesh.triangulate()` where a polygon is concave.
#
# Input: an L of three unit squares, as one polygon of six corners.
# Guess: PolyData holds polygons, `triangulate` cuts this one right (area 3), and `area` says the same.
# Seen: `area` is 4, `triangulate().area` is 3: the one fans the polygon, the other clips ears. A concave polygon of four
# corners has the same area both ways.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check pyvista==0.49.1 vtk==9.7.2 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import numpy as np
import pyvista

SHAPES = {
    "L of six corners": [(2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0), (0, 0, 0)],
    "arrow of four": [(-1, -1, 0), (0, -0.5, 0), (1, -1, 0), (0, 1, 0)],
}
seen = []
for name, places in SHAPES.items():
    mesh = pyvista.PolyData(np.array(places, float), [len(places), *range(len(places))])
    seen.append((round(mesh.area, 9), round(mesh.triangulate().area, 9)))
    print(f"{name}: area {seen[-1][0]:g}, triangulate().area {seen[-1][1]:g}")
sys.exit(seen != [(4.0, 3.0), (1.5, 1.5)])
PYTHON
