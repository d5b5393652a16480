"""Actions: an operator on an element of the current mesh, and their numbering for a Discrete action space."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators.edits import HOLE_SIDES
from autopoly_env.operators.registry import OPERATORS, Operator, n_elements

CAPACITY_PER_VERTEX = {"vertex": 1, "edge": 2, "face": 1, "corner": 4, "hole": len(HOLE_SIDES)}


@dataclass(frozen=True, slots=True)
class Action:
    """What to do next: the name of an operator and the index of its element in the current mesh."""

    operator: str
    element: int


STOP = Action("stop", 0)


class ActionCodec:
    """A numbering of actions that is the same for every mesh within the capacities; index 0 is STOP.

    The operators follow in the order given, each with as many indices as its element kind has capacity. With
    N `max_vertices` a mesh may have N vertices, 2 N edges, N faces, 4 N corners and 2 N holes. A grid of
    quads stays below that at any size; planar graphs could have up to 3 N - 6 edges and 2 N - 5 faces, but
    those are triangulations, which no good construction is. An action that would leave the capacities is
    masked.
    """

    def __init__(self, operators: tuple[str, ...], max_vertices: int) -> None:
        """`operators` are names of OPERATORS. Raises ConfigError for an unknown name or too few vertices."""
        if max_vertices < 4:
            raise ConfigError(f"max_vertices is {max_vertices}; give at least 4, a rectangle")
        self.operators = operators
        self.max_vertices = max_vertices
        self.capacity = {kind: n * max_vertices for kind, n in CAPACITY_PER_VERTEX.items()}
        self._start: dict[str, int] = {}
        self.n_actions = 1
        for operator in _look_up(operators):
            self._start[operator.name] = self.n_actions
            self.n_actions += self.capacity[operator.element]

    def encode(self, action: Action) -> int:
        """The index of an action. Raises IllegalActionError if it has none."""
        if action == STOP:
            return 0
        if action.operator not in self._start:
            raise IllegalActionError(
                f"no index for {action.operator!r}; give stop or one of {', '.join(self.operators)}"
            )
        capacity = self.capacity[OPERATORS[action.operator].element]
        if not 0 <= action.element < capacity:
            raise IllegalActionError(f"no index for {action}; its element must lie in 0..{capacity - 1}")
        return self._start[action.operator] + action.element

    def decode(self, index: int) -> Action:
        """The action with this index. Raises IllegalActionError outside 0..n_actions-1."""
        if not 0 <= index < self.n_actions:
            raise IllegalActionError(f"no action has index {index}; give 0..{self.n_actions - 1}")
        if index == 0:
            return STOP
        name = max((name for name, start in self._start.items() if start <= index), key=self._start.__getitem__)
        return Action(name, int(index) - self._start[name])

    def legal_mask(self, mesh: PolyMesh) -> BoolArray:
        """(n_actions,) the actions that the mesh allows and that stay within the capacities; STOP always."""
        mask = np.zeros(self.n_actions, np.bool_)
        mask[0] = True
        for operator in _look_up(self.operators):
            legal = self._within_capacity(operator, mesh)
            start, n = self._start[operator.name], min(len(legal), self.capacity[operator.element])
            mask[start : start + n] = legal[:n]
        return mask

    def _within_capacity(self, operator: Operator, mesh: PolyMesh) -> BoolArray:
        limits = self.max_vertices, self.capacity["edge"], self.capacity["face"]
        legal = operator.legal_mask(mesh).copy()
        for i, change in enumerate(operator.changes):
            if any(d > 0 and n + d > limit for n, d, limit in zip(mesh.counts, change, limits, strict=True)):
                legal[i :: len(operator.changes)] = False
        return legal


def legal_actions(mesh: PolyMesh, operators: Iterable[str]) -> list[Action]:
    """Every action of the named operators that the mesh allows; without capacities, and without STOP."""
    return [
        Action(operator.name, element)
        for operator in _look_up(operators)
        for element in np.flatnonzero(operator.legal_mask(mesh)).tolist()
    ]


def describe(mesh: PolyMesh, action: Action) -> str:
    """The action in words, with ids: `edge_subdivide edge 3–7`, `face_hole face 0, 4 sides`, `stop`."""
    if action == STOP:
        return "stop"
    kind, element = OPERATORS[action.operator].element, action.element
    if not 0 <= element < n_elements(mesh, kind):
        return f"{action.operator} {kind} #{element}, not in this mesh"
    links, vertex_ids, face_ids = mesh.topology.links, mesh.vertex_ids, mesh.face_ids
    match kind:
        case "edge":
            a, b = mesh.edges[element]
            where = f"edge {vertex_ids[a]}–{vertex_ids[b]}"
        case "corner":
            where = f"face {face_ids[links.faces[element]]} at vertex {vertex_ids[links.tails[element]]}"
        case "hole":
            face, sides = divmod(element, len(HOLE_SIDES))
            where = f"face {face_ids[face]}, {HOLE_SIDES[sides]} sides"
        case _:
            where = f"{kind} {(vertex_ids if kind == 'vertex' else face_ids)[element]}"
    return f"{action.operator} {where}"


def _look_up(operators: Iterable[str]) -> list[Operator]:
    names = list(operators)
    unknown = [name for name in names if name not in OPERATORS]
    if unknown:
        raise ConfigError(f"operator {unknown[0]!r} is unknown; give names from {', '.join(OPERATORS)}")
    return [OPERATORS[name] for name in names]
