"""Inverse shape estimation: move all vertices of a mesh so that its rendering matches a target.

The picture is an exact function of the vertices, so this is a small least-squares problem: residual = coverage -
target per pixel, 2V unknowns, a Jacobian that is zero off the boundary. Limited-memory BFGS about the damped normal
equations runs up the target's pyramid. On the coarse levels an elastic term keeps boundary edges near what they were:
it carries an outline to a target many pixels away without tangling it, which plain gradient descent (the optional far
phase) does not.

Vertices may be bound (`Bonds`): then fewer unknowns lead, and gradient and normal equations are reduced to those.

Under a rule of faces (`autopoly_env.mesh.face_rule`) corners that turn too little cost as squared errors do, steps end
where all corners turn, and a mesh is kept only if they do.

Letters: V vertices, R pixels a side. The loss is the sum over pixels of (coverage - target)**2 at the finest level,
each pixel times its weight where the target has weights.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray, IntArray, read_only
from autopoly_env.details import hairline_arguments
from autopoly_env.errors import MeshError
from autopoly_env.mesh import ASKED_TURN, Defects, FaceRule, PolyMesh, Topology
from autopoly_env.raster import pixels_of, workspace
from autopoly_env.raster.raster_kernels import NO_WEIGHTS, Picture, Pixels
from autopoly_env.refit import refit_kernels
from autopoly_env.refit.pyramid_kernels import N_LEVELS, packed_sums, picture_in
from autopoly_env.refit.rule_kernels import FREE, LOCKED
from autopoly_env.refit.shape_kernels import Settings
from autopoly_env.silhouette import WEIGHT_STEPS, Silhouette, Target

_NOTHING = read_only(np.empty(0, np.int64))
_NO_PIXELS = Pixels(read_only(np.empty((0, 0), np.bool_)), NO_WEIGHTS)


@dataclass(frozen=True)
class RefitConfig:
    """How hard a refit tries."""

    first_level: int = 0  # of the pyramid's 4 levels (R/8, R/4, R/2, R), where to begin; 2 for a mesh that nearly fits
    n_near: int = 20  # quasi-Newton steps on each level, at most
    n_far: int = 0  # Adam steps that try to leave the optimum found, 0 for none
    stiffness: float = 0.1  # elastic term on the second level; 0.3 of it on the next, none on the last
    damping: float = 0.05  # absolute damping, in squared pixels: holds vertices that slide along a straight edge
    tolerance: float = 2e-3  # relative gain of a step below which a level is done
    keep_defects: bool = False  # allow new self-intersections and flipped faces

    @cached_property
    def settings(self) -> Settings:
        """The same for the kernel, each of its type."""
        return Settings(
            int(self.first_level),
            int(self.n_near),
            int(self.n_far),
            float(self.stiffness),
            float(self.damping),
            float(self.tolerance),
            bool(self.keep_defects),
        )


DEFAULT = RefitConfig()
FROM_AFAR = RefitConfig(n_far=60)  # nothing is known of the start
THOROUGH = RefitConfig(first_level=1, n_far=20)  # the start is roughly right
LOCAL = RefitConfig(first_level=2)  # the start nearly fits
QUICK = RefitConfig(first_level=2, tolerance=5e-3)  # most of the gain soon, of a target of `quick_resolution`


@dataclass(frozen=True, eq=False)
class RefitTarget:
    """The pyramid that a refit climbs, its four levels one after the other, coarse to fine, in each array."""

    sizes: IntArray  # (4,) R of each level
    coverages: FloatArray  # the levels' (R, R)
    weights: FloatArray  # the same of the pixels' weights, or empty
    sums: FloatArray  # what `pyramid_kernels.packed_sums` makes of these

    @classmethod
    def of(cls, silhouette: Silhouette, resolution: int, background: float = 1.0) -> "RefitTarget":
        """Levels R/8, R/4, R/2 and R = `resolution`, none below 8 pixels (or R, if that is less).

        `background` is what a pixel outside the silhouette weighs beside one inside.
        """
        levels = [max(min(8, resolution), resolution // divisor) for divisor in (8, 4, 2, 1)]
        return cls.of_levels(silhouette.pyramid(levels), background)

    @classmethod
    def of_levels(cls, levels: Sequence[Target], background: float = 1.0) -> "RefitTarget":
        """Four targets, coarse to fine."""
        weights = [level.weights.ravel() for level in levels if level.weights is not None]
        return _weighing(
            read_only(np.array([level.resolution for level in levels])),
            read_only(np.concatenate([level.coverage.ravel() for level in levels])),
            read_only(np.concatenate([*weights, np.empty(0)])),
            background,
        )

    def with_background(self, background: float) -> "RefitTarget":
        """The same levels, whose pixels outside the silhouette weigh `background`."""
        return _weighing(self.sizes, self.coverages, self.weights, background)

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """The four levels apart."""
        return tuple(picture_in(self.coverages, self.sums, level) for level in range(N_LEVELS))

    @cached_property
    def resolution(self) -> int:
        """R of the finest level."""
        return int(self.sizes[-1])


def _weighing(sizes: IntArray, coverages: FloatArray, weights: FloatArray, background: float) -> RefitTarget:
    sums = packed_sums(sizes, coverages, weights, float(background), float(WEIGHT_STEPS))
    return RefitTarget(sizes, coverages, weights, read_only(sums))


def quick_resolution(resolution: int) -> int:
    """The R of the target that `QUICK` is made for, where a whole refit has this one: 5/16 of it, at least 8."""
    return max(min(8, resolution), 5 * resolution // 16)


@dataclass(frozen=True, eq=False)
class Bonds:
    """What binds the V vertices of one mesh: some stay where they are, some are mirror images of others."""

    locked: BoolArray  # (V,) those that a refit leaves where they are, bit for bit
    images: IntArray  # (V,) the mirror image of each boundary vertex, itself on the axis; -1 where there is none
    axis: float = 0.5  # x of the vertical axis of the mirror


def holding(bonds: Bonds | None, held: BoolArray) -> Bonds:
    """`bonds` with the vertices `held` (V,) locked as well; those whose mirror image is free are left free."""
    if bonds is None:
        return Bonds(held, np.full(len(held), -1, np.int64))
    return replace(bonds, locked=bonds.locked | held & ((bonds.images < 0) | held[bonds.images]))


@dataclass(frozen=True, eq=False)
class Judge:
    """Targets that the mesh which a refit ends with is to be held to in the same call."""

    scored: Target | None = None  # `RefitResult.overlap` is with it
    shown: Target | None = None  # `RefitResult.n_hairlines` are those in view of it

    @cached_property
    def resolution(self) -> int:
        """Pixels a side of what is scored."""
        return 0 if self.scored is None else self.scored.resolution

    @cached_property
    def arguments(self) -> tuple[Any, ...]:
        """The same for the kernel."""
        pixels = _NO_PIXELS if self.scored is None else pixels_of(self.scored)
        return *pixels, *((NO_WEIGHTS, 0.0, 0.0) if self.shown is None else hairline_arguments(self.shown))


NOBODY = Judge()


class RefitResult(NamedTuple):
    """A refitted mesh, and how far it came."""

    mesh: PolyMesh
    loss_before: float
    loss: float
    n_evaluations: int  # renderings with derivatives
    which: int = 0  # of the starts led to it
    overlap: tuple[float, float] = (0.0, 0.0)  # what `overlap_counts` counts: filled pixels inside the target, and all
    n_hairlines: int = 0  # of `details.hairlines`


def refit(
    mesh: PolyMesh,
    target: RefitTarget,
    config: RefitConfig = DEFAULT,
    bonds: Bonds | None = None,
    faces: FaceRule = "any",
    judge: Judge = NOBODY,
) -> RefitResult:
    """Move the vertices of `mesh` to match `target`, as far as `bonds` let them.

    The result is finite, its loss is at most that of `mesh`, and unless `config.keep_defects` it has no more
    self-intersections and no more flipped faces; under a rule of faces no corner that turns too little is new, and none
    turns less than before: what keeps the rule keeps it. Vertices that would gain nothing stay bit for bit where
    they are; vertices off the boundary follow their neighbours. Positions stay in the unit square, if they started
    there.
    Raises MeshError for vertices that are not finite.
    """
    return refit_best([mesh], target, config, bonds, faces, judge)


def refit_best(
    starts: Sequence[PolyMesh],
    target: RefitTarget,
    config: RefitConfig = DEFAULT,
    bonds: Bonds | None = None,
    faces: FaceRule = "any",
    judge: Judge = NOBODY,
) -> RefitResult:
    """`refit` of meshes of one topology: the one that ends with the fewest defects, and of those with the least loss.

    Defects are those of `mesh.defects_of` under the rule of faces; of equals it is the first.
    Raises MeshError where none has finite vertices.
    """
    mesh = starts[0]
    points = mesh.vertices[None] if len(starts) == 1 else read_only(np.array([s.vertices for s in starts]))
    resolution = max(target.resolution, judge.resolution)
    moved = np.empty_like(points)
    which, before, after, n_evaluations, *found, inside, filled, n_hairlines = refit_kernels.refit(
        points,
        *shape_arguments(mesh.topology, faces, bonds),
        target.coverages,
        target.sums,
        *config.settings,
        *judge.arguments,
        workspace(resolution, len(mesh.topology.boundary_half_edges)),
        moved,
    )
    if which < 0:
        raise MeshError("the mesh to refit has vertices that are not finite: give finite positions")
    best = starts[which].with_vertices(moved[which], Defects(*found))
    return RefitResult(best, before, after, n_evaluations, which, (inside, filled), n_hairlines)


class _Bound(NamedTuple):
    """What a refit is told that is not the topology's own, in the order in which `shape_kernels.shape_of` reads it."""

    boundary: IntArray
    inner: IntArray
    neighbours: IntArray
    neighbour_offsets: IntArray
    leader: IntArray = _NOTHING
    on_axis: IntArray = _NOTHING
    triples: IntArray = _NOTHING
    rule_inner: IntArray = _NOTHING
    rule_neighbours: IntArray = _NOTHING
    rule_offsets: IntArray = _NOTHING
    images: IntArray = _NOTHING


