"""What a player does: an operator on an element of the current mesh, what it leaves free, and its mirror image."""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import NamedTuple

from autopoly_env.mesh import PolyMesh

Choice = Hashable  # what an action leaves free, by indices of the mesh: each operator says which (`Operator.choice`)


@dataclass(frozen=True, slots=True)
class Action:
    """What to do next: the name of an operator and the index of its element in the current mesh."""

    operator: str
    element: int


STOP = Action("stop", 0)


@dataclass(frozen=True)
class Halfway:
    """Between an action and its mirror image."""

    mesh: PolyMesh  # after the action
    action: Action  # its mirror image, on that mesh
    choice: Choice | None


class Start(NamedTuple):
    """A mesh right after an action, from which vertices are then moved."""

    choice: Choice | None  # with which the action was done
    mesh: PolyMesh
    halfway: Halfway | None = None  # before the mirror image of the action, where that came with it
