"""`State` and `Simulator`: the modelling game itself, without any word of reinforcement learning.

A step is S' = S . t . g (paper, section 3.4): a topological action t, then g, the translation of every vertex that a
refit to the target finds. States are immutable values; a simulator draws no random numbers.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np
import shapely

from autopoly_env.arguments import number, whole
from autopoly_env.arrays import BoolArray, FloatArray, read_only
from autopoly_env.compute import Job, Routine, map_threads, run, run_all
from autopoly_env.details import Details, hairlines
from autopoly_env.errors import ConfigError, IllegalActionError, MeshError
from autopoly_env.guidance import MOST_CORNERS, Guidance, ImportanceSource, importance_settings, weighted
from autopoly_env.mesh import FaceRule, PolyMesh, Topology, broken_faces, check_faces, defects_of, face_rule
from autopoly_env.mesh.symmetry import mirrored
from autopoly_env.operators import STOP, Action, Choice, Halfway, Operator, Start, describe, legal_actions, preset
from autopoly_env.placement import Disagreement, Trial, tried
from autopoly_env.refit import (
    FROM_AFAR,
    LOCAL,
    THOROUGH,
    Judge,
    RefitConfig,
    RefitResult,
    RefitTarget,
    holding,
    mended,
    refit,
    refit_best,
    tune,
)
from autopoly_env.score import Score, ScoreWeights, iou_of, score, score_of
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.lesson import share_moved
from autopoly_env.silhouette import SMALL, Silhouette
from autopoly_env.silhouette.target_kernels import row_ends

POLISH_RESOLUTION = 512  # of the finest refit; a score may be finer
MANY_VERTICES = 150  # of a mesh, above which it is not searched or tuned vertex by vertex: that takes minutes
_N_REFINED = 3  # refits at it, each towards more than the IoU of the one before
_HAIRLINE_COST = 5.0  # points of r_all off in choosing, for each: as a crossing's
_LOSS_COST = 50.0  # the same for a part or a hole that is to be kept and is not, times w_sc where that is above 1
_BACKGROUND_STEPS = 16  # between weights 0 and 1, so that few targets are prepared
_QUAD = Topology(4, ((0, 1, 2, 3),))


@dataclass(frozen=True)
class State:
    """A shape on the way, and how it came from the one before."""

    mesh: PolyMesh
    score: Score  # its total less what `w_locality` charges the step that made it (`Simulator.docked`)
    step: int = 0
    done: str = ""  # why it is over: "stop", "matched", "max_steps"; empty while it goes on
    action: Action | None = None  # what made it, None for an initial state
    choice: Choice | None = None  # what was left free by the action
    n_refits: int = 1  # refits that the step took
    halfway: Halfway | None = None  # before the mirror image of the action, where that came with it

    def _repr_svg_(self) -> str:
        """The mesh as a drawing, for notebooks."""
        return self.mesh._repr_svg_()


class Simulator:
    """One target, and the rules under which meshes are built towards it.

    Parameters: `silhouette`, the target; `operators`, presets or names ("paper", "full,my.module:my_operator",
    "edge_subdivide,..."), or a list of names and Operators; the `resolution` R at which states are refitted and scored,
    in pixels; `weights` of the score; the game ends at `max_steps` and where the IoU reaches `match_threshold`.
    `faces` is the rule of faces that every mesh keeps: "any", "convex", or "quads", convex ones of 3 and 4 corners.

    A user may guide the construction (docs/guidance.md): `importance`, an image that says where matching matters;
    `start`, the mesh to begin with, or a sequence to go on from; `locked`, ids of its vertices that are neither moved
    nor removed; `symmetry` about a vertical axis, x in 0..1, or True for the axis that suits the silhouette best, or
    "auto" for that where the silhouette is symmetric to within 1 % of its area; `keep`, "holes", "parts" or "all":
    those of the picture that are to be in the mesh whatever they cost; `align`: what is nearly upright, level, parallel
    or of equal length is made exactly so in the end, where the IoU loses no more than 0.001.

    Raises ConfigError for settings that are out of range or contradict each other.
    """

    def __init__(
        self,
        silhouette: Silhouette,
        *,
        operators: str | Iterable[str | Operator] = "full",
        resolution: int = 128,
        weights: ScoreWeights | None = None,
        max_steps: int = 100,
        match_threshold: float = 1.0,
        faces: FaceRule = "any",
        importance: ImportanceSource | None = None,
        start: PolyMesh | ConstructionSequence | None = None,
        locked: Collection[int] = (),
        symmetry: bool | float | str | None = None,
        keep: str | None = None,
        align: bool = False,
    ) -> None:
        resolution, max_steps = whole("resolution", resolution), whole("max_steps", max_steps)
        if not 8 <= resolution <= 1024:
            raise ConfigError(f"resolution {resolution}: expected 8 to 1024 pixels a side")
        if not 0.0 < number("match_threshold", match_threshold) <= 1.0:
            raise ConfigError(f"match_threshold {match_threshold}: expected an IoU above 0, at most 1")
        self.faces = face_rule(faces)
        self.silhouette = silhouette if importance is None else weighted(silhouette, importance)
        self.guidance = Guidance.of(self.silhouette, start, locked, symmetry, keep, align)
        self._check_start()
        self.operators = tuple(operator.name for operator in preset(operators))
        self.resolution = resolution
        self.weights = weights or ScoreWeights()
        self.max_steps = max_steps
        self.match_threshold = match_threshold
        own = self.silhouette.resolution
        self._target = self.silhouette.target(resolution)
        self._scored = self.silhouette.target(own) if self.silhouette.is_scored_by_area else self._target
        self._judge = Judge(self._scored)
        self.finest = min(own, POLISH_RESOLUTION)  # pixels a side at which meshes are finished
        self._refined_at = own * -(-SMALL // own) if self.silhouette.is_scored_by_area else self.finest  # whole blocks
        self.n_refits = 0  # that its transitions and initial states have taken so far, whoever asked for them
        self._refit_targets: dict[tuple[int, float], RefitTarget] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "operators": preset(self.operators)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the operators known to this process, too."""
        vars(self).update(state, operators=tuple(operator.name for operator in preset(state["operators"])))

    def refit_target(self, iou: float, resolution: int | None = None) -> RefitTarget:
        """What a mesh of that IoU is refitted to, at the simulator's resolution or another one.

        Least squares with a background that weighs as much as the IoU makes the IoU larger wherever it can be larger
        (Dinkelbach 1967): a pixel more is worth it where its chance of being filled is above IoU / (1 + IoU).
        """
        size = resolution or self.resolution
        background = round(iou * _BACKGROUND_STEPS) / _BACKGROUND_STEPS
        known = self._refit_targets
        if (size, background) not in known:
            if (size, 1.0) not in known:
                known[size, 1.0] = RefitTarget.of(self.silhouette, size)
            if background != 1.0:
                known[size, background] = known[size, 1.0].with_background(background)
        return known[size, background]

    def settings(self) -> dict[str, Any]:
        """The rules as plain values, as a construction sequence keeps them."""
        return {
            "target": self.silhouette.name,
            "operators": ",".join(self.operators),
            "resolution": self.resolution,
            "max_steps": self.max_steps,
            "match_threshold": self.match_threshold,
            **asdict(self.weights),
            **({} if self.faces == "any" else {"faces": self.faces}),
            **({"scored_by": "area"} if self.silhouette.is_scored_by_area else {}),
            **importance_settings(self.silhouette),
            **self.guidance.settings(),
        }

    def initial(self, mesh: PolyMesh | None = None) -> State:
        """The state before the first action: `mesh` or the start mesh as it is, or the better of two refitted boxes.

        These are the upright and the smallest bounding box of the target; under symmetry there is one, upright and
        centred on the axis. Raises ConfigError for a mesh that is not symmetric where it has to be, or against the rule
        of faces.
        """
        return run(self.initial_routine(mesh))

    def initial_routine(self, mesh: PolyMesh | None = None) -> Routine[State]:
        """`initial` as a routine, whose jobs are the refits."""
        mesh = self.guidance.start if mesh is None else mesh
        if mesh is not None:
            n_corners = sum(map(len, mesh.faces))
            if n_corners > MOST_CORNERS:
                raise ConfigError(f"the start mesh has {n_corners} corners: expected at most {MOST_CORNERS}")
            self.guidance.check_symmetric(mesh)
            self._check_faces(mesh, "the mesh")
            return self._ended(State(mesh, self.score(mesh), n_refits=0))
        fits = yield [self._refit_job([box], FROM_AFAR, 1.0) for box in self._bounding_boxes()]
        self.n_refits += len(fits)
        states = (State(fit.mesh, self._score_of(fit), n_refits=len(fits)) for fit in fits)
        return self._ended(max(states, key=lambda state: state.score.total))

    def _bounding_boxes(self) -> Iterator[PolyMesh]:
        target, size = self._target, self.resolution
        filled = target.mask if target.mask.any() else target.coverage > 0.0
        if target.weights is not None and (filled & (target.weights > 0.0)).any():  # of what matters at all
            filled = filled & (target.weights > 0.0)
        rows, first, last = row_ends(read_only(filled)).T
        x0, x1, y0, y1 = first.min() / size, (last.max() + 1) / size, rows[0] / size, (rows[-1] + 1) / size
        axis = self.guidance.axis
        if axis is not None:
            half = min(max(0.5 * (x1 - x0), x0 - axis, axis - x1), axis, 1.0 - axis)
            x0, x1 = axis - half, axis + half
        yield _quad(np.array(((x0, y0), (x1, y0), (x1, y1), (x0, y1))))
        if axis is not None:
            return
        ends = np.column_stack((first, rows, last, rows)).reshape(-1, 2) + 0.5  # of rows, with the hull of all pixels
        around = shapely.linestrings(ends / size).minimum_rotated_rectangle
        if isinstance(around, shapely.Polygon):
            corners = np.clip(shapely.get_coordinates(around.normalize())[:4], 0.0, 1.0)
            (ax, ay), (bx, by), (cx, cy), _ = corners.tolist()
            yield _quad(corners if (bx - ax) * (cy - by) > (by - ay) * (cx - bx) else corners[::-1])

    def defects_of(self, mesh: PolyMesh) -> tuple[int, int]:
        """(crossings and hairlines, faces that are flipped, empty or against the simulator's rule) of a mesh."""
        return defects_of(mesh, self.faces)

    def is_sane(self, mesh: PolyMesh) -> bool:
        """Whether no edges cross or nearly meet, and no face is flipped, empty or against the simulator's rule."""
        return self.defects_of(mesh) == (0, 0)

    def _check_start(self) -> None:
        """Raise ConfigError if the start, or a mesh of the sequence to go on from, breaks the rule of faces."""
        if self.faces == "any":
            return
        earlier = self.guidance.earlier
        for k, mesh in enumerate([] if earlier is None else earlier.replayed()):
            self._check_faces(mesh, f"mesh {k} of the sequence to go on from")
        if self.guidance.start is not None:
            self._check_faces(self.guidance.start, "the start mesh")

    def _check_faces(self, mesh: PolyMesh, what: str) -> None:
        try:
            check_faces(mesh, self.faces, what)
        except MeshError as error:
            raise ConfigError(str(error)) from None

    def score(self, mesh: PolyMesh, before: PolyMesh | None = None) -> Score:
        """What a mesh is worth at the simulator's resolution; as the result of a step from `before`, if that is given.

        Small pictures are scored on exact areas at any resolution.
        Then `docked` is taken off the total, by which agents choose.
        """
        return self._docked(score(mesh, self._scored, self.weights), before, mesh)

    def _docked(self, worth: Score, before: PolyMesh | None, after: PolyMesh) -> Score:
        off = 0.0 if before is None else self.docked(before, after)
        return replace(worth, total=worth.total - off) if off else worth

    def docked(self, before: PolyMesh, after: PolyMesh) -> float:
        """What the weight `w_locality` costs a step, in points of r_all: for moving vertices that were there before."""
        weight = self.weights.w_locality
        return weight * share_moved(before, after) if weight else 0.0

    def final_score(self, mesh: PolyMesh) -> Score:
        """What a mesh is worth at the silhouette's own resolution: the paper's r_all, whatever led to it."""
        return score(mesh, self.silhouette.target(self.silhouette.resolution), self.weights)

    def hairlines(self, mesh: PolyMesh) -> int:
        """How many corridors and slits a mesh has that are too narrow to be seen and not in the picture."""
        return hairlines(mesh, self.silhouette.target(self.finest))

    def is_sound(self, mesh: PolyMesh) -> bool:
        """Whether the mesh is sane, keeps the rule of faces and has no hairlines in view of the picture."""
        return self.is_sane(mesh) and not self.hairlines(mesh)

    def off(self, mesh: PolyMesh, n_hairlines: int | None = None) -> float:
        """Points of r_all that count against a mesh in choosing, though not in its score.

        They are five for every hairline, as for a crossing, and fifty or more for every hole and part of the picture
        that is to be kept (`keep`) and is not there. `n_hairlines` are those of the mesh, where they are known already.
        """
        n_thin = self.hairlines(mesh) if n_hairlines is None else n_hairlines
        return _HAIRLINE_COST * n_thin + _LOSS_COST * max(1.0, self.weights.w_sc) * self._n_lost(mesh)

    def _n_lost(self, mesh: PolyMesh) -> int:
        if not self.guidance.keep:
            return 0
        details = Details.of(self.silhouette)
        n_parts, n_holes = details.kept(mesh)
        lost = {"parts": len(details.parts) - n_parts, "holes": len(details.holes) - n_holes}
        return sum(lost[kind] for kind in self.guidance.keep)

    def standing(self, state: State) -> float:
        """What states are chosen by: their total, less what is `off` their mesh."""
        return state.score.total - self.off(state.mesh)

    def worth(self, mesh: PolyMesh) -> float:
        """What finished meshes are chosen by: r_all at the silhouette's own resolution, less what is `off`."""
        return self.final_score(mesh).total - self.off(mesh)

    def legal_actions(self, state: State) -> list[Action]:
        """What may be done next; STOP first, and nothing once it is over.

        A few of these turn out to have no room once they are tried: `transition` refuses them, `transition_all` leaves
        them out.
        """
        if state.done:
            return []
        actions = [a for a in legal_actions(state.mesh, self.operators) if self.guidance.allows(state.mesh, a)]
        if self.guidance.axis is not None or self.faces != "any":  # only trying tells whether there is room for it
            disagreement = Disagreement(state.mesh, self.silhouette)
            actions = [trial.action for trial in self._possible(disagreement, actions)]
        return [STOP, *actions]

    def transition(self, state: State, action: Action) -> State:
        """The state after one action and its refit.

        It has no crossing, and no flipped or empty face, that the state before has not. Raises IllegalActionError where
        the action is not legal, and where even the refit leaves no room for it.
        """
        return run(self.transition_routine(state, action))

    def transition_routine(self, state: State, action: Action) -> Routine[State]:
        """`transition` as a routine, whose jobs are the refits."""
        if state.done:
            raise IllegalActionError(f"the construction has ended ({state.done}): start from an earlier state")
        if action == STOP:
            return replace(state, done="stop", action=STOP, choice=None, n_refits=0, halfway=None)
        self._check_operator(action)
        disagreement = Disagreement(state.mesh, self.silhouette)
        trial = self.trial_of(disagreement, action)
        after = yield from self._refitted(state, trial)
        self.n_refits += after.n_refits
        if not _is_as_sane(after, disagreement):
            what = describe(state.mesh, action)
            raise IllegalActionError(f"{what} has no room: edges would cross, or a face be flipped or empty")
        return after

    def idle(self, state: State) -> State:
        """The state one step later, nothing done: what a player that asks for an illegal action gets."""
        return self._ended(replace(state, step=state.step + 1, action=None, choice=None, n_refits=0, halfway=None))

    def transition_all(self, state: State, actions: Sequence[Action] | None = None) -> list[State]:
        """`transition` of all (or the given) actions but STOP, on all cores, in their order.

        Actions that turn out to have no room, such as a hole that fits nowhere, are left out, though their refits
        count. Raises IllegalActionError for operators that are not the simulator's.
        """
        if state.done:
            return []
        chosen = legal_actions(state.mesh, self.operators) if actions is None else actions
        for action in chosen:
            if action != STOP:
                self._check_operator(action)
        disagreement = Disagreement(state.mesh, self.silhouette)
        trials = self._possible(disagreement, [action for action in chosen if action != STOP])
        made = map_threads(lambda trial: run(self._refitted(state, trial)), trials)
        self.n_refits += sum(after.n_refits for after in made)
        return [after for after in made if _is_as_sane(after, disagreement)]

    def legal_many(self, states: Sequence[State]) -> list[list[Action]]:
        """`legal_actions` of each of the states."""
        return [self.legal_actions(state) for state in states]

    def step_many(self, states: Sequence[State], actions: Sequence[Action]) -> list[State | None]:
        """`transition` of each state with its action, all at once on all cores; None where it would be refused.

        That is where the state is over, the action is illegal, or it proves to have no room; the refits of the last
        count all the same. Raises ConfigError unless there are as many actions as states.
        """
        if len(states) != len(actions):
            raise ConfigError(f"{len(states)} states and {len(actions)} actions: expected as many of both")
        return run_all(self._unless_refused(*pair) for pair in zip(states, actions, strict=True))

    def _unless_refused(self, state: State, action: Action) -> Routine[State | None]:
        try:
            return (yield from self.transition_routine(state, action))
        except IllegalActionError:
            return None

    def _check_operator(self, action: Action) -> None:
        if action.operator not in self.operators:
            raise IllegalActionError(f"{action.operator!r} is not one of this simulator's operators: {self.operators}")

    def trial_of(self, disagreement: Disagreement, action: Action) -> Trial:
        """An action on the mesh of `disagreement`, not refitted yet. Raises IllegalActionError where it is illegal."""
        trial = tried(disagreement, action, self.guidance.axis)
        self.guidance.check_locks(disagreement.mesh, action, trial.starts[0].mesh)
        return trial if self.faces == "any" else self._ruled(disagreement, trial)

    def _ruled(self, disagreement: Disagreement, trial: Trial) -> Trial:
        """The trial with the starts that keep the rule of faces, or else those that can be mended.

        Raises IllegalActionError where there are none.
        """
        kept = [start for start in trial.starts if self._keeps_rule(start)]
        if not kept and trial.shows:
            mended = [self._mended(start, disagreement.defects) for start in trial.starts]
            kept = [start for start in mended if start is not None]
        if not kept:
            what = describe(disagreement.mesh, trial.action)
            raise IllegalActionError(f"{what} leaves a face that faces={self.faces} does not allow; choose another")
        return replace(trial, starts=kept)

    def _keeps_rule(self, start: Start) -> bool:
        meshes = [start.mesh] if start.halfway is None else [start.halfway.mesh, start.mesh]
        return not any(broken_faces(mesh, self.faces) for mesh in meshes)

    def _mended(self, start: Start, defects: tuple[int, int]) -> Start | None:
        """The start with its vertices moved as the rule of faces wants them; None where that is not to be had."""
        mesh = mended(start.mesh, self.faces, self.guidance.bonds(start.mesh))
        if mesh is None or any(now > then for now, then in zip(defects_of(mesh), defects, strict=True)):
            return None
        moved = start._replace(mesh=mesh)
        return moved if self._keeps_rule(moved) else None

    def _possible(self, disagreement: Disagreement, actions: Sequence[Action]) -> Iterator[Trial]:
        """The actions that are legal after all."""
        for action in actions:
            try:
                yield self.trial_of(disagreement, action)
            except IllegalActionError:
                continue

    def _refitted(self, state: State, trial: Trial) -> Routine[State]:
        """The refit with the fewest crossings and flipped faces, and of those the best, from the trial's starts."""
        if not trial.shows:
            (choice, mesh, halfway), n_refits = trial.starts[0], 0
            score = self.score(mesh, state.mesh)
        else:
            n_refits = len(trial.starts)
            alike = _of_one_topology(trial.starts)
            fits = yield [self._refit_job([start.mesh for start in some], THOROUGH, state.score.iou) for some in alike]
            k = min(range(len(fits)), key=lambda k: (sum(self.defects_of(fits[k].mesh)), fits[k].loss))
            choice, begun, halfway = alike[k][fits[k].which]
            mesh, score = fits[k].mesh, self._score_of(fits[k], state.mesh)
            if self.docked(state.mesh, mesh) > 0.0:
                held = yield from self._held(state, begun)
                mesh = max((mesh, *held), key=lambda m: (-sum(self.defects_of(m)), self.score(m, state.mesh).total))
                score = self.score(mesh, state.mesh)
                n_refits += len(held)
        after = State(mesh, score, state.step + 1, "", trial.action, choice, n_refits, halfway)
        return self._ended(after)

    def _held(self, state: State, begun: PolyMesh) -> Routine[list[PolyMesh]]:
        """Refits in which old vertices stay: all of them, and all but the ends of edges that the action changed."""
        old = np.isin(begun.vertex_ids, state.mesh.vertex_ids)
        jobs = [self._refit_job([begun], THOROUGH, state.score.iou, old)]
        near = np.isin(begun.vertex_ids, list(_ends_changed(state.mesh, begun)))
        if (old & near).any():
            jobs.append(self._refit_job([begun], THOROUGH, state.score.iou, old & ~near))
        fits = yield jobs
        return [fit.mesh for fit in fits]

    def _refit_job(
        self, starts: Sequence[PolyMesh], config: RefitConfig, iou: float, held: BoolArray | None = None
    ) -> Job:
        """The best refit from starts of one topology, of all vertices, or of those that are not `held` (V,)."""
        bonds = self.guidance.bonds(starts[0])
        bonds = bonds if held is None else holding(bonds, held)
        return partial(refit_best, starts, self.refit_target(iou), config, bonds, self.faces, self._judge)

    def _score_of(self, fit: RefitResult, before: PolyMesh | None = None) -> Score:
        """`score` of a refitted mesh, whose IoU is known by then."""
        return self._docked(score_of(fit.mesh, iou_of(fit.overlap, self._scored), self.weights), before, fit.mesh)

    def _ended(self, state: State) -> State:
        """The state with its end marked, if this is one."""
        if state.score.iou >= self.match_threshold:
            return replace(state, done="matched")
        if state.step >= self.max_steps:
            return replace(state, done="max_steps")
        return state

    def refine(self, mesh: PolyMesh) -> PolyMesh:
        """The mesh refitted at the silhouette's own resolution (at most `POLISH_RESOLUTION`), as long as that helps."""
        bonds = self.guidance.bonds(mesh)
        best, worth = mesh, self.worth(mesh)
        for _ in range(_N_REFINED):
            target = self.refit_target(self.final_score(best).iou, self._refined_at)
            fitted = refit(best, target, LOCAL, bonds, self.faces).mesh
            fitted_worth = self.worth(fitted)
            if not fitted_worth > worth:
                break
            best, worth = fitted, fitted_worth
        return best

    def polish(self, mesh: PolyMesh) -> PolyMesh:
        """The mesh refined, then tuned at the same resolution, unless it has many vertices: no worse than it was.

        What has come to lie beyond the border of the picture, where nothing is compared, is put back on it.
        """
        refined = self.refine(mesh)
        if len(mesh.vertices) > MANY_VERTICES:
            return self._within(refined)
        tuned = tune(refined, self.silhouette.target(self.finest), self.guidance.bonds(mesh), self.faces)
        return self._within(max((refined, tuned), key=self.worth))

    def _within(self, mesh: PolyMesh) -> PolyMesh:
        """The mesh with vertices outside of the unit square moved to its border, one after the other, at no loss.

        Along an edge nothing changes that can be seen.
        """
        outside = np.flatnonzero(((mesh.vertices < 0.0) | (mesh.vertices > 1.0)).any(axis=1)).tolist()
        bonds = self.guidance.bonds(mesh) if outside else None
        for vertex in (k for k in outside if bonds is None or not bonds.locked[k]):
            for place in _places_on_border(mesh, vertex):
                points = mesh.vertices.copy()
                points[vertex] = place
                if bonds is not None and bonds.images[vertex] >= 0:
                    points[bonds.images[vertex]] = mirrored(place, bonds.axis)
                moved = mesh.with_vertices(points)
                is_fit = self.is_sane(moved) and self.guidance.is_symmetric(moved)
                if is_fit and self.worth(moved) >= self.worth(mesh):
                    mesh = moved
                    break
        return mesh


