"""Why a step is done: which part begins, and what its shape is like there."""

import numpy as np

from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import operator_named
from autopoly_env.sequence import Step
from autopoly_env.sequence.parts import Parts

BEND = 0.01  # unit square; a vertex nearer to the line between its neighbours is no bend
ALIKE = 0.1  # of a length, by which another one may differ and still be the same


def reason(number: int, step: Step, before: PolyMesh, after: PolyMesh, parts: Parts) -> str:
    """Why step `number`, from 1, is done, in a sentence or two; "" where nothing is known."""
    told = (_part_words(number, parts), _shape_words(step, before, after) or operator_named(step.operator).told.why)
    return " ".join(words for words in told if words)


def _part_words(number: int, parts: Parts) -> str:
    """That a part begins, ends, or is gone back to."""
    if len(parts.names) < 2:
        return ""
    here = parts.of_steps[number - 1]
    there = parts.of_steps[number - 2] if number > 1 else 0
    if here == there:
        return ""
    name, left = (f"The part {parts.names[part]!r}" if part else "The body" for part in (here, there))
    if here in parts.of_steps[: number - 1] or not here:
        return f"Back to {name[0].lower()}{name[1:]}."
    return f"{name} begins: {left[0].lower()}{left[1:]} ends here."


def _shape_words(step: Step, before: PolyMesh, after: PolyMesh) -> str:
    """Whether the outline bends at a new vertex, or how wide the shape is at a new edge."""
    new = [after.vertex_index(name) for name in step.created["vertices"]]
    edges = {tuple(sorted(edge)) for edge in after.edges.tolist()}
    old = {v: [w for w in range(len(after.vertices)) if w not in new and tuple(sorted((v, w))) in edges] for v in new}
    if len(new) == 1 and not step.created["faces"] and len(old[new[0]]) == 2:
        return _bend_words(after, new[0], *old[new[0]])
    if len(new) == 2 and tuple(sorted(new)) in edges and all(len(beside) == 1 for beside in old.values()):
        (a,), (b,) = old.values()
        return _width_words(_length(after, a, b), _length(after, *new))
    return ""


def _bend_words(mesh: PolyMesh, vertex: int, a: int, b: int) -> str:
    p, q = mesh.vertices[a], mesh.vertices[b]
    along, off = q - p, mesh.vertices[vertex] - p
    side = (along[0] * off[1] - along[1] * off[0]) / max(float(np.hypot(*along)), 1e-12)
    if abs(side) < BEND:
        return "A corner for later: the outline is still straight here."
    names = f"vertices {mesh.vertex_ids[a]} and {mesh.vertex_ids[b]}"
    way = "bulges out" if _is_outside(mesh, vertex, a, b) else "is drawn in"
    return f"Between {names} the outline {way}, by {abs(side):.2f} of the picture."


def _is_outside(mesh: PolyMesh, vertex: int, a: int, b: int) -> bool:
    """Whether the corner of a face at the vertex is convex."""
    for face in mesh.faces:
        if vertex in face:
            k = face.index(vertex)
            before, after = mesh.vertices[face[k - 1]], mesh.vertices[face[(k + 1) % len(face)]]
            one, other = mesh.vertices[vertex] - before, after - mesh.vertices[vertex]
            return bool(one[0] * other[1] - one[1] * other[0] > 0.0)
    return True


def _width_words(old: float, new: float) -> str:
    if abs(new - old) <= ALIKE * max(old, new):
        return f"The shape runs on from this edge, as wide as before ({new:.2f})."
    return (
        f"The shape runs on from this edge and gets {'wider' if new > old else 'narrower'}: {old:.2f}, then {new:.2f}."
    )


def _length(mesh: PolyMesh, a: int, b: int) -> float:
    return float(np.hypot(*(mesh.vertices[a] - mesh.vertices[b])))
