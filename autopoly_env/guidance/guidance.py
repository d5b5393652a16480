"""`Guidance`: what a user may ask of a construction - a mesh to start from, vertices to leave alone, symmetry.

(The fourth wish, where matching matters, is a property of the silhouette: see `importance`.)
"""

import hashlib
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from autopoly_env.arguments import number
from autopoly_env.errors import ConfigError, IllegalActionError, MeshError
from autopoly_env.guidance.symmetry import asymmetry, best_axis
from autopoly_env.mesh import PolyMesh, canonical_hash, defects_of, images_of, validate
from autopoly_env.mesh.symmetry import axis_of
from autopoly_env.operators import OPERATORS, Action, describe
from autopoly_env.refit import Bonds
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.shown import short
from autopoly_env.silhouette import Silhouette

MOST_CORNERS = 2000  # of a mesh to start from: a refit takes memory by their square
MOST_ASYMMETRIC = 0.01  # of its area, with which a silhouette is taken to be symmetric where that is decided by itself
_LEAST_ROOM = 1 / 64  # beside an axis, in the unit square
AUTO = "auto"
KEPT = {"holes": ("holes",), "parts": ("parts",), "all": ("holes", "parts")}  # what may be asked to be kept


@dataclass(frozen=True, eq=False)
class Guidance:
    """Wishes that have been checked; `of` checks them."""

    start: PolyMesh | None = None
    earlier: ConstructionSequence | None = None  # what led to `start`, if it was given
    locked: frozenset[int] = frozenset()  # ids of vertices that stay, and stay where they are
    axis: float | None = None  # x of the axis about which the outline is symmetric
    align: bool = False  # edges that are nearly upright, level, parallel or of equal length are to be exactly so
    keep: tuple[str, ...] = ()  # "holes", "parts": each of the picture's is to be one of the mesh's, whatever it costs

    @classmethod
    def of(
        cls,
        silhouette: Silhouette,
        start: PolyMesh | ConstructionSequence | None,
        locked: Collection[int],
        symmetry: bool | float | str | None,
        keep: str | None = None,
        align: bool = False,
    ) -> "Guidance":
        """See `Simulator` for the arguments. Raises ConfigError for what is impossible or contradicts itself."""
        earlier, mesh = (start, start.final()) if isinstance(start, ConstructionSequence) else (None, start)
        if mesh is not None:
            _check_start(mesh)
        _check_locked(mesh, locked)
        axis = _axis(silhouette, mesh, symmetry)
        if keep is not None and keep not in KEPT:
            raise ConfigError(f"keep {keep!r}: expected one of {', '.join(KEPT)}")
        guidance = cls(mesh, earlier, frozenset(map(int, locked)), axis, align, () if keep is None else KEPT[keep])
        if mesh is not None and axis is not None:
            guidance.check_symmetric(mesh)
            _check_images_locked(mesh, guidance.locked, axis)
        return guidance

    @property
    def names(self) -> tuple[str, ...]:
        """The wishes that only agents which play step by step can heed: some of start, locked and symmetry."""
        wishes = {"start": self.start is not None, "locked": bool(self.locked), "symmetry": self.axis is not None}
        return tuple(name for name, is_given in wishes.items() if is_given)

    def settings(self) -> dict[str, Any]:
        """The wishes as plain values, as a construction sequence keeps them; those that there are."""
        values: dict[str, Any] = {}
        if self.start is not None:
            values["start"] = canonical_hash(self.start)
        if self.earlier is not None:
            values["earlier_steps"] = len(self.earlier.steps)
        if self.locked:
            values["locked"] = sorted(self.locked)
        if self.axis is not None:
            values["symmetry"] = self.axis
        if self.align:
            values["align"] = True
        if self.keep:
            values["keep"] = ",".join(self.keep)
        return values

    def bonds(self, mesh: PolyMesh) -> Bonds | None:
        """What a refit of the mesh has to heed; None if it is free."""
        if not self.locked and self.axis is None:
            return None
        locked = np.array([name in self.locked for name in mesh.vertex_ids], np.bool_)
        if self.axis is None:
            return Bonds(locked, np.full(len(locked), -1, np.int64))
        images = images_of(mesh, self.axis)
        if images is None:
            raise self._unsymmetric("the mesh", mesh)
        return Bonds(locked, images, self.axis)

    def is_symmetric(self, mesh: PolyMesh) -> bool:
        """Whether the outline is symmetric about the axis, if there is one."""
        return self.axis is None or images_of(mesh, self.axis) is not None

    def check_symmetric(self, mesh: PolyMesh) -> None:
        """Raise ConfigError if symmetry is wished for and the outline has none."""
        if not self.is_symmetric(mesh):
            raise self._unsymmetric("the start mesh", mesh)

    def _unsymmetric(self, what: str, mesh: PolyMesh) -> ConfigError:
        own = axis_of(mesh)
        hint = "mirror it, or give another axis or none" if own is None else f"it is about x = {own:g}; give that axis"
        return ConfigError(f"the outline of {what} is not symmetric about x = {self.axis:g}: {hint}")

    def check_locks(self, before: PolyMesh, action: Action, after: PolyMesh) -> None:
        """Raise IllegalActionError if a locked vertex is gone after the action."""
        gone = self.locked.intersection(before.vertex_ids).difference(after.vertex_ids)
        if gone:
            raise IllegalActionError(
                f"{describe(before, action)} would remove vertex {min(gone)}, which is locked; choose another action"
            )

    def allows(self, mesh: PolyMesh, action: Action) -> bool:
        """Whether a legal action spares the locked vertices."""
        operator = OPERATORS[action.operator]
        if not self.locked or min(map(min, operator.changes)) >= 0:
            return True
        return self.locked.intersection(mesh.vertex_ids) <= set(operator.apply(mesh, action.element).vertex_ids)