def shape_arguments(
    topology: Topology, faces: FaceRule, bonds: Bonds | None
) -> tuple[IntArray, IntArray, float, float]:
    """What `shape_kernels.shape_of` is to be called with for a refit under a rule of faces and bonds."""
    asked = 0.0 if faces == "any" else ASKED_TURN
    if bonds is None:
        return topology.packed, _NOTHING if faces == "any" else _packed_rule(topology), 0.5, asked
    return topology.packed, _packed(_tied(topology, faces, bonds)), float(bonds.axis), asked


def _tied(topology: Topology, faces: FaceRule, bonds: Bonds) -> _Bound:
    """The unknowns tied; of two mirror images the first leads."""
    shape = _free(topology) if faces == "any" else _ruled(topology)
    numbers = np.full(len(bonds.images), -1, np.int64)
    numbers[shape.boundary] = np.arange(len(shape.boundary))
    own = numbers[shape.boundary]
    images = bonds.images[shape.boundary]
    leader = np.where(images < 0, own, np.minimum(own, numbers[images]))
    leader[bonds.locked[shape.boundary]] = -1
    free = [k for k, v in enumerate(shape.inner) if not bonds.locked[v]]
    parts = [shape.neighbours[shape.neighbour_offsets[k] : shape.neighbour_offsets[k + 1]] for k in free]
    partners = np.where(images < 0, FREE, numbers[images])
    return shape._replace(
        inner=shape.inner[free],
        neighbours=np.concatenate([*parts, _NOTHING]),
        neighbour_offsets=np.cumsum([0, *map(len, parts)]),
        leader=leader,
        on_axis=(images == shape.boundary).astype(np.int64),
        images=_NOTHING if faces == "any" else np.where(bonds.locked[shape.boundary], LOCKED, partners),
    )


