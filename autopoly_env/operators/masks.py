"""The masks of several operators at once: those whose rule a kernel knows in one call, the others one by one."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from autopoly_env.arrays import BoolArray, IntArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import mask_kernels
from autopoly_env.operators.edge_dissolve import dissolvable_edges
from autopoly_env.operators.edge_extrude import boundary_edges
from autopoly_env.operators.edge_subdivide import any_edge
from autopoly_env.operators.face_delete import any_face_but_the_last
from autopoly_env.operators.face_hole import faces_with_room
from autopoly_env.operators.face_split import corners_with_diagonal
from autopoly_env.operators.operator import Operator
from autopoly_env.operators.vertex_dissolve import dissolvable_vertices

_RULES: dict[Callable[[PolyMesh], BoolArray], int] = {
    any_edge: mask_kernels.ALL_EDGES,
    boundary_edges: mask_kernels.RIM_EDGES,
    dissolvable_edges: mask_kernels.JOINABLE_EDGES,
    any_face_but_the_last: mask_kernels.SPARE_FACES,
    faces_with_room: mask_kernels.ROOMY_FACES,
    corners_with_diagonal: mask_kernels.SPLITTABLE_CORNERS,
    dissolvable_vertices: mask_kernels.DISSOLVABLE_VERTICES,
}
_UNBOUNDED = np.full(3, np.iinfo(np.int64).max // 2)


def rule_of(operator: Operator) -> int:
    """Which of the kernel's rules its mask is; -1 for none, and for one whose changes vary from element to element."""
    return -1 if operator.varies is not None else _RULES.get(operator.mask, -1)


def table_of(operators: Sequence[Operator], starts: Sequence[int], room: Sequence[int]) -> IntArray:
    """What `mask_kernels.legal` is told of operators with a rule, where their masks begin and how long they may be."""
    table = np.zeros((len(operators), mask_kernels.N_COLUMNS), np.int64)
    for row, operator, start, most in zip(table, operators, starts, room, strict=True):
        changes = [number for change in operator.changes for number in change]
        row[: mask_kernels.CHANGES] = rule_of(operator), start, most, operator.element.n_each
        row[mask_kernels.CHANGES : mask_kernels.CHANGES + len(changes)] = changes
    return table


def legal_masks(mesh: PolyMesh, operators: Sequence[Operator]) -> Iterator[tuple[Operator, BoolArray]]:
    """Each operator with its mask, as `Operator.legal_mask` gives it."""
    known = [operator for operator in operators if rule_of(operator) >= 0]
    counts = [operator.element.count(mesh) for operator in known]
    ends = np.cumsum([0, *counts]).tolist()
    masks = np.zeros(ends[-1], np.bool_)
    table = table_of(known, ends[:-1], counts)
    mask_kernels.legal(mesh.vertices, mesh.topology.packed, table, _UNBOUNDED, masks)
    places = {operator.name: slice(a, b) for operator, a, b in zip(known, ends, ends[1:], strict=False)}
    for operator in operators:
        yield operator, masks[places[operator.name]] if operator.name in places else operator.legal_mask(mesh)
