"""What a hand does in Blender for a step, as records: a lesson's words are made of them, and Blender is driven by them.

Elements go by the ids of the construction. An id below 0 is a vertex that does not last until the end of the step.
"""

from dataclasses import dataclass

Ids = tuple[int, ...]


@dataclass(frozen=True)
class Selection:
    """Elements of one kind that are selected; as a deed: select these and nothing else, in the mode of that kind.

    Vertices are (vertex,), edges their ends, faces (face,) or three corners and more where they have no id.
    """

    kind: str  # "vertex", "edge" or "face"
    elements: tuple[Ids, ...] = ()


NOTHING, NO_EDGE, NO_FACE = Selection("vertex"), Selection("edge"), Selection("face")


@dataclass(frozen=True)
class Press:
    """A key, and perhaps an entry of the menu that it opens, works on what is selected."""

    keys: tuple[str, ...]
    entry: str = ""
    unticked: tuple[str, ...] = ()  # in the panel that opens at the lower left, or with F9
    typed: str = ""  # a number, confirmed with Enter
    leaves: Selection | None = None  # what it leaves selected; None: the same as before
    effect: str = ""  # a few words
    on_sources: bool = False  # whether what it makes lies on what it was made of, until a later deed


@dataclass(frozen=True)
class Pull:
    """`E`: an edge is copied, and the copy dragged to where one of its ends, or its middle, belongs."""

    sources: Ids
    copies: Ids
    middle: int | None = None  # the vertex that their middle becomes later; None: one of the copies comes to its place


@dataclass(frozen=True)
class Loop:
    """`Ctrl` `R` at an edge, and the slide."""

    edge: Ids


@dataclass(frozen=True)
class Cut:
    """`K`: the knife along some paths, of vertices that are there or that it makes."""

    paths: tuple[Ids, ...]


Deed = Selection | Press | Pull | Loop | Cut


def select(kind: str, *elements: Ids) -> Selection:
    """What is clicked, the others with Shift."""
    return Selection(kind, elements)
