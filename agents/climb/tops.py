"""The best places of a landscape that were come by, and the construction of the best of them."""

from agents.climb.hill import Hill, Place, total_of
from agents.trace.agent import build_best
from agents.trace.outline import outline_of_mesh
from autopoly_env.compute import map_threads
from autopoly_env.mesh import PolyMesh
from autopoly_env.simulator import State

_N_KEPT = 6  # which of them is the best shows when they are refitted more finely
_N_POLISHED = 2  # of those
_N_BUILT = 3


class Tops:
    """Keeps the best places, of those that are worth the same one."""

    def __init__(self, hill: Hill) -> None:
        self.hill = hill
        self._places: list[Place] = []

    def add(self, place: Place) -> None:
        """Keep a place if it is one of the best."""
        if all(abs(place.total - other.total) > 1e-9 for other in self._places):
            self._places = sorted([*self._places, place], key=total_of, reverse=True)[:_N_KEPT]

    def add_mesh(self, mesh: PolyMesh) -> Place | None:
        """Keep the outline of a mesh as a place; None if the mesh has no outline of its own."""
        outline = outline_of_mesh(mesh)
        if outline is None:
            return None
        place = self.hill.place(outline)
        self.add(place)
        return place

    def places(self) -> list[Place]:
        """The best places, best first."""
        return list(self._places)

    def built(self) -> list[State]:
        """The construction of the best place within reach, as they are when they are polished.

        The outline of a mesh may be out of it: an extrusion is one step, and its outline two subdivisions.
        """
        refined = sorted(map_threads(self.hill.refined, self._places), key=total_of, reverse=True)
        polished = sorted(map_threads(self.hill.polished, refined[:_N_POLISHED]), key=total_of, reverse=True)
        places = [*polished, *refined[_N_POLISHED:]]
        outlines = [place.outline for place in places if self.hill.reach.allows(place.outline)]
        return build_best(self.hill.simulator, outlines, _N_BUILT)
