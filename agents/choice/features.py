"""What ChoiceNet is told of a state and of each legal action: numbers, and patches of the picture around the action.

A patch lies along its action - an edge, a vertex with its neighbours, a corner, a face - so that a picture that is
turned or made larger shows the same. Letters: A actions, N points a side of a patch, F numbers of an action, G of a
state, Q of what its value is judged by.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agents.guided.config import class_of
from agents.guided.measures import action_measures, action_spots
from agents.guided.regions import action_points
from agents.search.evaluator import ResidualEvaluator
from autopoly_env.arrays import Float32Array, FloatArray, IntArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action, operator_named
from autopoly_env.placement import Disagreement
from autopoly_env.placement.blame_kernels import DEPTH, HIGH, LOW, MASS
from autopoly_env.simulator import Simulator, State

RULES = ("any", "convex", "quads")
N_NUMBERS = 18  # of an action, beside its patches
N_GLOBALS = 13
_N_LARGEST = 6  # areas of each kind that a value is judged by
N_VALUE = 4 * _N_LARGEST
N_CHANNELS = 2  # of a patch: target, rendering
_NEAR, _FAR = 1.5, 0.35  # half a patch: in lengths of the element; in the unit square
_SHORTEST = 0.03  # length (unit square) as which a shorter element counts
_MANY = 20.0  # vertices, edges or faces


@dataclass(frozen=True)
class Look:
    """One state as the network sees it."""

    classes: IntArray  # (A,) indices, -1 for an action that it does not know
    numbers: Float32Array  # (A, N_NUMBERS)
    patches: Float32Array  # (A, 2, N_CHANNELS, N, N) near and far
    whole: Float32Array  # (G,)
    value: Float32Array  # (Q,)

    @property
    def inputs(self) -> Float32Array:
        """(A, F) numbers and patches."""
        n_points = int(np.prod(self.patches.shape[1:]))
        return np.concatenate((self.numbers, self.patches.reshape(len(self.numbers), n_points)), axis=1)


def look(
    simulator: Simulator, state: State, actions: Sequence[Action], classes: Sequence[str], side: int
) -> tuple[Look, FloatArray]:
    """What there is to see, and the residual prior (A,) of the actions, which is one of the numbers."""
    disagreement = Disagreement(state.mesh, simulator.silhouette)
    residual = ResidualEvaluator().prior_by(disagreement, actions) if actions else np.empty(0)
    points = action_points(state.mesh, actions)
    spots = action_spots(state.mesh, actions, points)
    whole, value = look_at_whole(simulator, state, disagreement)
    seen = Look(
        np.array([class_of(action, tuple(classes)) for action in actions], np.int64),
        _numbers(simulator, disagreement, actions, residual),
        _patches(disagreement, _frames(state.mesh, actions, spots), side),
        whole,
        value,
    )
    return seen, residual


def look_at_whole(
    simulator: Simulator, state: State, disagreement: Disagreement | None = None
) -> tuple[Float32Array, Float32Array]:
    """(G,) the rules and the state in numbers; (Q,) the largest areas that are missing and too much, and how deep."""
    disagreement = disagreement or Disagreement(state.mesh, simulator.silhouette)
    w_sc = simulator.weights.w_sc
    masses = np.maximum(disagreement.blame[:, :, MASS], 0.0)
    depths = np.maximum(disagreement.blame[:, :, DEPTH], 0.0)
    whole = [
        w_sc,
        np.log10(max(w_sc, 1e-3)),
        *(float(simulator.faces == rule) for rule in RULES),
        *(n / _MANY for n in state.mesh.counts),
        *np.sqrt(masses.sum(axis=0)),
        min(disagreement.n_regions, 40) / 10.0,
        state.score.iou,
        float(state.score.self_intersections > 0),
    ]
    value = [_largest(table[:, side]) for table in (np.sqrt(masses), depths) for side in (0, 1)]
    return np.array(whole, np.float32), np.concatenate(value).astype(np.float32)


def _largest(values: FloatArray) -> FloatArray:
    padded = np.zeros(_N_LARGEST)
    top = -np.sort(-values)[:_N_LARGEST]
    padded[: len(top)] = top
    return padded


def _numbers(
    simulator: Simulator, disagreement: Disagreement, actions: Sequence[Action], residual: FloatArray
) -> Float32Array:
    """(A, N_NUMBERS) measures, where along its edge the blame lies, elements and their price, the residual prior."""
    numbers = np.zeros((len(actions), N_NUMBERS), np.float32)
    numbers[:, :9] = 4.0 * action_measures(disagreement, actions)
    for row, action in enumerate(actions):
        operator = operator_named(action.operator)
        if operator.element.base == "edge":
            at = disagreement.row_of_edge.get(operator.element.place(action.element), -1)
            if at >= 0:
                numbers[row, 9:13] = disagreement.blame[at][:, [LOW, HIGH]].ravel()
        change = operator.change_at(disagreement.mesh, action.element)
        numbers[row, 13:16] = np.array(change) / 4.0
        numbers[row, 16] = simulator.weights.w_sc * sum(change)
    numbers[:, 17] = np.log(residual) / 4.0
    return numbers


def _frames(mesh: PolyMesh, actions: Sequence[Action], spots: FloatArray) -> FloatArray:
    """(A, 2, 2) where each action is, and the vector along it; on the boundary as the boundary runs."""
    frames = np.zeros((len(actions), 2, 2))
    if not len(actions):
        return frames
    frames[:, 0] = spots.mean(axis=1)
    along = spots[:, -1] - spots[:, 0]
    runs = {tuple(pair) for pair in mesh.topology.boundary_half_edges.tolist()}
    for row, action in enumerate(actions):
        kind = operator_named(action.operator).element
        if kind.base == "face":
            along[row] = spots[row, spots.shape[1] // 2] - spots[row, 0]
        elif kind.base == "edge":
            a, b = mesh.edges[kind.place(action.element)].tolist()
            along[row] = mesh.vertices[b] - mesh.vertices[a]
            if (b, a) in runs:
                along[row] = -along[row]
    frames[:, 1] = along
    return frames


def _patches(disagreement: Disagreement, frames: FloatArray, side: int) -> Float32Array:
    """(A, 2, N_CHANNELS, N, N) target and rendering around each frame, nearest pixels, 0 outside of the picture."""
    size = len(disagreement.difference)
    target = disagreement.target.astype(np.float32)
    pictures = np.zeros((N_CHANNELS, size + 1, size + 1), np.float32)  # a row and a column of nothing
    pictures[0, :size, :size] = target
    pictures[1, :size, :size] = disagreement.covered
    length = np.hypot(*frames[:, 1].T)
    axis = np.where(length[:, None] > 1e-9, frames[:, 1] / np.maximum(length, 1e-9)[:, None], (1.0, 0.0))
    across = np.column_stack((-axis[:, 1], axis[:, 0]))
    steps = (2.0 * (np.arange(side) + 0.5) / side) - 1.0
    reach = np.column_stack((_NEAR * np.maximum(length, _SHORTEST), np.full(len(frames), _FAR)))  # (A, 2)
    x = steps[None, None, None, :] * reach[:, :, None, None]
    y = steps[None, None, :, None] * reach[:, :, None, None]
    at = (
        frames[:, 0, None, None, None]
        + x[..., None] * axis[:, None, None, None]
        + y[..., None] * across[:, None, None, None]
    )
    cells = np.floor(at * size).astype(np.int64)
    cells[(cells < 0) | (cells >= size)] = size
    seen: Float32Array = pictures[:, cells[..., 1], cells[..., 0]]  # (C, A, 2, N, N)
    return np.ascontiguousarray(np.moveaxis(seen, 0, 2))
