"""The random construction simulator: shapes that a few topological actions make out of a rectangle.

The paper's source of training data (section "Training data"): from a rectangle, pick a random element, apply a random
action to it, translate all vertices at random, and again. It leaves open how to keep such shapes worth looking at:
here every counted action shows in the outline, and all that shows is wide enough to be seen at 64 x 64 pixels.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import preset
from autopoly_env.raster import coverage, workspace
from autopoly_env.score import ScoreWeights, score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from autopoly_env.targets.construction_kernels import shows_all
from autopoly_env.targets.dice import Dice
from autopoly_env.targets.growth import OUTLINE_OPERATORS, Growth, grow

SALT = 1
MAX_DIFFICULTY = 10
N_CONSTRUCTIONS = 300  # begun for one target at most
SIDE = (0.7, 0.88)  # longer side of the finished shape's bounding box, unit square
SMALL = 64  # pixels a side at which every part and hole still shows
MIN_SIDE = 0.6  # where an earlier shape would leave the picture otherwise
BORDER = 0.01  # what an earlier shape keeps from the border of the picture
AREA = (0.085, 0.595)  # share of the picture; pixels may add or take half a per cent
SYNTHETIC_WEIGHTS = ScoreWeights(w_sc=1.0)  # the paper's for its synthetic shapes


@dataclass(frozen=True)
class ConstructionTargets:
    """Random shapes, and how they were made.

    `difficulty`: how many actions change the outline, from 1 to 10, or the least and the most of them. A `face_split`
    shows nothing: it comes with the deletion of one of the parts, and the two count as one. `operators`: a preset
    ("paper", "full") or names; inner edges are neither subdivided nor dissolved, which would show nothing.
    `resolution` R: pixels a side, 32 to 1024.

    Raises ConfigError for settings out of range.
    """

    difficulty: int | tuple[int, int] = (1, 5)
    operators: str | Sequence[str] = "paper"
    resolution: int = 128
    name = "construction"

    def __post_init__(self) -> None:
        bounds, allowed = self._range(), range(1, MAX_DIFFICULTY + 1)
        if len(bounds) != 2 or not set(bounds) <= set(allowed) or bounds[0] > bounds[1]:
            expected = f"a whole number from 1 to {MAX_DIFFICULTY}, or the least and the most of them"
            raise ConfigError(f"difficulty {self.difficulty}: expected {expected}")
        if not 32 <= self.resolution <= 1024:
            raise ConfigError(f"resolution {self.resolution}: expected 32 to 1024 pixels a side")
        if not set(OUTLINE_OPERATORS).intersection(self._operators()):
            raise ConfigError(f"operators {self.operators!r}: expected at least one of {', '.join(OUTLINE_OPERATORS)}")

    def _range(self) -> tuple[int, ...]:
        return (self.difficulty, self.difficulty) if isinstance(self.difficulty, int) else tuple(self.difficulty)

    def _operators(self) -> list[str]:
        name = self.operators if isinstance(self.operators, str) else ",".join(self.operators)
        return [operator.name for operator in preset(name)]

    def sample(self, seed: int) -> Silhouette:
        """The shape of this seed, 0 <= seed < 2**32, named after it.

        Raises ConfigError for another seed, and where the operators give no shape of the difficulty.
        """
        return self._silhouette(seed, self._construct(seed).last)

    def sample_sequence(self, seed: int) -> ConstructionSequence:
        """How the shape of this seed was made, scored against it; the last mesh renders exactly as `sample` shows."""
        growth = self._construct(seed)
        silhouette = self._silhouette(seed, growth.last)
        target = silhouette.target(self.resolution)
        settings = {
            "target": silhouette.name,
            "operators": ",".join(self._operators()),
            "resolution": self.resolution,
            **asdict(SYNTHETIC_WEIGHTS),
        }

        def scored(mesh: PolyMesh) -> dict[str, float]:
            return score(mesh, target, SYNTHETIC_WEIGHTS).as_dict()

        transitions = [(*step, scored(step.mesh)) for step in growth.told()]
        return ConstructionSequence.record(settings, growth.first, scored(growth.first), transitions)

    def _silhouette(self, seed: int, mesh: PolyMesh) -> Silhouette:
        return Silhouette(coverage(mesh, self.resolution) >= 0.5, f"{self.name}_{seed}")

    def _construct(self, seed: int) -> Growth:
        """The rectangle and the steps from it, all in the picture."""
        dice = Dice(SALT, seed)
        least, most = self._range()
        n_changes = dice.whole(least, most)
        operators = self._operators()
        for _ in range(N_CONSTRUCTIONS):
            grown = grow(dice, operators, n_changes)
            placed = grown and _placed(grown, dice.between(*SIDE))
            if placed:
                return placed
        raise ConfigError(
            f"operators {','.join(operators)} gave no shape of difficulty {n_changes} in {N_CONSTRUCTIONS} trials; "
            "lower the difficulty or add operators"
        )


def _placed(growth: Growth, side: float) -> Growth | None:
    """The construction scaled and moved so that the last shape is centred, the longer side of its box being `side`.

    It gets smaller to keep the earlier shapes in the picture and its area in bounds; None if that is too small.
    """
    final = growth.last
    low, high = final.vertices.min(axis=0), final.vertices.max(axis=0)
    centre, extent, area = 0.5 * (low + high), float((high - low).max()), float(final.face_areas().sum())
    reach = max(float(np.abs(places - centre).max()) for places in (growth.start, growth.places))
    scale = min(side / extent, np.sqrt(AREA[1] / area), (0.5 - BORDER) / reach)
    if scale * extent < MIN_SIDE or scale**2 * area < AREA[0]:
        return None
    placed = growth.put(scale, centre)
    return placed if _shows_all(placed.last) else None


def _shows_all(mesh: PolyMesh) -> bool:
    """Whether a small picture of the mesh has all its parts and holes, and no other."""
    work = workspace(SMALL, len(mesh.topology.boundary_half_edges))
    return bool(shows_all(mesh.vertices, mesh.topology.packed, work, np.empty((SMALL, SMALL))))
