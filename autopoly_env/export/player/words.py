"""Construction steps in words: what was done, and what to press in Blender to do the same by hand."""

from dataclasses import dataclass

from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import operator_named
from autopoly_env.operators.wording import VERTICES, count
from autopoly_env.sequence import Lesson, Step


@dataclass(frozen=True)
class Words:
    """What there is to say about a step; keys to press stand between backticks."""

    title: str  # "Extrude an edge"
    done: str  # what happened, with ids
    keys: tuple[str, ...]  # what to do in Blender's edit mode, one after the other
    menu: str  # where Blender has the same in its menus
    blender: str  # the name of Blender's operator


def describe_step(step: Step, n_moved: int, n_left: int | None = None) -> Words:
    """A step in words, after which `n_moved` vertices are seen to move.

    By hand `n_left` of them have to be moved on their own, all if nothing is said: what an operator drags is in place.
    `step.operator` is one of `OPERATORS`, as in every sequence that replays.
    """
    phrases = operator_named(step.operator).told
    keys = phrases.keys(step)
    if n_moved if n_left is None else n_left:
        keys += ("`G`: move the green vertices one by one to where they are drawn",)
    return Words(phrases.title, f"{phrases.done(step)} {_moves(n_moved)}", keys, phrases.menu, phrases.blender)


def describe_start(mesh: PolyMesh) -> Words:
    """The mesh that a construction starts from, in words."""
    n_vertices, _, n_faces = mesh.counts
    is_quad = (n_vertices, n_faces) == (4, 1)
    done = "The construction starts from a quad." if is_quad else f"The start has {count(n_faces, 'face')}."
    keys = (
        "`Shift` `A`: Mesh, then Plane",
        "`Numpad 7` looks from above, `Tab` goes to edit mode",
        f"{VERTICES} vertex select, `G`: move the corners to where they are drawn",
    )
    if not is_quad:
        keys = (*keys[:2], f"`E` extrudes and `F` fills until there are {count(n_vertices, 'vertex')} as drawn")
    return Words("Start", done, keys, "Add › Mesh › Plane", "mesh.primitive_plane_add")


def describe_lesson(lesson: Lesson, n_parts: int) -> list[str]:
    """How the whole construction reads, a few words each: how long it takes by hand, its parts, its faces."""
    words = [f"{lesson.effort:.0f} s by hand"]
    if n_parts > 1:
        words += [count(n_parts, "part"), count(lesson.returns, "return")]
    words.append(f"{100 * lesson.quads:.0f} % quads")
    if lesson.ngons:
        words.append(count(lesson.ngons, "n-gon"))
    if lesson.concave:
        words.append(f"{lesson.concave} concave")
    return words


def _moves(n: int) -> str:
    if not n:
        return "All vertices stay."
    return f"Then {count(n, 'vertex')} {'moves' if n == 1 else 'move'} to fit the target."
