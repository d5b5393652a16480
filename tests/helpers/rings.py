"""Rings and games for tests of tracing."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from agents.trace.rings import Ring
from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import defects_of, is_valid
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import SQUARE, painted
from tests.helpers.shapes import star

NO_WALLS = np.empty((0, 4))
GAME = Simulator(painted(SQUARE), resolution=16)
PAPER_GAME = Simulator(painted(SQUARE), resolution=16, operators="paper")
BOX = np.array([(0.2, 0.2), (0.8, 0.2), (0.8, 0.8), (0.2, 0.8)])
TRIANGLE = np.array([(0.2, 0.2), (0.8, 0.3), (0.4, 0.8)])


def small(points: npt.ArrayLike, x: float, y: float, scale: float = 0.2) -> FloatArray:
    """A ring shrunk about the centre of the image and moved to another."""
    return (np.asarray(points, np.float64) - 0.5) * scale + (x, y)


def hole(points: FloatArray, parent: int = 0) -> Ring:
    return Ring(points[::-1], parent)


def regular(n: int) -> FloatArray:
    angles = 2.0 * np.pi * np.arange(n) / n
    return 0.5 + 0.4 * np.column_stack((np.cos(angles), np.sin(angles)))


def assert_sane(states: Sequence[State]) -> None:
    """Each state follows from the one before, is valid, and has no crossing or flipped face."""
    assert states[0].action is None
    for step, state in enumerate(states):
        assert state.step == step
        assert is_valid(state.mesh) and defects_of(state.mesh) == (0, 0)


def random_rings(seed: int) -> list[Ring]:
    """A blob in the middle with up to four holes, and up to four parts in the corners, some of them triangles."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(6, 24))
    blob = 0.5 + (regular(n) - 0.5) * rng.uniform(0.65, 0.85, (n, 1))
    places = [(0.42, 0.42), (0.58, 0.42), (0.42, 0.58), (0.58, 0.58)]
    corners = [(0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9)]
    holes = [hole(some_ring(rng, places[k], 0.07)) for k in rng.permutation(4)[: rng.integers(0, 5)]]
    parts = [Ring(some_ring(rng, corners[k], 0.09), -1) for k in rng.permutation(4)[: rng.integers(0, 5)]]
    return [Ring(blob, -1), *parts, *holes]


def some_ring(rng: np.random.Generator, centre: tuple[float, float], radius: float) -> FloatArray:
    if rng.random() < 0.3:
        return small(TRIANGLE, *centre, 2 * radius)
    return star(int(rng.integers(2**32)), int(rng.integers(4, 12)), centre, radius)
