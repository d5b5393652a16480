"""What the writers of whole sequences share: the meshes, a name, and where an operator alone leaves the vertices."""

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.errors import SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence, Step
from autopoly_env.sequence.ids import decoded

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
    operator, element, choice = decoded(before, step)
    made = operator.apply(before, element, choice)
    places = dict(zip(before.vertex_ids, before.vertices.tolist(), strict=True))
    places |= zip(step.created["vertices"], operator.sources_of(before, element, choice, made).tolist(), strict=True)
    return np.array([places[name] for name in after.vertex_ids])
