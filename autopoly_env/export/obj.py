"""Wavefront OBJ: the mesh as other modelling programs read it, n-gons and all."""

from autopoly_env.mesh import PolyMesh


def to_obj(mesh: PolyMesh) -> str:
    """The mesh as OBJ text: in the unit square at z = 0 with y up, floats with all their digits.

    Faces keep their n corners and their first one. They run the other way round than in `mesh`, because turning y up
    mirrors the picture: a face of positive area has positive area there too, and looks towards +z.

    >>> print(to_obj(PolyMesh.rectangle(0.0, 0.0, 1.0, 0.5)), end="")
    # AutoPoly: 4 vertices, 4 edges, 1 face; unit square, y up
    v 0.0 1.0 0
    v 1.0 1.0 0
    v 1.0 0.5 0
    v 0.0 0.5 0
    f 1 4 3 2
    """
    n_vertices, n_edges, n_faces = mesh.counts
    faces = f"{n_faces} face" + ("s" if n_faces != 1 else "")
    lines = [f"# AutoPoly: {n_vertices} vertices, {n_edges} edges, {faces}; unit square, y up"]
    lines += [f"v {x!r} {(1.0 - y)!r} 0" for x, y in mesh.vertices.tolist()]
    for first, *others in mesh.faces:
        lines.append(" ".join(["f", *(str(v + 1) for v in (first, *reversed(others)))]))
    return "\n".join(lines) + "\n"
