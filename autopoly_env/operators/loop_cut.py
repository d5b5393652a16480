"""`loop_cut`: an edge loop through a strip of quads, as Blender's Loop Cut and Slide."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import Face, PolyMesh, mirrored
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.choices import SLIDE
from autopoly_env.operators.deeds import NO_EDGE, Loop
from autopoly_env.operators.elements import EDGE
from autopoly_env.operators.evidence import Blame, Evidence, sane_move
from autopoly_env.operators.mirroring import again, moved
from autopoly_env.operators.operator import Mirroring, Operator
from autopoly_env.operators.rebuilding import grown, refusal
from autopoly_env.operators.strips import Rung, Strip, strip_through
from autopoly_env.operators.wording import Gesture, Phrases, Told, count, element_words

MIDDLE = 0.5
_LEAST_SLIDE = 0.1  # of a rung, between a loop that starts at what is missing and the rail


def edges_of_strips(mesh: PolyMesh) -> BoolArray:
    """(E,) the edges through which an edge loop can run."""
    return np.array([isinstance(strip_through(mesh, e), Strip) for e in range(mesh.topology.n_edges)], np.bool_)


def middle(_mesh: PolyMesh, _edge: int) -> float:
    """The loop runs through the middle of every rung."""
    return MIDDLE


def cut(mesh: PolyMesh, edge: int, choice: Choice | None) -> PolyMesh:
    """A new vertex on every rung of the strip through the edge, at `choice` (0 to 1) from the left rail to the right.

    On the left is the edge's lower vertex. Every quad is cut in two, of which the part with its first corner keeps its
    id and place; a face that is no quad, at an end of the strip, gets a corner more.
    """
    strip = strip_through(mesh, edge)
    if isinstance(strip, str):
        raise refusal("loop_cut", "edge", edge, strip)
    if not isinstance(choice, int | float | np.floating) or not 0.0 < choice < 1.0:
        raise refusal("loop_cut", "edge", edge, f"{choice!r} is no slide; give a number between 0 and 1")
    n, slide = len(mesh.vertex_ids), float(choice)
    left, right = mesh.vertices[[a for a, _ in strip.rungs]], mesh.vertices[[b for _, b in strip.rungs]]
    new = {rung: n + i for i, rung in enumerate(strip.rungs)}
    new |= {(b, a): v for (a, b), v in new.items()}
    faces = [_with_corners(face, new) for face in mesh.faces]
    parts = []
    for quad in strip.quads:
        faces[quad], part = _halves(faces[quad], n)
        parts.append(part)
    return grown(mesh, left + slide * (right - left), (*faces, *parts), len(parts))


def _with_corners(face: Face, new: dict[Rung, int]) -> Face:
    """The face with the new vertices on its edges."""
    corners: list[int] = []
    for v, w in zip(face, (*face[1:], face[0]), strict=True):
        corners += [v, new[v, w]] if (v, w) in new else [v]
    return tuple(corners)


def _halves(face: Face, n: int) -> tuple[Face, Face]:
    """A face cut between its two vertices from index n on: the part with its first corner, and the other."""
    i, j = (k for k, v in enumerate(face) if v >= n)
    return (*face[: i + 1], *face[j:]), face[i : j + 1]


# --- where it starts


def _ends(mesh: PolyMesh, strip: Strip) -> list[int]:
    """The rungs, by number, that lie on the boundary: there the loop shows."""
    if strip.is_closed:
        return []
    ends = {0, len(strip.rungs) - 1}
    return [i for i in sorted(ends) if mesh.topology.is_boundary_edge[mesh.edge_index(*strip.rungs[i])]]


def _shows(mesh: PolyMesh, edge: int) -> bool:
    strip = strip_through(mesh, edge)
    return isinstance(strip, Strip) and bool(_ends(mesh, strip))


def _begin(evidence: Evidence, edge: int) -> Iterator[Start]:
    """Through what is missing or too much at an end of the strip, where the loop's end is put."""
    mesh = evidence.mesh
    plain = Start(MIDDLE, loop_cut.apply(mesh, edge, MIDDLE))
    strip = strip_through(mesh, edge)
    assert isinstance(strip, Strip)
    for end in _ends(mesh, strip):
        blame = _larger_blame(evidence, mesh.edge_index(*strip.rungs[end]))
        if blame is None:
            continue
        far = np.array((blame.far_x, blame.far_y))
        a, b = mesh.vertices[list(strip.rungs[end])]
        slide = float(np.clip((far - a) @ (b - a) / ((b - a) @ (b - a) or 1.0), _LEAST_SLIDE, 1.0 - _LEAST_SLIDE))
        made = loop_cut.apply(mesh, edge, slide)
        goal = made.vertices[-len(strip.rungs) :].copy()
        goal[end] = far
        for start in sane_move(evidence, made, goal):
            yield Start(slide, start)
    yield plain


