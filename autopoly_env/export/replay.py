"""What the writers of whole sequences share: the meshes, a name, and where an operator alone leaves the vertices."""

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence, Step
from autopoly_env.sequence.file import parse_hole

NAME_LENGTH = 60  # Blender's names end at 63 bytes


def finite_meshes(sequence: ConstructionSequence) -> list[PolyMesh]:
    """The meshes of a sequence. Raises SequenceError naming the step that cannot be replayed or is not finite."""
    meshes = sequence.meshes()
    for number, mesh in enumerate(meshes):
        if not np.isfinite(mesh.vertices).all():
            raise SequenceError(f"step {number}: a vertex is not finite; give finite coordinates")
    return meshes


def sequence_name(sequence: ConstructionSequence) -> str:
    """The name of the target in the settings as one line of printable text, "AutoPoly" if there is none."""
    text = str(sequence.settings.get("target", ""))
    words = "".join(sign if sign.isprintable() else " " for sign in text).split()
    return " ".join(words)[:NAME_LENGTH].rstrip() or "AutoPoly"


def unmoved(step: Step, before: PolyMesh, after: PolyMesh) -> FloatArray:
    """(V, 2) where the vertices of `after` lie once the operator has worked and before any vertex is moved.

    Extruded vertices still lie on their sources, as in Blender and other modelling programs.
    """
    places = dict(zip(before.vertex_ids, before.vertices.tolist(), strict=True))
    new: list[list[float]] = []
    match step.operator:
        case "edge_subdivide" | "edge_extrude":
            a, b = _ends_along_face(step, before)
            middle = [0.5 * (places[a][axis] + places[b][axis]) for axis in (0, 1)]
            new = [middle] if step.operator == "edge_subdivide" else [places[a], places[b]]
        case "face_hole":
            new = [list(point) for point in parse_hole(step.choice or {}).points]
    places |= zip(step.created["vertices"], new, strict=False)
    at_last = zip(after.vertex_ids, after.vertices.tolist(), strict=True)
    return np.array([places.get(name, place) for name, place in at_last])


def _ends_along_face(step: Step, mesh: PolyMesh) -> tuple[int, int]:
    """The ends of the step's edge as its (lower) face runs, which is the order of their copies."""
    ends = step.element["edge"]
    assert isinstance(ends, list)
    half_edge, _ = mesh.topology.edge_half_edges[mesh.edge_index(*(mesh.vertex_index(name) for name in ends))]
    a, b = mesh.topology.half_edges[half_edge].tolist()
    return mesh.vertex_ids[a], mesh.vertex_ids[b]
