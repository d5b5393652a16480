"""`face_inset`: a ring of quads inside a face, as Blender's Inset Faces; its middle may be deleted afterwards."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray, FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators.action import Choice, Start
from autopoly_env.operators.deeds import Press, select
from autopoly_env.operators.elements import FACE
from autopoly_env.operators.evidence import Evidence, sane_move
from autopoly_env.operators.hole_kernels import TINY_AREA
from autopoly_env.operators.operator import Operator
from autopoly_env.operators.rebuilding import grown, refusal
from autopoly_env.operators.wording import Gesture, Phrases, begun_with

SCALE = 0.5  # of the face, to which its middle shrinks
_SCALES = (0.1, 0.9)  # of a middle that is as large as what is too much there
_RIM_PROMISE = 0.1  # as of a hole: of an excess that an edge answers for


def convex_faces(mesh: PolyMesh) -> BoolArray:
    """(F,) the strictly convex faces that are not tiny."""
    return np.array([_is_convex(mesh, f) for f in range(len(mesh.faces))], np.bool_)


def _is_convex(mesh: PolyMesh, face: int) -> bool:
    """Whether the corners turn the same way, once around."""
    ring = mesh.vertices[list(mesh.faces[face])]
    side = np.roll(ring, -1, axis=0) - ring
    after = np.roll(side, -1, axis=0)
    turns = side[:, 0] * after[:, 1] - side[:, 1] * after[:, 0]
    if not (turns > 0.0).all():
        return False
    fans = (ring[1:] - ring[0]).T
    doubled = fans[0, :-1] * fans[1, 1:] - fans[1, :-1] * fans[0, 1:]
    return bool((doubled > 0.0).all() and doubled.sum() > 2.0 * TINY_AREA)


def inset(mesh: PolyMesh, face: int, _choice: Choice | None) -> PolyMesh:
    """A copy of the face inside it, at `SCALE` about the mean of its corners, and a quad at each of its sides.

    The middle keeps the face's id and place; the quads come in the order of its corners, as its new vertices do.
    """
    if not _is_convex(mesh, face):
        raise refusal("face_inset", "face", face, "it is not convex or has no room; choose another")
    corners, new = mesh.faces[face], len(mesh.vertex_ids)
    ring = mesh.vertices[list(corners)]
    n, mean = len(corners), ring.mean(axis=0)
    inner = tuple(range(new, new + n))
    quads = [(corners[i], corners[(i + 1) % n], inner[(i + 1) % n], inner[i]) for i in range(n)]
    faces = (*mesh.faces[:face], inner, *mesh.faces[face + 1 :], *quads)
    return grown(mesh, mean + SCALE * (ring - mean), faces, n)


def _never(_mesh: PolyMesh, _face: int) -> bool:
    return False


def _begin(evidence: Evidence, face: int) -> Iterator[Start]:
    """The middle about the largest excess in the face, and as large; without one, the operator's own."""
    plain = face_inset.apply(evidence.mesh, face)
    region = evidence.excess_in(face)
    if region is not None:
        ring = evidence.mesh.vertices[list(evidence.mesh.faces[face])]
        scale = float(np.clip((-region.area / evidence.mesh.face_areas()[face]) ** 0.5, *_SCALES))
        centre = np.array((region.mean_x, region.mean_y))
        for mesh in sane_move(evidence, plain, centre + scale * (ring - ring.mean(axis=0))):
            yield Start(None, mesh)
    yield Start(None, plain)


def _promise(evidence: Evidence, face: int) -> float:
    region = evidence.excess_in(face)
    area = 0.0 if region is None else -region.area
    return max(area - evidence.most[1], _RIM_PROMISE * area)


def _sources(before: PolyMesh, face: int, _choice: Choice | None, _made: PolyMesh) -> FloatArray:
    sources: FloatArray = before.vertices[list(before.faces[face])]
    return sources


def _blender(mesh: PolyMesh, face: int, _choice: Choice | None) -> list[Any]:
    return [mesh.face_ids[face], tuple(mesh.vertex_ids[v] for v in mesh.faces[face])]


face_inset = Operator(
    "face_inset",
    FACE,
    "a ring of quads inside a face",
    ((3, 6, 3),),
    convex_faces,
    inset,
    varies=lambda mesh, face: (len(mesh.faces[face]), 2 * len(mesh.faces[face]), len(mesh.faces[face])),
    shows=_never,
    begin=_begin,
    promise=_promise,
    sources=_sources,
    phrases=Phrases(
        "Inset a face",
        lambda step: f"{begun_with(step)} gets a ring of {len(step.created['faces'])} quads around its middle.",
        lambda step: (
            select("face", (step.element["face"],)),
            Press(
                ("I",),
                typed="0",
                leaves=select("face", (step.element["face"],)),
                effect="makes a copy of the face, as large as it is",
                on_sources=True,
            ),
            Press(("S",), typed=f"{SCALE:g}", effect="makes the copy smaller, about its middle"),
        ),
        "Face › Inset Faces",
        "mesh.inset",
        lambda _: Gesture("KPBB"),
        "A ring of quads makes room for a smaller face inside.",
    ),
    blender=_blender,
)
