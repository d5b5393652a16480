"""What a hand does, in words; keys to press stand between backticks."""

from collections.abc import Collection, Iterable, Mapping

from autopoly_env.operators.deeds import Ids, Press
from autopoly_env.operators.wording import count

MOST_NAMED = 6  # elements that are selected; of more only the number is told

Place = tuple[float, float]


def number(value: float) -> str:
    """`0.25`, `-0.125`, `0`."""
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def place(at: Place) -> str:
    """`(0.250, 0.125)`."""
    x, y = (f"{value + 0.0:.3f}" for value in at)
    return f"({x}, {y})"


def element(kind: str, ids: Ids) -> str:
    """`vertex 4`, `edge 0–1`, `face 3`; what does not last has no name."""
    if min(ids) < 0:
        return f"the new {kind}"
    if kind == "face" and len(ids) > 1:
        return "the face between " + ", ".join(map(str, ids))
    return f"{kind} {'–'.join(map(str, ids))}"


def mode(key: str, kind: str) -> str:
    """Pressing the key of a select mode."""
    return f"`{key}` {kind} select"


def click(name: str, is_further: bool) -> str:
    """A click that selects."""
    return f"`Shift` click {name}" if is_further else f"click {name}"


def press(what: Press) -> str:
    """A key, an entry of its menu, a number, what it does."""
    keys = what.keys[0] if what.keys == ("Right-click",) else " ".join(f"`{key}`" for key in what.keys)
    words = f"{keys} › {what.entry}" if what.entry else keys
    if what.typed:
        words += f", type `{what.typed}` `Enter`"
    if what.unticked:
        words += f"; in the panel at the lower left (`F9`) untick {', '.join(what.unticked)}"
    return f"{words}: {what.effect}" if what.effect else words


def drag(key: str, doing: str, what: str, to: Place, by: Place) -> str:
    """Moving what is selected, to a place or by a distance."""
    x, y = (number(value) for value in by)
    return f"`{key}`: {doing} until {what} is at {place(to)}; or type `{x}` `Tab` `{y}` `Enter`"


def loop(edge: Ids, slide: tuple[str, Place, float] | None) -> str:
    """A loop cut that stays in the middle (None), or slides until a vertex is at a place, by a factor."""
    words = f"`Ctrl` `R`, point at {element('edge', edge)}, click"
    if slide is None:
        return f"{words}, right-click: the loop stays in the middle"
    name, to, factor = slide
    return (
        f"{words}; slide it until {name} is at {place(to)}, click; or type `{number(factor)}` `Enter` "
        f"(`{number(-factor)}` if it goes the other way)"
    )


def cut(paths: Iterable[Iterable[str]]) -> str:
    """The knife along paths of clicks."""
    first, *others = (", ".join(path) for path in paths)
    further = "".join(f"; right-click begins a second cut: click {path}" for path in others)
    return f"`K` knife: click {first}{further}; `Enter`"


def state(kind: str, selected: Collection[Ids], faces: Mapping[Ids, int]) -> str:
    """What mode Blender is in, and what is selected; `faces` are the ids of faces by their sorted corners."""
    if kind == "object":
        return "Object mode; the plane is selected."
    words = f"{kind.capitalize()} mode; "
    if not selected:
        return words + "nothing is selected."
    if len(selected) > MOST_NAMED:
        return f"{words}{count(len(selected), kind)} are selected."
    if kind == "face":
        names = [element("face", (faces[ids],) if ids in faces else ids) for ids in sorted(selected)]
    else:
        names = [element(kind, ids) for ids in sorted(selected)]
    return words + _joined(names, kind) + (" is selected." if len(names) == 1 else " are selected.")


def _joined(names: list[str], kind: str) -> str:
    """`edge 0–4`, `edges 0–4 and 1–4`."""
    if len(names) == 1:
        return names[0]
    plural = {"vertex": "vertices"}.get(kind, f"{kind}s")
    bare = [name.removeprefix(f"{kind} ") for name in names]
    return f"{plural} {', '.join(bare[:-1])} and {bare[-1]}"
