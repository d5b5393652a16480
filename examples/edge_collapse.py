"""An operator of one's own: an edge is collapsed to its middle, as Blender's Merge at Center does with two vertices.

    python -m agents.solve examples/mug.png --agent greedy --operators full,examples.edge_collapse:edge_collapse

This file is all that it takes; docs/operators.md tells more.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from autopoly_env.arrays import BoolArray
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh, Topology, is_valid
from autopoly_env.operators import EDGE, Choice, Operator, Start
from autopoly_env.operators.mirroring import again
from autopoly_env.operators.operator import Mirroring
from autopoly_env.operators.wording import EDGES, Gesture, Phrases, begun_with, element_words


def collapsed(mesh: PolyMesh, edge: int) -> PolyMesh | None:
    """The mesh with the edge's lower vertex in its middle, and without the other; None where that is no mesh."""
    a, b = mesh.edges[edge].tolist()
    index = [v - (v > b) for v in range(len(mesh.vertex_ids))]
    index[b] = index[a]
    rings = [tuple(dict.fromkeys(index[v] for v in face)) for face in mesh.faces]
    kept = [f for f, ring in enumerate(rings) if len(ring) > 2]  # triangles on the edge are gone
    vertices = mesh.vertices.copy()
    vertices[a] = 0.5 * (vertices[a] + vertices[b])
    made = PolyMesh(
        np.delete(vertices, b, axis=0),
        Topology(len(vertices) - 1, tuple(rings[f] for f in kept)),
        (*mesh.vertex_ids[:b], *mesh.vertex_ids[b + 1 :]),
        tuple(mesh.face_ids[f] for f in kept),
        mesh.next_vertex_id,
        mesh.next_face_id,
    )
    if not kept or not is_valid(made):
        return None
    holes_and_parts = [(m.topology.n_holes, m.topology.n_components) for m in (mesh, made)]
    return made if holes_and_parts[0] == holes_and_parts[1] else None


def collapsible_edges(mesh: PolyMesh) -> BoolArray:
    """(E,) the edges whose collapse leaves a valid mesh with as many parts and holes."""
    return np.array([collapsed(mesh, edge) is not None for edge in range(mesh.topology.n_edges)], np.bool_)


def collapse(mesh: PolyMesh, edge: int, _choice: Choice | None) -> PolyMesh:
    """See `collapsed`. Raises IllegalActionError."""
    made = collapsed(mesh, edge)
    if made is None:
        raise IllegalActionError(f"edge_collapse cannot work on edge {edge}: no valid mesh is left; choose another")
    return made


def on_boundary(mesh: PolyMesh, edge: int) -> bool:
    """Whether an end of the edge shows."""
    return bool(mesh.topology.is_boundary_vertex[mesh.edges[edge]].any())


def mirror(of: Mirroring, start: Start) -> Iterator[Start]:
    """The opposite edge collapsed, too; an edge that is its own image goes to a point on the axis."""
    ends = of.mesh.edges[of.action.element].tolist()
    images = of.images[ends].tolist()  # -1 for an end inside the mesh, which has none
    if set(images) == set(ends):
        yield start
    elif -1 not in images and not set(images) & set(ends):  # two edges of one corner cannot both be collapsed to theirs
        edge = start.mesh.edge_index(*map(start.mesh.vertex_index, mesh_ids(of.mesh, images)))
        second, halfway = again(edge_collapse, start.mesh, edge)
        yield Start(None, second, halfway)


def mesh_ids(mesh: PolyMesh, vertices: list[int]) -> list[int]:
    """The ids of vertices."""
    return [mesh.vertex_ids[v] for v in vertices]


def blender_arguments(mesh: PolyMesh, edge: int, _choice: Choice | None) -> list[Any]:
    """What the function below is called with."""
    return mesh_ids(mesh, mesh.edges[edge].tolist())


BLENDER = '''
def edge_collapse(a: int, b: int) -> None:
    """The edge a-b collapsed to its middle, where vertex a stays."""
    middle = (vertex(a).co + vertex(b).co) / 2
    bmesh.ops.pointmerge(bm, verts=[vertex(a), vertex(b)], merge_co=middle)
'''

edge_collapse = Operator(
    "edge_collapse",
    EDGE,
    "an edge collapsed to its middle",
    ((-1, -1, 0),),
    collapsible_edges,
    collapse,
    shows=on_boundary,
    mirror=mirror,
    phrases=Phrases(
        "Collapse an edge",
        lambda step: f"{begun_with(step)} is collapsed to its middle; vertex {step.removed['vertices'][0]} is gone.",
        lambda step: (f"{EDGES} edge select, click {element_words(step)}", "`M` › At Center"),
        "Mesh › Merge › At Center",
        "mesh.merge",
        lambda _: Gesture("KPBB"),
    ),
    blender=blender_arguments,
    blender_code=BLENDER,
)
