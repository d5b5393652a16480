"""Polygon meshes: what they are, what follows from their faces, what may be wrong with them, how they are drawn."""

from autopoly_env.mesh.polymesh import PolyMesh, canonical_hash, is_valid, validate
from autopoly_env.mesh.sanity import defects_of, is_sane
from autopoly_env.mesh.symmetry import images_of, mirrored
from autopoly_env.mesh.topology import Face, Topology

__all__ = [
    "Face",
    "PolyMesh",
    "Topology",
    "canonical_hash",
    "defects_of",
    "images_of",
    "is_sane",
    "is_valid",
    "mirrored",
    "validate",
]