def importance_settings(silhouette: Silhouette) -> dict[str, Any]:
    """A hash of the weights of a silhouette as a setting; nothing if it has none."""
    if silhouette.weights is None:
        return {}
    digest = hashlib.blake2b(silhouette.weights.astype("<f8").tobytes(), digest_size=16)
    return {"importance": digest.hexdigest()}


def continued(
    earlier: ConstructionSequence, later: ConstructionSequence, scores: list[dict[str, float]]
) -> ConstructionSequence:
    """The steps of `earlier`, rescored (`scores` of its start and of each step), followed by those of `later`."""
    steps = tuple(replace(step, score=score) for step, score in zip(earlier.steps, scores[1:], strict=True))
    return replace(earlier, settings=later.settings, start_score=scores[0], steps=(*steps, *later.steps))


def _check_start(mesh: PolyMesh) -> None:
    if not isinstance(mesh, PolyMesh):
        kind = type(mesh).__name__
        raise ConfigError(f"the start is a {kind}; expected a PolyMesh or a ConstructionSequence")
    n_corners = sum(map(len, mesh.faces))
    if n_corners > MOST_CORNERS:
        raise ConfigError(f"the start mesh has {n_corners} corners: expected at most {MOST_CORNERS}")
    try:
        validate(mesh)
    except MeshError as error:
        raise ConfigError(f"the start mesh is not valid: {error}") from None
    outside = np.flatnonzero(((mesh.vertices < 0.0) | (mesh.vertices > 1.0)).any(axis=1))
    if len(outside):
        name, (x, y) = mesh.vertex_ids[outside[0]], mesh.vertices[outside[0]]
        raise ConfigError(f"vertex {name} of the start mesh is at ({x:g}, {y:g}), outside the unit square: scale it in")
    crossings, flipped = defects_of(mesh)
    if crossings:
        raise ConfigError(
            f"the start mesh has {crossings} pairs of edges that cross or (nearly) touch: pull them apart"
        )
    if flipped:
        raise ConfigError(f"the start mesh has {flipped} flipped or empty faces: turn them over or leave them out")


def _check_locked(mesh: PolyMesh | None, locked: Collection[int]) -> None:
    if not isinstance(locked, Collection) or not all(isinstance(name, int | np.integer) for name in locked):
        raise ConfigError(f"locked={short(locked)}: expected ids of vertices, such as (0, 3)")
    if not locked:
        return
    if mesh is None:
        raise ConfigError(f"locked vertices {sorted(locked)} but no start mesh: give the mesh that has these ids")
    unknown = sorted(set(locked).difference(mesh.vertex_ids))
    if unknown:
        ids = ", ".join(map(str, mesh.vertex_ids[:12])) + (", ..." if len(mesh.vertex_ids) > 12 else "")
        raise ConfigError(f"locked vertex {unknown[0]} is not in the start mesh: its ids are {ids}")


def _axis(silhouette: Silhouette, start: PolyMesh | None, symmetry: bool | float | str | None) -> float | None:
    if symmetry is None or symmetry is False:
        return None
    if symmetry == AUTO:
        return _axis_of_both(silhouette, start)
    if isinstance(symmetry, str):
        raise ConfigError(f"symmetry {symmetry!r}: expected {AUTO!r}, True or the x of the axis")
    axis = _best_axis(silhouette, start) if symmetry is True else number("symmetry", symmetry)
    if axis is None:
        raise ConfigError(
            "the outline of the start mesh is not symmetric about any upright line: leave symmetry out "
            "(--symmetry off), or build the start with it (--symmetry best without --start)"
        )
    if not _has_room(axis):
        raise ConfigError(f"symmetry about x = {axis:g}: expected an axis well inside the unit square, such as 0.5")
    return axis


def _axis_of_both(silhouette: Silhouette, start: PolyMesh | None) -> float | None:
    """The axis where the start, if there is one, has it and the silhouette nearly so; else None."""
    axis = _best_axis(silhouette, start)
    is_so = axis is not None and _has_room(axis) and asymmetry(silhouette, axis) <= MOST_ASYMMETRIC
    return axis if is_so else None


def _best_axis(silhouette: Silhouette, start: PolyMesh | None) -> float | None:
    """The axis that suits the silhouette best; of a start that has another one that axis, None where it has none."""
    axis = best_axis(silhouette)
    return axis if start is None or images_of(start, axis) is not None else axis_of(start)


def _has_room(axis: float) -> bool:
    return _LEAST_ROOM <= axis <= 1.0 - _LEAST_ROOM


def _check_images_locked(mesh: PolyMesh, locked: frozenset[int], axis: float) -> None:
    images = images_of(mesh, axis)
    assert images is not None
    for name in sorted(locked):
        image = int(images[mesh.vertex_index(name)])
        if image >= 0 and mesh.vertex_ids[image] not in locked:
            raise ConfigError(
                f"vertex {name} is locked, its mirror image {mesh.vertex_ids[image]} is not: lock both or neither"
            )
