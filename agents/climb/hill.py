"""The landscape that an outline climbs in: what each outline is worth, and how it is refitted before it is judged."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

from agents.trace.outline import Outline
from agents.trace.reach import Reach
from agents.trace.rings import trace_rings
from autopoly_env.compute import map_threads
from autopoly_env.mesh import PolyMesh
from autopoly_env.refit import Judge, RefitConfig, refit
from autopoly_env.score import Score, iou_of, score_of
from autopoly_env.simulator import Simulator

LEAST_GAIN = 1e-9  # of r_all, below which a place is no better than another


class Place:
    """An outline, and what it is worth; `total` is r_all less what is off it in choosing."""

    def __init__(self, outline: Outline, loops: PolyMesh, score: Score, off: float) -> None:
        """`loops` are the rings' places, of an outline that is moved there when it is asked for: most never are."""
        self.score = replace(score, total=score.total - off) if off else score
        self.total = self.score.total
        self._outline, self._loops = outline, loops

    @cached_property
    def outline(self) -> Outline:
        """The rings."""
        return self._outline if self._outline.loops is self._loops else self._outline.moved(self._loops)

    def mesh(self) -> PolyMesh:
        """The rings as faces."""
        return self._loops


class Hill:
    """The landscape of one target: r_all at the silhouette's own resolution (`Simulator.finest` at most)."""

    def __init__(self, simulator: Simulator) -> None:
        self.simulator = simulator
        self.contours = trace_rings(simulator.silhouette)
        self.reach = Reach.of(simulator)
        self._pixels = simulator.silhouette.target(simulator.finest)
        self._judge = Judge(self._pixels, self._pixels)

    def place(self, outline: Outline) -> Place:
        """The outline as it is; its total is less what is off it in choosing."""
        score = outline.score(self._pixels, self.simulator.weights)
        return Place(outline, outline.loops, score, self.simulator.off(outline.loops))

    def fit(self, outlines: Sequence[Outline], config: RefitConfig, iou: float) -> list[Place]:
        """Each outline refitted, on all cores, on the way to more than `iou`."""
        target = self.simulator.refit_target(iou)

        def fitted(outline: Outline) -> Place:
            fit = refit(outline.loops, target, config, judge=self._judge)
            iou = iou_of(fit.overlap, self._pixels)
            score = score_of(fit.mesh, iou, self.simulator.weights, outline.complexity)
            return Place(outline, fit.mesh, score, self.simulator.off(fit.mesh, fit.n_hairlines))

        return map_threads(fitted, outlines)

    def refined(self, place: Place) -> Place:
        """The outline refitted at the silhouette's own resolution."""
        return self.place(place.outline.moved(self.simulator.refine(place.outline.loops)))

    def polished(self, place: Place) -> Place:
        """The outline refitted and tuned, as a finished mesh is."""
        return self.place(place.outline.moved(self.simulator.polish(place.outline.loops)))


def total_of(place: Place) -> float:
    """r_all of a place, to sort by."""
    return place.total
