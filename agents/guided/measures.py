"""What can be measured about an action without a refit: numbers and places for the head that judges each action.

Letters: A actions, P points of each, M measures.
"""

from collections.abc import Sequence

import numpy as np

from agents.guided.config import class_of
from agents.guided.regions import N_POINTS, action_points
from autopoly_env.arrays import AnyArray, FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action, operator_named
from autopoly_env.placement import Disagreement
from autopoly_env.placement.blame_kernels import DEPTH, MASS

N_MEASURES = 9
_ALONG = (np.arange(N_POINTS) + 0.5)[:, None] / N_POINTS


def candidate_arrays(
    disagreement: Disagreement, actions: Sequence[Action], classes: tuple[str, ...]
) -> dict[str, AnyArray]:
    """What nFAP-Net reads about the legal actions, the residual prior left out: `agents.guided.nfap.Candidates`."""
    mesh = disagreement.mesh
    points = action_points(mesh, actions)
    return {
        "points": points.astype(np.float32),
        "classes": np.array([class_of(action, classes) for action in actions], np.int64),
        "spots": action_spots(mesh, actions, points).astype(np.float32),
        "measures": action_measures(disagreement, actions).astype(np.float32),
        "added": np.array([sum(_change(mesh, action)) for action in actions], np.float32),
    }


def action_spots(mesh: PolyMesh, actions: Sequence[Action], points: FloatArray) -> FloatArray:
    """(A, P, 2) where to look: at the `action_points`, but for a vertex along the line that would be there without."""
    spots = points.copy()
    around = _around(mesh)
    for row, action in enumerate(actions):
        if operator_named(action.operator).element.base == "vertex" and action.element in around:
            first, last = mesh.vertices[list(around[action.element])]
            spots[row] = first + _ALONG * (last - first)
    return spots


def action_measures(disagreement: Disagreement, actions: Sequence[Action]) -> FloatArray:
    """(A, M) numbers of about 0 to 1, areas as square roots.

    Length of the element; area and depth of what is missing, and of what is too much, at its edges; signed area that a
    vertex spans with its neighbours, positive where it bulges; excess in a face; the same of all edges in sum: missing,
    too much.
    """
    sides = np.maximum(disagreement.blame[:, :, [MASS, DEPTH]], 0.0)  # (B, 2, 2)
    everywhere = np.sqrt(sides[:, :, 0].sum(axis=0))
    around = _around(disagreement.mesh)
    rows = [[*_measured(disagreement, sides, around, action), *everywhere] for action in actions]
    return np.array(rows, np.float64).reshape(len(actions), N_MEASURES)


def _change(mesh: PolyMesh, action: Action) -> tuple[int, int, int]:
    return operator_named(action.operator).change_at(mesh, action.element)


def _around(mesh: PolyMesh) -> dict[int, tuple[int, int]]:
    """The vertices before and after each boundary vertex."""
    directed = mesh.topology.boundary_half_edges.tolist()
    before = {b: a for a, b in directed}
    return {a: (before[a], b) for a, b in directed}


def _measured(
    disagreement: Disagreement, sides: FloatArray, around: dict[int, tuple[int, int]], action: Action
) -> list[float]:
    """The measures of one action's own element."""
    kind = operator_named(action.operator).element
    mesh, base, element = disagreement.mesh, kind.base, kind.place(action.element)
    length = spanned = excess = 0.0
    blame = np.zeros((2, 2))
    if base == "edge":
        a, b = mesh.vertices[mesh.edges[element]]
        length = float(np.hypot(*(b - a)))
        row = disagreement.row_of_edge.get(element, -1)
        blame = sides[row] if row >= 0 else blame
    elif base == "vertex" and element in around:
        before, after = around[element]
        u, v = mesh.vertices[element] - mesh.vertices[before], mesh.vertices[after] - mesh.vertices[element]
        length, area = float(np.hypot(*(u + v))), 0.5 * float(u[0] * v[1] - u[1] * v[0])
        spanned = float(np.copysign(np.sqrt(abs(area)), area))
        at = [disagreement.row_of_edge[mesh.edge_index(*ends)] for ends in ((before, element), (element, after))]
        blame = np.column_stack((sides[at, :, 0].sum(axis=0), sides[at, :, 1].max(axis=0)))
    elif base == "face":
        length = float(np.sqrt(max(mesh.face_areas()[element], 0.0)))
        region = disagreement.excess_in(element)
        excess = 0.0 if region is None else float(np.sqrt(-region.area))
    (missing, missing_depth), (too_much, too_much_depth) = blame
    return [length, missing**0.5, missing_depth, too_much**0.5, too_much_depth, spanned, excess]