def _larger_blame(evidence: Evidence, edge: int) -> Blame | None:
    """What is missing or too much beside an edge, whichever is more; None for nothing."""
    sides = [blame for blame in (evidence.missing(edge), evidence.excess(edge)) if blame is not None and blame.mass]
    return max(sides, key=lambda blame: blame.mass, default=None)


def _promise(evidence: Evidence, edge: int) -> float:
    strip = strip_through(evidence.mesh, edge)
    if isinstance(strip, str):
        return 0.0
    blames = [_larger_blame(evidence, evidence.mesh.edge_index(*strip.rungs[i])) for i in _ends(evidence.mesh, strip)]
    return sum(blame.mass for blame in blames if blame is not None)


# --- its mirror image


def _mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    """Two loops; one, where it crosses the axis or runs along it."""
    mesh, first = of.mesh, start.mesh
    strip = strip_through(mesh, of.action.element)
    assert isinstance(strip, Strip)
    ends, n = _ends(mesh, strip), len(mesh.vertices)
    images = {end: tuple(of.images[list(strip.rungs[end])].tolist()) for end in ends}
    numbers = {frozenset(rung): i for i, rung in enumerate(strip.rungs)}
    if frozenset(images[ends[0]]) not in numbers:
        yield from _twice(of, start, strip, images)
        return
    at = {n + end: numbers[frozenset(images[end])] for end in ends if frozenset(images[end]) in numbers}
    here = n + ends[0]
    there = n + at[here]
    if here == there:  # the loop runs along the axis
        yield Start(start.choice, moved(first, {v: np.array((of.axis, first.vertices[v, 1])) for v in at}))
    else:
        yield Start(start.choice, moved(first, {there: mirrored(first.vertices[here], of.axis)}))


def _twice(of: Mirroring, start: Start, strip: Strip, images: dict[int, tuple[int, ...]]) -> Iterator[Start]:
    """The opposite strip cut, too, at the same slide."""
    first, n = start.mesh, len(of.mesh.vertices)
    end = next(iter(images))
    a, b = images[end]
    edge = first.topology.edge_at(a, b)
    opposite = "gone" if edge < 0 else strip_through(first, edge)
    if isinstance(opposite, str) or not isinstance(start.choice, float):
        return  # the first loop runs through the opposite strip
    try:
        second, halfway = again(loop_cut, first, edge, start.choice if a < b else 1.0 - start.choice)
    except IllegalActionError:
        return
    numbers = {frozenset(rung): len(first.vertices) + i for i, rung in enumerate(opposite.rungs)}
    places = {
        numbers[frozenset(image)]: mirrored(first.vertices[n + end], of.axis)
        for end, image in images.items()
        if frozenset(image) in numbers
    }
    yield Start(start.choice, moved(second, places), halfway)


# --- how it is told


def _done(step: Told) -> str:
    faces = step.created["faces"]
    return (
        f"An edge loop is cut through {count(len(faces), 'quad')}, across {element_words(step)}, "
        f"and adds {count(len(step.created['vertices']), 'vertex')}."
    )


def _blender(mesh: PolyMesh, edge: int, choice: Choice | None) -> list[Any]:
    """The rungs (left, right), the slide, and of each quad its id and its first corner, which keep together."""
    strip = strip_through(mesh, edge)
    assert isinstance(strip, Strip) and isinstance(choice, float)
    ids = mesh.vertex_ids
    rungs = tuple((ids[a], ids[b]) for a, b in strip.rungs)
    return [rungs, choice, tuple((mesh.face_ids[quad], ids[mesh.faces[quad][0]]) for quad in strip.quads)]


def _growth(mesh: PolyMesh, edge: int) -> tuple[int, int, int]:
    strip = strip_through(mesh, edge)
    return (0, 0, 0) if isinstance(strip, str) else strip.growth


loop_cut = Operator(
    "loop_cut",
    EDGE,
    "an edge loop through a strip of quads",
    ((2, 3, 1),),
    edges_of_strips,
    cut,
    choose=middle,
    choice=SLIDE,
    varies=_growth,
    shows=_shows,
    begin=_begin,
    promise=_promise,
    mirror=_mirror,
    phrases=Phrases(
        "Cut an edge loop",
        _done,
        lambda step: (NO_EDGE, Loop(tuple(step.element["edge"]))),
        "Edge › Loop Cut and Slide",
        "mesh.loopcut_slide",
        lambda _: Gesture("KKPBBPBB"),
        "New corners let the shape bend between the ends of the strip.",
    ),
    blender=_blender,
)
