"""In which order a mesh of quads and triangles is modelled, and with which operators.

It begins with the main body: a face that is large, and of whose branches none is much larger. Every further face
hangs on an edge that is there already: a new quad is an extrusion, a new triangle a cap; a face whose corners are all
there closes a ring and is filled in. Branches are followed to their end before the next one begins, and rings are
closed last, so that whoever follows never goes back.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import Face, PolyMesh

BODY = "body"


@dataclass(frozen=True)
class Addition:
    """A face in its turn: what it hangs on, and what is there of it."""

    face: Face  # begins with the edge a, b that it hangs on, as that face runs: the neighbour has b, a
    kind: str  # "extrude", "cap", "fill", "weld": what makes it; "apart": a part of its own; "touch": nothing does
    part: int  # number of the branch that it belongs to, 0 for the body


def order_of(mesh: PolyMesh, rank: int = 0, deep: bool = True) -> Iterator[Addition]:
    """The faces of a mesh in the order in which they are modelled; each part of the mesh after the other.

    It begins with the best body but `rank`. Unless `deep`, all branches grow at once.
    """
    areas = mesh.face_areas()
    waiting = set(range(len(mesh.faces)))
    n_parts = 0
    while waiting:
        starts = _bodies(mesh, areas, waiting)
        start = starts[min(rank, len(starts) - 1)]
        yield Addition(mesh.faces[start], "start" if len(waiting) == len(mesh.faces) else "apart", n_parts)
        for addition in _branch_after_branch(_outwards(mesh, start, areas, waiting, n_parts, deep)):
            n_parts = max(n_parts, addition.part)
            yield addition
        n_parts += 1


def _bodies(mesh: PolyMesh, areas: FloatArray, waiting: set[int]) -> list[int]:
    """The faces of the largest part that waits, the best body first: quads, if there are any."""
    beside: dict[int, set[int]] = {f: set() for f in range(len(mesh.faces))}
    for f, g in mesh.topology.edge_faces.tolist():
        if g >= 0:
            beside[f].add(g)
            beside[g].add(f)
    part = max(_hanging_together(waiting, beside), key=lambda faces: (sum(areas[f] for f in faces), -min(faces)))

    def heaviest_branch(f: int) -> float:
        branches = _hanging_together(part - {f}, beside)
        return float(max((sum(areas[g] for g in faces) for faces in branches), default=0.0))

    quads = [f for f in part if len(mesh.faces[f]) == 4]
    excess = {f: heaviest_branch(f) - areas[f] for f in quads or part}
    return sorted(excess, key=lambda f: (excess[f], f))


def _hanging_together(faces: set[int], beside: dict[int, set[int]]) -> list[set[int]]:
    """The faces in sets, each of which hangs together by edges."""
    left, parts = set(faces), []
    while left:
        part: set[int] = set()
        fresh = {left.pop()}
        while fresh:
            part |= fresh
            fresh = {g for f in fresh for g in beside[f]} & left
            left -= fresh
        parts.append(part)
    return parts


def _branch_after_branch(additions: Iterable[Addition]) -> Iterator[Addition]:
    """The same, sorted by branch where faces follow each other whose corners are new: these need their branch alone."""
    for is_new, run in groupby(additions, key=lambda addition: _RANK[addition.kind] == 0):
        faces = list(run)
        yield from sorted(faces, key=lambda addition: addition.part) if is_new else faces


def _outwards(
    mesh: PolyMesh, start: int, areas: FloatArray, waiting: set[int], first_part: int, deep: bool
) -> Iterator[Addition]:
    """The faces that hang together with `start`, taken out of `waiting`."""
    sides = {pair: f for f, face in enumerate(mesh.faces) for pair in pairwise((*face, face[0]))}
    built_edges: set[tuple[int, int]] = set()  # as the built faces run
    built_vertices: set[int] = set()
    branch_of = {start: first_part}
    age: dict[int, int] = {}
    n_branches = first_part

    def build(f: int) -> None:
        waiting.discard(f)
        age[f] = len(age)
        built_edges.update(pairwise((*mesh.faces[f], mesh.faces[f][0])))
        built_vertices.update(mesh.faces[f])

    build(start)
    while True:
        ways = []
        for (a, b), f in sides.items():
            neighbour = sides.get((b, a))
            if f in waiting and neighbour in age:
                kind = _kind(mesh.faces[f], (a, b), built_edges, built_vertices)
                ways.append(
                    (_RANK[kind], -age[neighbour] if deep else age[neighbour], -areas[f], f, (a, b), kind, neighbour)
                )
        if not ways:
            return
        _, _, _, f, (a, b), kind, neighbour = min(ways)
        branch = branch_of[neighbour]
        if neighbour == start:
            n_branches += 1
            branch = n_branches
        branch_of[f] = branch
        build(f)
        yield Addition(_turned(mesh.faces[f], a, b), kind, branch)


_RANK = {"extrude": 0, "cap": 0, "fill": 1, "weld": 2, "touch": 3}


def _kind(face: Face, base: tuple[int, int], built_edges: set[tuple[int, int]], built_vertices: set[int]) -> str:
    """What makes a face that hangs on the edge `base` of its own.

    A corner that is there already can be welded to where a side beside the base is; else the two would only touch.
    """
    others = [v for v in face if v not in base and v in built_vertices]
    if not others:
        return "extrude" if len(face) == 4 else "cap"
    around = list(pairwise((*face, face[0])))
    there = [(a, b) for a, b in around if (b, a) in built_edges and (a, b) != base]
    if len(face) == 3:
        return "fill" if there else "touch"
    if around[(around.index(base) + 2) % 4] in there:
        return "fill"
    beside = {v for pair in there for v in pair if set(pair) & set(base)}
    return "weld" if beside.issuperset(others) else "touch"


def _turned(face: Face, a: int, b: int) -> Face:
    """The face with its corners from a, b on."""
    k = face.index(a)
    turned = (*face[k:], *face[:k])
    assert turned[1] == b
    return turned
