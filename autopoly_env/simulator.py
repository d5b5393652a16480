"""`State` and `Simulator`: the modelling game itself, without any word of reinforcement learning.

A step is S' = S . t . g (paper, section 3.4): a topological action t, then g, the translation of every vertex that a
refit to the target finds. States are immutable values; a simulator draws no random numbers.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import shapely

from autopoly_env.arguments import number, whole
from autopoly_env.arrays import BoolArray
from autopoly_env.compute import Job, Routine, map_threads, run
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.guidance import MOST_CORNERS, Guidance, ImportanceSource, importance_settings, weighted
from autopoly_env.mesh import PolyMesh, defects_of
from autopoly_env.operators import STOP, Action, Choice, Halfway, Operator, describe, legal_actions, preset
from autopoly_env.placement import Disagreement, Trial, tried
from autopoly_env.refit import FROM_AFAR, LOCAL, THOROUGH, RefitConfig, RefitTarget, holding, refit, tune
from autopoly_env.score import Score, ScoreWeights, score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.lesson import share_moved
from autopoly_env.silhouette import Silhouette

POLISH_RESOLUTION = 512  # of the finest refit; a score may be finer
_N_REFINED = 3  # refits at it, each towards more than the IoU of the one before
_BACKGROUND_STEPS = 16  # between weights 0 and 1, so that few targets are prepared


@dataclass(frozen=True)
class State:
    """A shape on the way, and how it came from the one before."""

    mesh: PolyMesh
    score: Score  # what the step that made it is docked under `w_locality` is off its total
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

    A user may guide the construction (docs/guidance.md): `importance`, an image that says where matching matters;
    `start`, the mesh to begin with, or a sequence to go on from; `locked`, ids of its vertices that are neither moved
    nor removed; `symmetry` about a vertical axis, x in 0..1, or True for the axis that suits the silhouette best.

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
        importance: ImportanceSource | None = None,
        start: PolyMesh | ConstructionSequence | None = None,
        locked: Collection[int] = (),
        symmetry: bool | float | None = None,
    ) -> None:
        resolution, max_steps = whole("resolution", resolution), whole("max_steps", max_steps)
        if not 8 <= resolution <= 1024:
            raise ConfigError(f"resolution {resolution}: expected 8 to 1024 pixels a side")
        if not 0.0 < number("match_threshold", match_threshold) <= 1.0:
            raise ConfigError(f"match_threshold {match_threshold}: expected an IoU above 0, at most 1")
        self.silhouette = silhouette if importance is None else weighted(silhouette, importance)
        self.guidance = Guidance.of(self.silhouette, start, locked, symmetry)
        self.operators = tuple(operator.name for operator in preset(operators))
        self.resolution = resolution
        self.weights = weights or ScoreWeights()
        self.max_steps = max_steps
        self.match_threshold = match_threshold
        self._target = self.silhouette.target(resolution)
        self.finest = min(self.silhouette.resolution, POLISH_RESOLUTION)  # pixels a side at which meshes are finished
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
        if (size, background) not in self._refit_targets:
            self._refit_targets[size, background] = RefitTarget.of(self.silhouette, size, background)
        return self._refit_targets[size, background]

    def settings(self) -> dict[str, Any]:
        """The rules as plain values, as a construction sequence keeps them."""
        return {
            "target": self.silhouette.name,
            "operators": ",".join(self.operators),
            "resolution": self.resolution,
            "max_steps": self.max_steps,
            "match_threshold": self.match_threshold,
            **asdict(self.weights),
            **importance_settings(self.silhouette),
            **self.guidance.settings(),
        }

    def initial(self, mesh: PolyMesh | None = None) -> State:
        """The state before the first action: `mesh` or the start mesh as it is, or the better of two refitted boxes.

        These are the upright and the smallest bounding box of the target; under symmetry there is one, upright and
        centred on the axis. Raises ConfigError for a mesh that is not symmetric where it has to be.
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
            return self._ended(State(mesh, self.score(mesh), n_refits=0))
        fits = yield [self._refit_job(box, FROM_AFAR, 1.0) for box in self._bounding_boxes()]
        self.n_refits += len(fits)
        best = max((fit.mesh for fit in fits), key=lambda fit: self.score(fit).total)
        return self._ended(State(best, self.score(best), n_refits=len(fits)))

    def _bounding_boxes(self) -> Iterator[PolyMesh]:
        target = self._target
        rows, columns = np.nonzero(target.mask if target.mask.any() else target.coverage > 0.0)
        if target.weights is not None and target.weights[rows, columns].any():  # of what matters at all
            matters = target.weights[rows, columns] > 0.0
            rows, columns = rows[matters], columns[matters]
        x0, x1 = columns.min() / self.resolution, (columns.max() + 1) / self.resolution
        y0, y1 = rows.min() / self.resolution, (rows.max() + 1) / self.resolution
        axis = self.guidance.axis
        if axis is not None:
            half = min(max(0.5 * (x1 - x0), x0 - axis, axis - x1), axis, 1.0 - axis)
            yield PolyMesh.rectangle(axis - half, y0, axis + half, y1)
            return
        yield PolyMesh.rectangle(x0, y0, x1, y1)
        at_row_end = (np.diff(rows, prepend=-1) != 0) | (np.diff(rows, append=-1) != 0)  # these have the same hull
        centres = np.column_stack((columns, rows))[at_row_end] + 0.5
        around = shapely.MultiPoint(centres / self.resolution).minimum_rotated_rectangle
        if isinstance(around, shapely.Polygon):
            corners = np.clip(shapely.get_coordinates(around.normalize())[:4], 0.0, 1.0)
            if not shapely.LinearRing(corners).is_ccw:
                corners = corners[::-1]
            yield PolyMesh.from_faces(corners, [(0, 1, 2, 3)])

    def score(self, mesh: PolyMesh, before: PolyMesh | None = None) -> Score:
        """What a mesh is worth at the simulator's resolution; as the result of a step from `before`, if that is given.

        Then `docked` is taken off the total, by which agents choose.
        """
        worth = score(mesh, self._target, self.weights)
        off = 0.0 if before is None else self.docked(before, mesh)
        return replace(worth, total=worth.total - off) if off else worth

    def docked(self, before: PolyMesh, after: PolyMesh) -> float:
        """What the weight `w_locality` costs a step, in points of r_all: for moving vertices that were there before."""
        weight = self.weights.w_locality
        return weight * share_moved(before, after) if weight else 0.0

    def final_score(self, mesh: PolyMesh) -> Score:
        """What a mesh is worth at the silhouette's own resolution: the paper's r_all, whatever led to it."""
        return score(mesh, self.silhouette.target(self.silhouette.resolution), self.weights)

    def legal_actions(self, state: State) -> list[Action]:
        """What may be done next; STOP first, and nothing once it is over.

        A few of these turn out to have no room once they are tried: `transition` refuses them, `transition_all` leaves
        them out.
        """
        if state.done:
            return []
        actions = [a for a in legal_actions(state.mesh, self.operators) if self.guidance.allows(state.mesh, a)]
        if self.guidance.axis is not None:  # only trying tells whether there is room for a mirror image
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
        trial = self._tried(disagreement, action)
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

    def _check_operator(self, action: Action) -> None:
        if action.operator not in self.operators:
            raise IllegalActionError(f"{action.operator!r} is not one of this simulator's operators: {self.operators}")

    def _tried(self, disagreement: Disagreement, action: Action) -> Trial:
        """The action, not refitted yet. Raises IllegalActionError where it is not legal."""
        trial = tried(disagreement, action, self.guidance.axis)
        self.guidance.check_locks(disagreement.mesh, action, trial.starts[0].mesh)
        return trial

    def _possible(self, disagreement: Disagreement, actions: Sequence[Action]) -> Iterator[Trial]:
        """The actions that are legal after all."""
        for action in actions:
            try:
                yield self._tried(disagreement, action)
            except IllegalActionError:
                continue

    def _refitted(self, state: State, trial: Trial) -> Routine[State]:
        """The refit with the fewest crossings and flipped faces, and of those the best, from the trial's starts."""
        if not trial.shows:
            choice, mesh, halfway = trial.starts[0]
            n_refits = 0
        else:
            fits = yield [self._refit_job(start.mesh, THOROUGH, state.score.iou) for start in trial.starts]
            k = min(range(len(fits)), key=lambda k: (sum(defects_of(fits[k].mesh)), fits[k].loss))
            (choice, begun, halfway), mesh, n_refits = trial.starts[k], fits[k].mesh, len(fits)
            if self.docked(state.mesh, mesh) > 0.0:
                held = yield from self._held(state, begun)
                mesh = max((mesh, *held), key=lambda m: (-sum(defects_of(m)), self.score(m, state.mesh).total))
                n_refits += len(held)
        score = self.score(mesh, state.mesh)
        after = State(mesh, score, state.step + 1, "", trial.action, choice, n_refits, halfway)
        return self._ended(after)

    def _held(self, state: State, begun: PolyMesh) -> Routine[list[PolyMesh]]:
        """Refits in which old vertices stay: all of them, and all but the ends of edges that the action changed."""
        old = np.isin(begun.vertex_ids, state.mesh.vertex_ids)
        jobs = [self._refit_job(begun, THOROUGH, state.score.iou, old)]
        near = np.isin(begun.vertex_ids, list(_ends_changed(state.mesh, begun)))
        if (old & near).any():
            jobs.append(self._refit_job(begun, THOROUGH, state.score.iou, old & ~near))
        fits = yield jobs
        return [fit.mesh for fit in fits]

    def _refit_job(self, mesh: PolyMesh, config: RefitConfig, iou: float, held: BoolArray | None = None) -> Job:
        """A refit of all vertices, or of those that are not `held` (V,)."""
        bonds = self.guidance.bonds(mesh)
        return partial(refit, mesh, self.refit_target(iou), config, bonds if held is None else holding(bonds, held))

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
        best, score = mesh, self.final_score(mesh)
        for _ in range(_N_REFINED):
            fitted = refit(best, self.refit_target(score.iou, self.finest), LOCAL, bonds).mesh
            fitted_score = self.final_score(fitted)
            if not fitted_score.total > score.total:
                break
            best, score = fitted, fitted_score
        return best

    def polish(self, mesh: PolyMesh) -> PolyMesh:
        """The mesh refined, then tuned at the same resolution: no worse than it was."""
        refined = self.refine(mesh)
        tuned = tune(refined, self.silhouette.target(self.finest), self.guidance.bonds(mesh))
        return max((refined, tuned), key=lambda candidate: self.final_score(candidate).total)


def _is_as_sane(after: State, before: Disagreement) -> bool:
    """Whether a transition has brought no crossing, and no flipped or empty face."""
    return all(now <= then for now, then in zip(defects_of(after.mesh), before.defects, strict=True))


def _ends_changed(before: PolyMesh, after: PolyMesh) -> set[int]:
    """Ids of the ends of the edges that only one of the meshes has."""
    pairs = [{frozenset(pair) for pair in np.array(mesh.vertex_ids)[mesh.edges].tolist()} for mesh in (before, after)]
    return set().union(*(pairs[0] ^ pairs[1]))
