"""The rule of faces: what faces a mesh may have, and which of them break it.

"any" allows every face. "convex" allows no reflex and no straight corner. "quads" allows convex faces of three and four
corners. A corner counts as convex if the sine of its turn is at least `LEAST_TURN`, so that coordinates that are
rounded keep it.
"""

from typing import Literal, get_args

import numpy as np

from autopoly_env.errors import ConfigError, MeshError
from autopoly_env.mesh import corner_kernels
from autopoly_env.mesh.corner_kernels import LEAST_TURN
from autopoly_env.mesh.polymesh import PolyMesh
from autopoly_env.mesh.topology import Topology

FaceRule = Literal["any", "convex", "quads"]
FACE_RULES: tuple[FaceRule, ...] = get_args(FaceRule)
ASKED_TURN = 0.01  # what a refit and what is placed go for, so that they keep clear of it
MOST_CORNERS = 4  # of a face, under "quads"


def face_rule(name: str) -> FaceRule:
    """The rule of this name. Raises ConfigError if there is none."""
    for rule in FACE_RULES:
        if rule == name:
            return rule
    raise ConfigError(f"faces {name!r}: expected one of {', '.join(FACE_RULES)}")


def broken_faces(mesh: PolyMesh, rule: FaceRule, least: float = LEAST_TURN) -> list[int]:
    """The indices of the faces that break the rule, ascending; `least` is the sine that every corner has to turn by."""
    if rule == "any":
        return []
    topology = mesh.topology
    sines = corner_kernels.turns(mesh.vertices, topology.corners, topology.face_offsets)
    broken = ~(np.minimum.reduceat(sines, topology.face_offsets[:-1]) >= least)
    if rule == "quads":
        broken |= np.diff(topology.face_offsets) > MOST_CORNERS
    found: list[int] = np.flatnonzero(broken).tolist()
    return found


def fits_rule(topology: Topology, rule: FaceRule) -> bool:
    """Whether the faces have no more corners than the rule allows, wherever their vertices are."""
    return rule != "quads" or all(len(face) <= MOST_CORNERS for face in topology.faces)


def check_faces(mesh: PolyMesh, rule: FaceRule, what: str) -> None:
    """Raise MeshError naming the first face of `what` that breaks the rule, and how."""
    for f in broken_faces(mesh, rule):
        face, name = mesh.faces[f], mesh.face_ids[f]
        if rule == "quads" and len(face) > MOST_CORNERS:
            raise MeshError(
                f"face {name} of {what} has {len(face)} corners; faces=quads allows 3 and 4: split it, or allow more"
            )
        first, last = mesh.topology.face_offsets[f : f + 2]
        sines = corner_kernels.turns(mesh.vertices, mesh.topology.corners, mesh.topology.face_offsets)[first:last]
        flattest = int(np.argmin(sines))
        kind = "reflex" if sines[flattest] < 0.0 else "straight"
        raise MeshError(
            f"face {name} of {what} has a {kind} corner at vertex {mesh.vertex_ids[face[flattest]]}; "
            f"faces={rule} allows convex ones: move it out, split the face, or allow any"
        )
