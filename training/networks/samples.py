"""From a labelled construction to what the networks read: pictures and numbers, and the truth beside them.

Letters: n stages, S pixels a side, A actions, P points of each, Q vertices, E edges.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from agents.guided.config import STOP_CLASS, NfapConfig, WarpConfig, class_of
from agents.guided.measures import candidate_arrays
from agents.guided.pictures import draw_inputs, rendering
from agents.guided.regions import region_image
from autopoly_env.arguments import above, at_least
from autopoly_env.arrays import AnyArray, Float32Array, FloatArray
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, STOP, Action
from autopoly_env.placement import Disagreement, tried
from autopoly_env.shown import short
from training.networks.prices import prices_of
from training.networks.trajectories import Labelled, Trajectory

Sample = dict[str, AnyArray]
_UNLIKELY = 0.1  # of the probability of the likeliest action: what is below has no part in the expected region


@dataclass(frozen=True)
class LabelConfig:
    """How outcomes become probabilities."""

    temperature: float = 0.5  # r_all points: of the softmax over what the actions gain, 0 for stopping
    w_sm: float = 100.0
    w_sc: float | tuple[float, float] = 0.3  # of two, each sample has a price of its own, evenly in its logarithm
    w_si: float = 5.0

    def __post_init__(self) -> None:
        above(0, temperature=self.temperature)
        low, high = self.prices
        at_least(0, w_sm=self.w_sm, w_sc=low, w_si=self.w_si)
        if low != high and not 0.0 < low < high < math.inf:
            raise ConfigError(f"w_sc = {short(self.w_sc)}: expected one price, or two above 0, the lower first")

    @property
    def prices(self) -> tuple[float, float]:
        """The least and the highest price."""
        return prices_of(self.w_sc)

    def gains(self, state: Labelled, w_sc: float) -> FloatArray:
        """(A,) what each action adds to r_all at a price; -infinity where it is not known."""
        weights = np.array((self.w_sm, -w_sc, -self.w_si))
        gains = (state.outcomes - state.score) @ weights
        return np.where(np.isnan(gains), -np.inf, gains)

    def policy(self, state: Labelled, w_sc: float) -> FloatArray:
        """(1+A,) probabilities of stopping and of each action: of the outcomes, or all on the one that was taken."""
        gains = np.concatenate(([0.0], self.gains(state, w_sc)))
        if not np.isfinite(gains[1:]).any():
            probabilities = np.zeros(len(gains))
            probabilities[state.chosen + 1] = 1.0
            return probabilities
        probabilities = np.exp((gains - gains.max()) / self.temperature)
        return probabilities / probabilities.sum()


# --- one sample ---


def nfap_sample(trajectory: Trajectory, k: int, config: NfapConfig, labels: LabelConfig, w_sc: float) -> Sample:
    """What nFAP-Net reads in state k, and the truth of its n stages; see `agents.guided.nfap.NfapLabels`.

    `w_sc` is the price that the labels of stage 1 are for.
    """
    size, state = config.image_size, trajectory.states[k]
    classes = np.array([class_of(action, config.classes) for action in state.actions], np.int64)
    policy = labels.policy(state, w_sc)
    first = np.bincount(classes, policy[1:], len(config.classes))
    first[STOP_CLASS] = policy[0]
    images, regions, operators = zip(*_stages(trajectory, k, config), strict=True)
    expected = _expected_region(state, policy[1:] * (classes == operators[0]), config.image_size)
    moving = policy[1:].sum()
    gains = labels.gains(state, w_sc)
    return {
        "pictures": draw_inputs(state.mesh, trajectory.silhouette.target(size).coverage, config.inputs),
        "told": np.array(config.told(trajectory.faces, w_sc), np.float32),
        "images": np.stack(images),
        "regions": np.stack((expected, *regions[1:])),
        "operators": np.array(operators),
        "first": first.astype(np.float32),
        **candidate_arrays(Disagreement(state.mesh, trajectory.silhouette), state.actions, config.classes),
        "log_residual": state.log_residual,
        "policy": (policy[1:] / moving if moving > 1e-6 else 0.0 * policy[1:]).astype(np.float32),
        "gains": np.where(np.isfinite(gains), gains, -1e3).astype(np.float32),
    }


def _expected_region(state: Labelled, policy: FloatArray, size: int) -> Float32Array:
    """(S, S) the mean region of the actions, by their probabilities (A,), unlikely ones left out; 0 if all are 0."""
    likely = policy > _UNLIKELY * policy.max(initial=0.0)
    shares = np.where(likely, policy, 0.0) / max(policy[likely].sum(), 1e-12)
    region = np.zeros((size, size), np.float32)
    for row in np.flatnonzero(likely):
        region += np.float32(shares[row]) * region_image(state.mesh, state.actions[row], size)
    return region


def _stages(trajectory: Trajectory, k: int, config: NfapConfig) -> Iterator[tuple[Float32Array, Float32Array, int]]:
    """Image after the action, region, class of each stage."""
    for stage in range(k, k + config.n):
        state = trajectory.states[min(stage, trajectory.n_actions)]
        action = state.actions[state.chosen] if stage < trajectory.n_actions else STOP
        after = trajectory.states[min(stage + 1, trajectory.n_actions)].mesh
        yield (
            rendering(after, config.image_size),
            region_image(state.mesh, action, config.image_size),
            class_of(action, config.classes),
        )


def warp_sample(trajectory: Trajectory, k: int, config: WarpConfig, placed: bool) -> Sample:
    """What WarpNet reads after the action that was taken in state k; see `agents.guided.warp.WarpNet`.

    `placed`: new vertices begin where rendering and target disagree, otherwise where the operator puts them. "full" is
    the rendering after the full refit.
    """
    state, size = trajectory.states[k], config.image_size
    mesh = start_mesh(trajectory, state, placed)
    target = trajectory.silhouette.target(size).coverage.astype(np.float32)
    return {
        "pictures": np.stack((rendering(mesh, size), target)),
        "vertices": mesh.vertices.astype(np.float32),
        "edges": mesh.topology.boundary_half_edges,
        "full": rendering(trajectory.states[k + 1].mesh, size),
    }


def start_mesh(trajectory: Trajectory, state: Labelled, placed: bool) -> PolyMesh:
    """The mesh after the action that was taken, before any refit."""
    action: Action = state.actions[state.chosen]
    try:
        if placed:
            return tried(Disagreement(state.mesh, trajectory.silhouette), action).starts[0].mesh
        return OPERATORS[action.operator].apply(state.mesh, action.element)
    except IllegalActionError:  # a hole that fits nowhere but where the sequence has it
        return state.mesh


# --- symmetry: eight ways to look at the same construction ---


def turned(sample: Sample, way: int) -> Sample:
    """The sample mirrored (bit 0: x, bit 1: y) and transposed (bit 2)."""
    return {name: _turned(name, array, way) for name, array in sample.items()}


def _turned(name: str, array: AnyArray, way: int) -> AnyArray:
    mirror_x, mirror_y, transpose = way & 1, way & 2, way & 4
    if name in ("pictures", "images", "regions", "full"):
        array = array[..., ::-1] if mirror_x else array
        array = array[..., ::-1, :] if mirror_y else array
        return np.ascontiguousarray(np.swapaxes(array, -1, -2) if transpose else array)
    if name in ("points", "spots", "vertices"):
        at = array.copy()
        at[..., 0] = 1.0 - at[..., 0] if mirror_x else at[..., 0]
        at[..., 1] = 1.0 - at[..., 1] if mirror_y else at[..., 1]
        return np.ascontiguousarray(at[..., ::-1] if transpose else at)
    if name == "edges" and way.bit_count() % 2:  # so that areas stay positive
        return np.ascontiguousarray(array[:, ::-1])
    return array
