"""Strips of quads, through which an edge loop runs: from an edge to the opposite one, and on, both ways.

Rungs are the edges that the loop crosses; rails are what they stand between.
"""

from dataclasses import dataclass

from autopoly_env.mesh import PolyMesh

Rung = tuple[int, int]


@dataclass(frozen=True)
class Strip:
    """The quads on either side of an edge, and on through opposite edges.

    The order is that of walking with the edge's lower vertex on the left rail (seen with y down); a closed strip begins
    behind its lowest quad.
    """

    rungs: tuple[Rung, ...]  # (left, right) vertex indices; k + 1 of them, k if the strip is closed
    quads: tuple[int, ...]  # (k,) face indices; quad i lies between rungs i and i + 1
    is_closed: bool

    @property
    def growth(self) -> tuple[int, int, int]:
        """How many vertices, edges and faces an edge loop through it adds."""
        n, k = len(self.rungs), len(self.quads)
        return n, n + k, k


def strip_through(mesh: PolyMesh, edge: int) -> Strip | str:
    """The strip of quads through an edge, or why there is none that an edge loop can run through."""
    links = mesh.topology.links
    low, high = mesh.edges[edge].tolist()
    sides = {links.tails[h]: h for h in mesh.topology.edge_half_edges[edge] if h >= 0}
    ahead, closed = _walk(mesh, sides.get(high, -1))
    behind = [] if closed else _walk(mesh, sides.get(low, -1))[0]
    quads = [*(face for face, _ in reversed(behind)), *(face for face, _ in ahead)]
    rungs = [*(rung for _, rung in reversed(behind)), (low, high), *((left, right) for _, (right, left) in ahead)]
    if not quads:
        return "no quad lies beside it; choose an edge of a quad"
    if len(set(quads)) < len(quads):
        return "its strip of quads crosses itself; choose another"
    if closed:
        if len(quads) < 3:
            return "its strip is a ring of two quads; choose another"
        rungs.pop()  # the first once more
        turn = quads.index(min(quads)) + 1
        quads, rungs = [*quads[turn:], *quads[:turn]], [*rungs[turn:], *rungs[:turn]]
    elif _other_face(mesh, rungs[0], quads[0]) & _other_face(mesh, rungs[-1], quads[-1]):
        return "both ends of its strip lie on one face, which the loop would cut, too; choose another"
    return Strip(tuple(rungs), tuple(quads), closed)


def _other_face(mesh: PolyMesh, rung: Rung, quad: int) -> set[int]:
    """The face on the other side of a rung, if there is one."""
    return {f for f in mesh.topology.edge_faces[mesh.edge_index(*rung)].tolist() if f not in (-1, quad)}


def _walk(mesh: PolyMesh, half_edge: int) -> tuple[list[tuple[int, Rung]], bool]:
    """The quads from a half-edge on, each with the rung on its far side; and whether the way leads back.

    The rungs run as the half-edge does. A quad that comes twice ends the walk; -1 is a half-edge without a face.
    """
    links, faces = mesh.topology.links, mesh.faces
    found: list[tuple[int, Rung]] = []
    seen: set[int] = set()
    h = half_edge
    while h >= 0 and len(faces[links.faces[h]]) == 4:
        if h == half_edge and found:
            return found, True
        far = links.following[links.following[h]]
        found.append((links.faces[h], (links.heads[far], links.tails[far])))
        if links.faces[h] in seen:
            break
        seen.add(links.faces[h])
        h = links.twins[far]
    return found, False