def _free(topology: Topology) -> _Bound:
    arrays = topology.arrays
    return _Bound(arrays.outer, arrays.inner, arrays.neighbours, arrays.neighbour_offsets)


@lru_cache(maxsize=4096)
def _ruled(topology: Topology) -> _Bound:
    """All vertices as unknowns, first those of the boundary, and their corners bound to turn."""
    arrays = topology.arrays
    boundary = np.concatenate((arrays.outer, arrays.inner))
    unknown = np.empty(topology.n_vertices, np.int64)
    unknown[boundary] = np.arange(topology.n_vertices)
    at, following = unknown[arrays.corners], arrays.following
    triples = np.empty((len(at), 3), np.int64)
    triples[following] = np.column_stack((at, at[following], at[following[following]]))
    return _Bound(
        *(boundary, _NOTHING, _NOTHING, np.zeros(1, np.int64)),
        triples=triples.ravel(),
        rule_inner=unknown[arrays.inner],
        rule_neighbours=unknown[arrays.neighbours],
        rule_offsets=arrays.neighbour_offsets,
        images=np.full(len(unknown), FREE),
    )


@lru_cache(maxsize=4096)
def _packed_rule(topology: Topology) -> IntArray:
    return _packed(_ruled(topology))


def _packed(bound: _Bound) -> IntArray:
    """The parts in one array, which begins with where each of them begins, and the last one ends."""
    lengths = [len(bound) + 1, *map(len, bound)]
    return read_only(np.concatenate((np.cumsum(lengths), *bound)))
