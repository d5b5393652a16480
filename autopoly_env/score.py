"""The reward of the paper: 100 IoU - w_sc (V + E + F) - w_si self-intersections."""

from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import combinations

import numpy as np
import shapely

from autopoly_env.arguments import number
from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import pixels_of, raster_kernels, workspace
from autopoly_env.shown import short
from autopoly_env.silhouette import Target


@dataclass(frozen=True)
class ScoreWeights:
    """Weights of the reward's three terms (paper, section 3.5), and of what a step may leave in peace."""

    w_sm: float = 100.0
    w_sc: float = 0.3  # the paper's for ShapeNet silhouettes; 1 for its synthetic shapes
    w_si: float = 5.0
    w_locality: float = 0.0  # of the share of old vertices that a step moves; counts in choosing steps, not in r_all

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            with suppress(ConfigError):
                if number(name, value) >= 0.0:
                    continue
            raise ConfigError(f"{name} = {short(value)}: expected a finite weight of at least 0")


@dataclass(frozen=True)
class Score:
    """What a mesh is worth, and why."""

    iou: float  # r_sm, 0 to 1, of the rendering binarised at half coverage; of small pictures' exact areas
    complexity: int  # r_sc = V + E + F
    self_intersections: int  # r_si
    total: float  # r_all

    def as_dict(self) -> dict[str, float]:
        """The four numbers by name, as a construction sequence keeps them."""
        return asdict(self)


def score(mesh: PolyMesh, target: Target, weights: ScoreWeights) -> Score:
    """Score a mesh against a target at the target's resolution."""
    return score_of(mesh, intersection_over_union(mesh, target), weights)


def score_of(mesh: PolyMesh, iou: float, weights: ScoreWeights, complexity: int | None = None) -> Score:
    """Score a mesh whose IoU is known; `complexity` in the place of its own, where that is given."""
    crossings = self_intersections(mesh)
    counted = mesh.complexity if complexity is None else complexity
    total = weights.w_sm * iou - weights.w_sc * counted - weights.w_si * crossings
    return Score(iou, counted, crossings, total)


def intersection_over_union(mesh: PolyMesh, target: Target) -> float:
    """IoU, 0 to 1, of the pixels that the mesh covers by half or more and the target's mask.

    Where the target has weights: those of the intersection over those of the union, both summed exactly. Where it is
    scored by area, a pixel counts by the share of it that the mesh covers, overlaps once: the exact IoU of the shapes.
    """
    edges = mesh.topology.boundary_half_edges
    work = workspace(target.resolution, len(edges))
    return iou_of(raster_kernels.overlap_counts(mesh.vertices, edges, pixels_of(target), work), target)


def iou_of(overlap: tuple[float, float], target: Target) -> float:
    """The IoU by what a mesh fills: (inside the target's mask, all of it), as `raster_kernels.overlap_counts` says."""
    inside, filled = overlap
    union = filled + target.n_filled - inside
    return float(inside / union) if union else 1.0


def self_intersections(mesh: PolyMesh) -> int:
    """Pairs of mesh edges that share no vertex and meet, touching included.

    Exact: the pairs that floating-point rounding would decide are left to shapely's robust predicates.
    """
    found = mesh.defects
    return _robust_count(mesh.vertices[mesh.edges], mesh.edges) if found.uncertain else found.crossings


def _robust_count(ends: FloatArray, edges: IntArray) -> int:
    apart = [(i, j) for i, j in combinations(range(len(edges)), 2) if not set(edges[i]) & set(edges[j])]
    is_point = (ends[:, 0] == ends[:, 1]).all(axis=1)  # shapely's lines without length meet nothing
    lines = np.where(is_point, shapely.points(ends[:, 0]), shapely.linestrings(ends))
    first, second = np.array(apart).T
    return int(shapely.intersects(lines[first], lines[second]).sum())
