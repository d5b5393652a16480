"""How a step is told: what happened, and what to press in Blender to do the same by hand."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from autopoly_env.errors import ConfigError
from autopoly_env.operators.deeds import Deed
from autopoly_env.shown import told

_MOST_WORDS = 80  # letters that name an element

EDGES, FACES, VERTICES = "`2`", "`3`", "`1`"  # Blender's select modes, for what is told in plain words


class Told(Protocol):
    """A step, by ids: see `autopoly_env.sequence.Step`."""

    @property
    def element(self) -> Mapping[str, Any]: ...
    @property
    def choice(self) -> Mapping[str, Any] | None: ...
    @property
    def created(self) -> Mapping[str, list[int]]: ...
    @property
    def removed(self) -> Mapping[str, list[int]]: ...


@dataclass(frozen=True)
class Gesture:
    """What the hand does for a step in Blender, in the letters of the keystroke-level model.

    K is a key, P is pointing somewhere, B is a mouse button going down or up, M is making up one's mind (Card, Moran
    and Newell 1980): a click on something is PBB. Raises ConfigError for other letters and for less than no element.
    """

    strokes: str = "BBPBB"  # from having selected to being done; a command of the context menu, if nothing is known
    n_selected: int = 1  # elements that are selected beforehand
    drags: bool = False  # whether it ends with dragging what is new, out of its sources, to where it is wanted

    def __post_init__(self) -> None:
        if set(self.strokes) - set("KPBM"):
            raise ConfigError(f"strokes {self.strokes!r}: expected letters of K, P, B and M, such as KPBB")
        if self.n_selected < 0:
            raise ConfigError(f"n_selected {self.n_selected}: expected 0 or more elements")


def from_a_menu(_step: Told) -> Gesture:
    """The gesture of an operator of which nothing is known: one element is selected, a command taken from a menu."""
    return Gesture()


@dataclass(frozen=True)
class Phrases:
    """What there is to say about the steps of one operator; keys to press stand between backticks.

    What to do by hand is best told in records, which Blender can be driven by; plain words do where there are none.
    """

    title: str  # "Extrude an edge"
    done: Callable[[Told], str]  # what happened, a sentence with ids
    keys: Callable[[Told], tuple[Deed | str, ...]]  # what to do in Blender's edit mode, one after the other
    menu: str  # where Blender has the same in its menus
    blender: str  # the name of Blender's operator
    gesture: Callable[[Told], Gesture] = from_a_menu  # what `keys` cost the hand (docs/lessons.md)
    why: str = ""  # what it is good for, a sentence


def element_words(step: Told) -> str:
    """The element of a step: `edge 3–7`, `face 0, vertex 2`."""
    words = {
        key: "–".join(map(str, value)) if isinstance(value, list) else value for key, value in step.element.items()
    }
    return told(", ".join(f"{key} {value}" for key, value in words.items()), _MOST_WORDS)


def begun_with(step: Told) -> str:
    """The same at the beginning of a sentence."""
    return element_words(step).capitalize()


def count(n: int, noun: str) -> str:
    """`1 face`, `2 vertices`."""
    plural = {"vertex": "vertices"}.get(noun, f"{noun}s")
    return f"{n} {noun if n == 1 else plural}"


def phrases_of(name: str, effect: str) -> Phrases:
    """What can be said of any operator."""
    title = name.replace("_", " ").capitalize()
    return Phrases(
        title,
        lambda step: f"{begun_with(step)}: {effect}.",
        lambda step: (f"{title}, {element_words(step)}: {effect}",),
        "",
        "",
    )
