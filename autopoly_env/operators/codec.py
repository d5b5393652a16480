"""Actions by number, for a Discrete action space; which are legal; and what they are in words."""

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import mask_kernels
from autopoly_env.operators.action import STOP, Action
from autopoly_env.operators.elements import CAPACITY_PER_VERTEX
from autopoly_env.operators.masks import legal_masks, rule_of, table_of
from autopoly_env.operators.operator import Operator
from autopoly_env.operators.registry import operator_named, preset

_COUNTED = ("vertex", "edge", "face")  # what a change is of


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
        self._start: dict[str, int] = {}
        self.n_actions = 1
        for operator in map(operator_named, operators):
            self._start[operator.name] = self.n_actions
            self.n_actions += self._capacity(operator)
        self._names, self._starts = tuple(self._start), tuple(self._start.values())
        known = [operator for operator in map(operator_named, operators) if rule_of(operator) >= 0]
        self._others = [name for name in self._names if name not in {operator.name for operator in known}]
        self._table = table_of(known, [self._start[op.name] for op in known], list(map(self._capacity, known)))
        self._most = np.array([CAPACITY_PER_VERTEX[kind] * max_vertices for kind in _COUNTED])

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "operators": tuple(map(operator_named, self.operators))}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the operators known to this process, too."""
        vars(self).update(state, operators=tuple(operator.name for operator in preset(state["operators"])))

    def encode(self, action: Action) -> int:
        """The index of an action. Raises IllegalActionError if it has none."""
        if action == STOP:
            return 0
        if action.operator not in self._start:
            raise IllegalActionError(
                f"no index for {action.operator!r}; give stop or one of {', '.join(self.operators)}"
            )
        capacity = self._capacity(operator_named(action.operator))
        if not 0 <= action.element < capacity:
            raise IllegalActionError(f"no index for {action}; its element must lie in 0..{capacity - 1}")
        return self._start[action.operator] + action.element

    def decode(self, index: int) -> Action:
        """The action with this index. Raises IllegalActionError outside 0..n_actions-1."""
        if not 0 <= index < self.n_actions:
            raise IllegalActionError(f"no action has index {index}; give 0..{self.n_actions - 1}")
        if index == 0:
            return STOP
        k = bisect_right(self._starts, index) - 1
        return Action(self._names[k], int(index) - self._starts[k])

    def indices_of(self, operator: str) -> slice:
        """The numbers of all actions of an operator. Raises ConfigError if it is not one of the codec's."""
        if operator not in self._start:
            raise ConfigError(f"no index for {operator!r}; give one of {', '.join(self.operators)}")
        start = self._start[operator]
        return slice(start, start + self._capacity(operator_named(operator)))

    def legal_mask(self, mesh: PolyMesh) -> BoolArray:
        """(n_actions,) the actions that the mesh allows and that stay within the capacities; STOP always."""
        mask = np.zeros(self.n_actions, np.bool_)
        mask[0] = True
        mask_kernels.legal(mesh.vertices, mesh.topology.packed, self._table, self._most, mask)
        for name in self._others:
            operator, start = operator_named(name), self._start[name]
            legal, capacity = _within_capacity(operator, mesh, self._most.tolist()), self._capacity(operator)
            if len(legal) > capacity:
                legal = legal[:capacity]
            mask[start : start + len(legal)] = legal
        return mask

    def mask_of(self, actions: Iterable[Action]) -> BoolArray:
        """(n_actions,) STOP and those of the actions that have an index."""
        mask = np.zeros(self.n_actions, np.bool_)
        mask[0] = True
        for action in actions:
            with suppress(IllegalActionError):
                mask[self.encode(action)] = True
        return mask

    def _capacity(self, operator: Operator) -> int:
        return operator.element.per_vertex * self.max_vertices


def _within_capacity(operator: Operator, mesh: PolyMesh, limits: Sequence[int]) -> BoolArray:
    """The operator's mask, less what would take (V, E, F) beyond the limits."""
    legal, counts = operator.legal_mask(mesh), mesh.counts
    if operator.varies is not None:
        changes = [operator.change_at(mesh, element) for element in np.flatnonzero(legal).tolist()]
        if not all(_fits(counts, change, limits) for change in changes):
            legal = legal.copy()
            legal[legal] = [_fits(counts, change, limits) for change in changes]
        return legal
    for i, change in enumerate(operator.changes):
        if not _fits(counts, change, limits):
            legal = legal.copy()
            legal[i :: len(operator.changes)] = False
    return legal


def _fits(counts: Sequence[int], change: Sequence[int], limits: Sequence[int]) -> bool:
    """Whether (V, E, F) stay within the limits, as far as they grow."""
    (v, e, f), (dv, de, df), (most_v, most_e, most_f) = counts, change, limits
    return (dv <= 0 or v + dv <= most_v) and (de <= 0 or e + de <= most_e) and (df <= 0 or f + df <= most_f)


def legal_actions(mesh: PolyMesh, operators: Iterable[str]) -> list[Action]:
    """Every action of the named operators that the mesh allows; without capacities, and without STOP."""
    return [
        Action(operator.name, element)
        for operator, mask in legal_masks(mesh, tuple(map(operator_named, operators)))
        for element in np.flatnonzero(mask).tolist()
    ]


def describe(mesh: PolyMesh, action: Action) -> str:
    """The action in words, with ids: `edge_subdivide edge 3–7`, `face_hole face 0, 4 sides`, `stop`."""
    if action == STOP:
        return "stop"
    kind = operator_named(action.operator).element
    if not 0 <= action.element < kind.count(mesh):
        return f"{action.operator} {kind.name} #{action.element}, not in this mesh"
    return f"{action.operator} {kind.words(kind.ids(mesh, action.element))}"
