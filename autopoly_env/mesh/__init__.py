"""Polygon meshes: what they are, what follows from their faces, what may be wrong with them, how they are drawn."""

from autopoly_env.mesh.corner_kernels import LEAST_TURN
from autopoly_env.mesh.face_rule import (
    ASKED_TURN,
    FACE_RULES,
    FaceRule,
    broken_faces,
    check_faces,
    face_rule,
    fits_rule,
)
from autopoly_env.mesh.polymesh import Defects, PolyMesh, canonical_hash, is_valid, validate
from autopoly_env.mesh.sanity import defects_of, is_sane
from autopoly_env.mesh.symmetry import images_of, mirrored
from autopoly_env.mesh.topology import Face, Topology

__all__ = [
    "ASKED_TURN",
    "FACE_RULES",
    "LEAST_TURN",
    "Defects",
    "Face",
    "FaceRule",
    "PolyMesh",
    "Topology",
    "broken_faces",
    "canonical_hash",
    "check_faces",
    "defects_of",
    "face_rule",
    "fits_rule",
    "images_of",
    "is_sane",
    "is_valid",
    "mirrored",
    "validate",
]
