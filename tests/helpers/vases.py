"""Meshes whose outline is its own mirror image, however they are cut inside."""

import numpy as np
from hypothesis import strategies as st

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS
from tests.helpers.shapes import polygon


def vase(seed: int, n: int = 6, axis: float = 0.5) -> FloatArray:
    """(2n + 2, 2) a polygon of positive area, symmetric about x = axis, with a corner on it above and below."""
    rng = np.random.default_rng(seed)
    heights = np.sort(0.1 + 0.8 * (np.arange(n + 2) + 0.8 * rng.random(n + 2)) / (n + 2))
    widths = 0.05 + 0.3 * rng.random(n)
    right = np.column_stack((axis + widths, heights[1:-1]))
    left = right[::-1] * (-1.0, 1.0) + (2.0 * axis, 0.0)
    return np.concatenate(([(axis, heights[0])], right, [(axis, heights[-1])], left))


def cut_anyhow(mesh: PolyMesh, seed: int, n_cuts: int) -> PolyMesh:
    """Some faces split, and some inner edges given a corner that is moved a little: left and right differ then."""
    rng = np.random.default_rng(seed)
    split, divide = OPERATORS["face_split"], OPERATORS["edge_subdivide"]
    for _ in range(n_cuts):
        corners = np.flatnonzero(split.legal_mask(mesh))
        if len(corners):
            mesh = split.apply(mesh, int(rng.choice(corners)))
        inner = [edge for edge, faces in enumerate(mesh.topology.edge_faces) if min(faces) >= 0]
        if inner and rng.random() < 0.5:
            divided = divide.apply(mesh, int(rng.choice(inner)))
            places = divided.vertices.copy()
            places[-1] += 1e-3 * rng.standard_normal(2)
            moved = divided.with_vertices(places)
            mesh = moved if is_sane(moved) else divided
    return mesh


def symmetric_meshes() -> st.SearchStrategy[PolyMesh]:
    """Vases of one face or many, about any axis."""
    seeds = st.integers(0, 2**32 - 1)
    outlines = st.builds(vase, seeds, st.integers(1, 10), st.sampled_from([0.5, 0.45, 1.0 / 3.0 + 0.1]))
    return st.builds(cut_anyhow, outlines.map(polygon), seeds, st.integers(0, 8))
