"""Construction steps in words: what was done, and what to press in Blender to do the same by hand."""

from collections.abc import Callable
from dataclasses import dataclass

from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import Step
from autopoly_env.sequence.ids import element_words

EDGES, FACES, VERTICES = "`2`", "`3`", "`1`"  # Blender's select modes


@dataclass(frozen=True)
class Words:
    """What there is to say about a step; keys to press stand between backticks."""

    title: str  # "Extrude an edge"
    done: str  # what happened, with ids
    keys: tuple[str, ...]  # what to do in Blender's edit mode, one after the other
    menu: str  # where Blender has the same in its menus
    blender: str  # the name of Blender's operator


@dataclass(frozen=True)
class _Phrases:
    title: str
    done: Callable[[Step], str]
    keys: Callable[[Step], tuple[str, ...]]
    menu: str
    blender: str


def describe_step(step: Step, n_moved: int) -> Words:
    """A step in words, after which `n_moved` vertices are seen to move.

    `step.operator` is one of `OPERATORS`, as in every sequence that replays.
    """
    phrases = _PHRASES[step.operator]
    keys = phrases.keys(step)
    if n_moved:
        keys += ("`G`: move the green vertices one by one to where they are drawn",)
    return Words(phrases.title, f"{phrases.done(step)} {_moves(n_moved)}", keys, phrases.menu, phrases.blender)


def describe_start(mesh: PolyMesh) -> Words:
    """The mesh that a construction starts from, in words."""
    n_vertices, _, n_faces = mesh.counts
    is_quad = (n_vertices, n_faces) == (4, 1)
    done = "The construction starts from a quad." if is_quad else f"The start has {_count(n_faces, 'face')}."
    keys = (
        "`Shift` `A`: Mesh, then Plane",
        "`Numpad 7` looks from above, `Tab` goes to edit mode",
        f"{VERTICES} vertex select, `G`: move the corners to where they are drawn",
    )
    if not is_quad:
        keys = (*keys[:2], f"`E` extrudes and `F` fills until there are {_count(n_vertices, 'vertex')} as drawn")
    return Words("Start", done, keys, "Add › Mesh › Plane", "mesh.primitive_plane_add")


def _moves(n: int) -> str:
    if not n:
        return "All vertices stay."
    return f"Then {_count(n, 'vertex')} {'moves' if n == 1 else 'move'} to fit the target."


def _count(n: int, noun: str) -> str:
    plural = {"vertex": "vertices"}.get(noun, f"{noun}s")
    return f"{n} {noun if n == 1 else plural}"


def _face_deleted(step: Step) -> str:
    n_lost = len(step.removed["vertices"])
    others = f", and with it {_count(n_lost, 'vertex')} of no other face" if n_lost else ""
    return f"{_what(step)} is deleted{others}."


def _hole_cut(step: Step) -> str:
    a, b = _bridge_ends(step)
    return (
        f"A hole with {step.element['sides']} corners is cut into face {step.element['face']}, bridged to {a} and {b}."
    )


def _hole_keys(step: Step) -> tuple[str, ...]:
    a, b = _bridge_ends(step)
    return (
        f"{FACES} face select, click face {step.element['face']}",
        f"`K` knife: from {a} to the hole, once around it, and on to {b}; `Enter`",
        "Click the face inside the hole, `X` › Faces",
    )


def _bridge_ends(step: Step) -> tuple[str, str]:
    (a, _), (b, _) = step.choice["bridges"] if step.choice else ((0, 0), (0, 0))
    return f"vertex {a}", f"vertex {b}"


def _other_end(step: Step) -> int:
    return int(step.choice["to"]) if step.choice else 0


def _what(step: Step) -> str:
    return element_words(step).capitalize()


_PHRASES = {
    "edge_subdivide": _Phrases(
        "Subdivide an edge",
        lambda step: f"{_what(step)} gets vertex {step.created['vertices'][0]} in its middle.",
        lambda step: (
            f"{EDGES} edge select, click {element_words(step)}",
            "Right-click › Subdivide; Number of Cuts stays 1",
        ),
        "Edge › Subdivide",
        "mesh.subdivide",
    ),
    "edge_extrude": _Phrases(
        "Extrude an edge",
        lambda step: f"{_what(step)} is pulled out to a new quad, face {step.created['faces'][0]}.",
        lambda step: (f"{EDGES} edge select, click {element_words(step)}", "`E`: pull the new edge out, click"),
        "Edge › Extrude Edges",
        "mesh.extrude_edges_move",
    ),
    "face_split": _Phrases(
        "Split a face",
        lambda step: (
            f"Face {step.element['face']} is cut in two between vertex {step.element['vertex']} "
            f"and vertex {_other_end(step)}; the other part is face {step.created['faces'][0]}."
        ),
        lambda step: (
            f"{VERTICES} vertex select, click vertex {step.element['vertex']}, `Shift` click vertex {_other_end(step)}",
            "`J` joins them",
        ),
        "Vertex › Connect Vertex Path",
        "mesh.vert_connect_path",
    ),
    "face_delete": _Phrases(
        "Delete a face",
        _face_deleted,
        lambda step: (f"{FACES} face select, click {element_words(step)}", "`X` › Faces"),
        "Mesh › Delete › Faces",
        "mesh.delete",
    ),
    "face_hole": _Phrases("Cut a hole", _hole_cut, _hole_keys, "Mesh › Knife Tool", "mesh.knife_tool"),
    "vertex_dissolve": _Phrases(
        "Dissolve a vertex",
        lambda step: f"{_what(step)} is dissolved: its two edges become one.",
        lambda step: (
            f"{VERTICES} vertex select, click {element_words(step)}",
            "`Ctrl` `X`, or `X` › Dissolve Vertices",
        ),
        "Mesh › Delete › Dissolve Vertices",
        "mesh.dissolve_verts",
    ),
    "edge_dissolve": _Phrases(
        "Dissolve an edge",
        lambda step: f"{_what(step)} is dissolved: the faces beside it become one.",
        lambda step: (
            f"{EDGES} edge select, click {element_words(step)}",
            "`X` › Dissolve Edges; in the panel (`F9`) untick Dissolve Vertices",
        ),
        "Mesh › Delete › Dissolve Edges",
        "mesh.dissolve_edges",
    ),
}
