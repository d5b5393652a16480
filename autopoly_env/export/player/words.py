"""Construction steps in words: what was done. `autopoly_env.export.byhand` tells how to do the same by hand."""

from dataclasses import dataclass

from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import operator_named
from autopoly_env.operators.wording import count
from autopoly_env.sequence import Lesson, Step


@dataclass(frozen=True)
class Words:
    """What there is to say about a step."""

    title: str  # "Extrude an edge"
    done: str  # what happened, with ids
    menu: str  # where Blender has the same in its menus
    blender: str  # the name of Blender's operator


def describe_step(step: Step, n_moved: int) -> Words:
    """A step in words, after which `n_moved` vertices are seen to move.

    `step.operator` is one of `OPERATORS`, as in every sequence that replays.
    """
    phrases = operator_named(step.operator).told
    return Words(phrases.title, f"{phrases.done(step)} {_moves(n_moved)}", phrases.menu, phrases.blender)


def describe_start(mesh: PolyMesh) -> Words:
    """The mesh that a construction starts from, in words."""
    n_vertices, _, n_faces = mesh.counts
    is_quad = (n_vertices, n_faces) == (4, 1)
    done = "The construction starts from a quad." if is_quad else f"The start has {count(n_faces, 'face')}."
    return Words("Start", done, "Add › Mesh › Plane", "mesh.primitive_plane_add")


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
