"""An action tried on a disagreement: where a refit may begin after it, whether that shows, and its mirror image.

A refit finds the nearest optimum, so it matters where new vertices begin: at what the rendering still misses, or shows
too much of. The operators say how. Under symmetry an action that changes the outline is followed by its mirror image,
in one transition; an element that is its own mirror image needs one action, and so does what does not show, for inner
edges need not be symmetric.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh, defects_of, images_of
from autopoly_env.operators import Action, Operator, Start, describe, operator_named
from autopoly_env.operators.operator import Mirroring
from autopoly_env.operators.rebuilding import refusal
from autopoly_env.placement.disagreement import Disagreement


@dataclass(frozen=True)
class Trial:
    """What an action comes to before any vertex is refitted."""

    action: Action
    starts: list[Start]  # one or more; none has more defects than the operator's own result
    shows: bool  # whether it changes what is rendered; if not, a refit has nothing to gain


def tried(disagreement: Disagreement, action: Action, axis: float | None = None) -> Trial:
    """An action tried on the mesh of `disagreement`; with an `axis`, its outline stays symmetric about x = axis.

    Raises IllegalActionError as the operator does; under symmetry also where the mirror image of the action is illegal
    after it, or the two have no room.
    """
    mesh, operator = disagreement.mesh, operator_named(action.operator)
    n = operator.element.count(mesh)
    if not 0 <= action.element < n:
        kind = operator.element.name
        raise refusal(operator.name, kind, action.element, f"the mesh has {n}; give 0..{n - 1}")
    starts, shows = operator.starts(disagreement, action.element), operator.shows_at(mesh, action.element)
    if axis is not None:
        starts = _symmetric(disagreement, action, operator, starts, shows, axis)
    return Trial(action, starts, shows)


def _symmetric(
    disagreement: Disagreement, action: Action, operator: Operator, plain: list[Start], shows: bool, axis: float
) -> list[Start]:
    """The starts whose outlines are symmetric, none of them worse than the mesh before."""
    mesh = disagreement.mesh
    if images_of(mesh, axis) is None:
        raise IllegalActionError(f"the outline is not symmetric about x = {axis:g}; start from one that is")
    found = [
        start
        for start in (_mirrored(mesh, action, operator, plain, axis) if shows else plain)
        if _is_as_sane(start.mesh, disagreement) and images_of(start.mesh, axis) is not None
    ]
    if not found:
        raise IllegalActionError(f"{describe(mesh, action)} has no mirror image, or no room for it; choose another")
    return found


def _mirrored(mesh: PolyMesh, action: Action, operator: Operator, plain: list[Start], axis: float) -> Iterator[Start]:
    images = images_of(mesh, axis)
    assert images is not None
    for start in plain:
        yield from operator.mirrored(Mirroring(mesh, images, axis, action), start)


def _is_as_sane(made: PolyMesh, before: Disagreement) -> bool:
    return all(now <= then for now, then in zip(defects_of(made), before.defects, strict=True))
