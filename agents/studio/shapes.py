"""Meshes and scores as the page gets them: plain values, places in the unit square, x right, y down."""

from typing import Any

from autopoly_env.mesh import PolyMesh

DIGITS = 5  # of a coordinate


def plain_mesh(mesh: PolyMesh) -> dict[str, Any]:
    """Places by vertex id, corners by face id; `rings` where faces are rings, holes wound backwards."""
    ids = mesh.vertex_ids
    return {
        "vertices": {
            v: [round(x, DIGITS), round(y, DIGITS)] for v, (x, y) in zip(ids, mesh.vertices.tolist(), strict=True)
        },
        "faces": {f: [ids[v] for v in face] for f, face in zip(mesh.face_ids, mesh.faces, strict=True)},
        "counts": mesh.counts,
        "rings": bool(mesh.face_areas().min() < 0.0),
    }