def _of_one_topology(starts: Sequence[Start]) -> list[list[Start]]:
    """The starts in groups of neighbours that share a topology."""
    return [list(some) for _, some in groupby(starts, key=lambda start: id(start.mesh.topology))]


def _quad(corners: FloatArray) -> PolyMesh:
    """A mesh of one quad, which is known to be sound; `corners` (4, 2)."""
    return PolyMesh.numbered(corners, _QUAD)


def _places_on_border(mesh: PolyMesh, vertex: int) -> Iterator[FloatArray]:
    """Where the edges of a vertex outside of the unit square cross its border, and the nearest place on it."""
    beyond = mesh.vertices[vertex]
    inside = np.clip(beyond, 0.0, 1.0)
    for pair in mesh.edges[(mesh.edges == vertex).any(axis=1)].tolist():
        end = mesh.vertices[pair[pair[0] == vertex]]
        way = beyond - end
        if (np.clip(end, 0.0, 1.0) == end).all():
            share = np.divide(inside - end, way, out=np.ones(2), where=way != 0.0).min()
            yield np.clip(end + share * way, 0.0, 1.0)
    yield inside


def _is_as_sane(after: State, before: Disagreement) -> bool:
    """Whether a transition has brought no crossing, and no flipped or empty face."""
    return all(now <= then for now, then in zip(defects_of(after.mesh), before.defects, strict=True))


def _ends_changed(before: PolyMesh, after: PolyMesh) -> set[int]:
    """Ids of the ends of the edges that only one of the meshes has."""
    pairs = [{frozenset(pair) for pair in np.array(mesh.vertex_ids)[mesh.edges].tolist()} for mesh in (before, after)]
    return set().union(*(pairs[0] ^ pairs[1]))
