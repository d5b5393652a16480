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

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from autopoly_env.arrays import BoolArray, IntArray
from autopoly_env.errors import MeshError
from autopoly_env.mesh import ASKED_TURN, FaceRule, PolyMesh, Topology
from autopoly_env.raster import picture_of, workspace
from autopoly_env.raster.raster_kernels import Picture
from autopoly_env.refit import refit_kernels
from autopoly_env.refit.rule_kernels import FREE, LOCKED, NO_RULE, Rule
from autopoly_env.refit.shape_kernels import Settings, Shape, Ties
from autopoly_env.silhouette import Silhouette, Target, sums_with_background


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


@dataclass(frozen=True)
class RefitTarget:
    """The pyramid that a refit climbs."""

    pictures: tuple[Picture, Picture, Picture, Picture]

    @classmethod
    def of(cls, silhouette: Silhouette, resolution: int, background: float = 1.0) -> "RefitTarget":
        """Levels R/8, R/4, R/2 and R = `resolution`, none below 8 pixels (or R, if that is less).

        `background` is what a pixel outside the silhouette weighs beside one inside.
        """
        sizes = [max(min(8, resolution), resolution // divisor) for divisor in (8, 4, 2, 1)]
        pictures = [_picture(silhouette.target(size), background) for size in sizes]
        return cls((pictures[0], pictures[1], pictures[2], pictures[3]))

    @property
    def resolution(self) -> int:
        """R of the finest level."""
        return len(self.pictures[-1].coverage)


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


@dataclass(frozen=True)
class RefitResult:
    """A refitted mesh, and how far it came."""

    mesh: PolyMesh
    loss_before: float
    loss: float
    n_evaluations: int  # renderings with derivatives


def refit(
    mesh: PolyMesh,
    target: RefitTarget,
    config: RefitConfig = DEFAULT,
    bonds: Bonds | None = None,
    faces: FaceRule = "any",
) -> RefitResult:
    """Move the vertices of `mesh` to match `target`, as far as `bonds` let them.

    The result is finite, its loss is at most that of `mesh`, and unless `config.keep_defects` it has no more
    self-intersections and no more flipped faces; under a rule of faces no corner that turns too little is new, and none
    turns less than before: what keeps the rule keeps it. Vertices that would gain nothing stay bit for bit where
    they are; vertices off the boundary follow their neighbours. Positions stay in the unit square, if they started
    there.
    Raises MeshError for vertices that are not finite.
    """
    if not np.isfinite(mesh.vertices).all():
        raise MeshError("the mesh to refit has vertices that are not finite: give finite positions")
    shape = shape_for(mesh.topology, faces, bonds)
    moved = np.empty_like(mesh.vertices)
    before, after, n_evaluations = refit_kernels.refit(
        mesh.vertices,
        shape,
        target.pictures,
        config.settings,
        workspace(target.resolution, len(shape.loops)),
        moved,
    )
    return RefitResult(mesh.with_vertices(moved), before, after, n_evaluations)


def shape_for(topology: Topology, faces: FaceRule, bonds: Bonds | None) -> Shape:
    """What the kernels need for a refit under a rule of faces and bonds."""
    shape = shape_of(topology) if faces == "any" else _ruled(topology)
    return shape if bonds is None else _bound(shape, bonds)


def _picture(target: Target, background: float) -> Picture:
    """The target as refits see it, where a pixel outside weighs `background`."""
    if background == 1.0:
        return picture_of(target)
    return Picture(target.coverage, *sums_with_background(target, background))


def _bound(shape: Shape, bonds: Bonds) -> Shape:
    """The shape with its unknowns tied; of two mirror images the first leads."""
    numbers = np.full(len(bonds.images), -1, np.int64)
    numbers[shape.boundary] = np.arange(len(shape.boundary))
    own = numbers[shape.boundary]
    images = bonds.images[shape.boundary]
    leader = np.where(images < 0, own, np.minimum(own, numbers[images]))
    leader[bonds.locked[shape.boundary]] = -1
    free = [k for k, v in enumerate(shape.inner) if not bonds.locked[v]]
    parts = [shape.neighbours[shape.neighbour_offsets[k] : shape.neighbour_offsets[k + 1]] for k in free]
    rule = shape.rule
    if rule is not NO_RULE:
        partners = np.where(images < 0, FREE, numbers[images])
        rule = rule._replace(images=np.where(bonds.locked[shape.boundary], LOCKED, partners))
    return shape._replace(
        rule=rule,
        inner=shape.inner[free],
        neighbours=np.concatenate([*parts, np.empty(0, np.int64)]),
        neighbour_offsets=np.cumsum([0, *map(len, parts)]),
        ties=Ties(leader, images == shape.boundary, float(bonds.axis)),
    )


@lru_cache(maxsize=4096)
def shape_of(topology: Topology) -> Shape:
    """What the kernels need of a topology."""
    arrays = topology.arrays
    return Shape(
        boundary=arrays.outer,  # writable, as under bonds and rules: the kernel is compiled for one type
        loops=arrays.loops,
        edges=arrays.edges,
        on_rim=topology.is_boundary_edge,
        corners=topology.corners,
        offsets=topology.face_offsets,
        inner=arrays.inner,
        neighbours=arrays.neighbours,
        neighbour_offsets=arrays.neighbour_offsets,
    )


@lru_cache(maxsize=4096)
def rule_of(topology: Topology) -> Rule:
    """What the kernels need of the corners of faces. Unknowns are numbered as in `_ruled`, first the boundary's."""
    shape = shape_of(topology)
    unknown = np.empty(topology.n_vertices, np.int64)
    unknown[np.concatenate((shape.boundary, shape.inner))] = np.arange(topology.n_vertices)
    at = unknown[topology.corners]
    following = topology.arrays.following
    triples = np.empty((len(at), 3), np.int64)
    triples[following] = np.column_stack((at, at[following], at[following[following]]))
    return Rule(
        triples,
        unknown[shape.inner],
        unknown[shape.neighbours],
        shape.neighbour_offsets,
        np.full(len(unknown), FREE),
        ASKED_TURN,
    )


@lru_cache(maxsize=4096)
def _ruled(topology: Topology) -> Shape:
    """`shape_of` with all vertices as unknowns and their corners bound to turn."""
    shape, nothing = shape_of(topology), np.empty(0, np.int64)
    return shape._replace(
        boundary=np.concatenate((shape.boundary, shape.inner)),
        inner=nothing,
        neighbours=nothing,
        neighbour_offsets=np.zeros(1, np.int64),
        rule=rule_of(topology),
    )
