"""`AutoPolyEnv`: the Gymnasium environment. It only translates between Gymnasium and the simulator."""

import operator
import os
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, SupportsFloat, cast

import gymnasium
import numpy as np

from autopoly_env.arguments import number, one_of, whole
from autopoly_env.arrays import BoolArray
from autopoly_env.compute import Routine, run
from autopoly_env.errors import ConfigError, EpisodeError, IllegalActionError
from autopoly_env.mesh import FACE_RULES, PolyMesh, validate
from autopoly_env.observation import Observation, Observer
from autopoly_env.operators import Action, ActionCodec, describe, preset
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette, load_silhouette
from autopoly_env.simulator import Simulator, State
from autopoly_env.targets import SPLITS, TargetSource, make_targets
from autopoly_env.viewer import changed, draw_mesh

REWARD_MODES = ("score", "improvement")
RENDER_MODES = ("rgb_array", "ansi")
RESET_OPTIONS = ("target", "mesh", "state")
ENDS = ("", "stop", "matched", "max_steps")  # what `info["end"]` numbers
_ANY_SHAPE = Silhouette(np.ones((8, 8), np.bool_))  # stands for the target while the rules are checked
KEPT = 64  # targets of all environments of a process, some 200 KB each at 64 x 64, for resets with the same seeds
MOST_VERTICES = 10_000  # that arrays are padded to


class _Source:
    """A target source as one environment has it, which is a key of its own."""

    def __init__(self, targets: TargetSource) -> None:
        self.targets = targets


@dataclass(slots=True)
class _Beginning:
    """A target that was drawn, with what it keeps, and the state before the first action once that is known."""

    silhouette: Silhouette
    initial: State | None = None


@lru_cache(maxsize=KEPT)
def _drawn(source: _Source, seed: int) -> _Beginning:
    """The target of a seed; asked again, the same."""
    return _Beginning(source.targets.sample(seed))


@dataclass(frozen=True, slots=True)
class EnvState:
    """All that an episode has come to: what `AutoPolyEnv.clone_state` gives and `restore_state` takes. It pickles."""

    rules: tuple[tuple[str, Any], ...]  # under which it came about; an environment with others refuses it
    silhouette: Silhouette
    state: State
    previous: PolyMesh | None  # the mesh one step earlier; None at the start
    best_r_all: float  # since the start
    action: Action | None  # of the last step, at elements of `previous`; None at the start
    illegal: bool  # whether that was illegal
    no_room: tuple[int, ...] = ()  # actions that the mesh as it is has proved to have no room for


class AutoPolyEnv(gymnasium.Env[Observation, Any]):
    """Build a clean polygon mesh of a silhouette, one modelling action after the other.

    ## Description

    An episode shows a target silhouette and a rectangle fitted to it. Each step applies one topological operator to
    one element of the mesh; then all vertices are moved to fit the target (the refit of the paper's section 3.4, done
    by the environment). A good mesh covers the target with few elements that do not cross.

    ## Observation

    A `Dict` of arrays of fixed size; N is `max_vertices`, R is `obs_resolution`. Elements keep the order in which
    actions number them, and rows without an element are -1.

    | key | shape, dtype | what |
    |---|---|---|
    | `rendering` | (1, R, R) uint8 | share of each pixel that the mesh covers, 0 to 255 |
    | `target` | (1, R, R) uint8 | the same of the target |
    | `vertices` | (2 N,) float32 | x, y of every vertex, unit square, y down |
    | `edges` | (4 N,) int32 | the two vertices of every edge |
    | `faces` | (8 N,) int32 | the face and the vertex of every corner, face by face |
    | `counts` | (4,) int32 | how many vertices, edges, faces, corners there are |
    | `remaining_steps` | (1,) int32 | steps until the episode is cut off |

    ## Action

    `Discrete`: 0 is STOP, then each operator has one index for every element that a mesh of N vertices may have.
    `info["action_mask"]` (int8) and `action_masks()` (bool) say which are legal; an operator that would leave the
    padding is not. An illegal action is a step in which nothing is done (`info["invalid_action"]`). Nothing is done,
    either, where a legal one, rarely, has no room, which is known once it is tried; the mask forbids it from then on.

    ## Reward

    `reward_mode="score"`: the paper's r_all = w_sm IoU - w_sc (V + E + F) - w_si crossings of the mesh after the
    step. `"improvement"`: by how much the step raised r_all. An illegal action costs `illegal_penalty` on top.

    ## Termination

    Terminated by STOP, and where the IoU reaches `match_threshold`; truncated after `max_steps`.

    ## State

    `clone_state()` and `restore_state(state)` are quick and exact; `state` and `simulator` are for planners, which
    need no environment: `env.unwrapped.simulator.transition(env.unwrapped.state, action)`.

    ## Arguments

    - `targets`: "construction", "objects", a folder of images, or a `TargetSource`; `split`: "train" or "test".
    - `operators`: a preset ("paper", "full", "modeller") or names with commas between them.
    - `resolution`: pixels a side at which meshes are fitted and scored; `obs_resolution`: of the observed pictures.
    - `faces`: the rule of faces that every mesh keeps: "any", "convex", "quads" (convex, 3 or 4 corners).
    - `exact_mask`: whether the mask leaves out what the rule of faces has no room for. Every action has to be tried for
      that, which takes nearly all of a step's time; where it is False, such an action does nothing when it is taken.
    - `max_steps`, `max_vertices`, `match_threshold`: see above.
    - `reward_mode`, `illegal_penalty`, `w_sm`, `w_sc`, `w_si`: see above.
    - `info_texts`: whether infos also say in words what was done, why it is over and what the target is called.
    - `render_mode`: None, "rgb_array" or "ansi"; "human" through `gymnasium.make`. `render_size`: pixels.

    `reset(options=...)` takes `target` (an array, a path or a `Silhouette`), `mesh` (a `PolyMesh` to begin with), or
    `state` (what `clone_state` gave). What is not allowed raises an `AutoPolyError` that says what is.

    ## Example

    >>> import gymnasium
    >>> env = gymnasium.make("autopoly_env:AutoPoly-v0", resolution=64)
    >>> observation, info = env.reset(seed=7)
    >>> over = False
    >>> while not over:
    ...     action = env.action_space.sample(info["action_mask"])
    ...     observation, reward, terminated, truncated, info = env.step(action)
    ...     over = terminated or truncated
    >>> bool(info["best_r_all"] >= info["r_all"])
    True
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 2}  # noqa: RUF012 (Gymnasium's own name and type)

    def __init__(
        self,
        *,
        targets: str | os.PathLike[str] | TargetSource | None = "construction",
        split: str = "train",
        operators: str = "paper",
        resolution: int = 128,
        obs_resolution: int = 64,
        max_steps: int = 20,
        max_vertices: int = 32,
        match_threshold: float = 0.99,
        faces: str = "any",
        exact_mask: bool = True,
        reward_mode: str = "score",
        illegal_penalty: float = 1.0,
        w_sm: float = 100.0,
        w_sc: float = 1.0,
        w_si: float = 5.0,
        info_texts: bool = False,
        render_mode: str | None = None,
        render_size: int = 256,
    ) -> None:
        self.metadata = dict(type(self).metadata)  # SyncVectorEnv writes its autoreset mode into it
        self.targets = target_source(targets)
        self._source = _Source(self.targets)
        self._seeds = SPLITS[one_of("split", split, tuple(SPLITS))]
        self._simulator_settings: dict[str, Any] = {
            "operators": preset(operators),
            "resolution": whole("resolution", resolution),
            "weights": ScoreWeights(number("w_sm", w_sm), number("w_sc", w_sc), number("w_si", w_si)),
            "max_steps": whole("max_steps", max_steps, 1, 2**31 - 1),
            "match_threshold": number("match_threshold", match_threshold),
            "faces": one_of("faces", faces, FACE_RULES),
        }
        example = self._simulator_of(_ANY_SHAPE)
        self.codec = ActionCodec(example.operators, whole("max_vertices", max_vertices, 4, MOST_VERTICES))
        self._observer = Observer(max_vertices, whole("obs_resolution", obs_resolution, 2, 1024), max_steps)
        rules = {**example.settings(), "max_vertices": max_vertices}
        self._rules = tuple((name, value) for name, value in rules.items() if name != "target")
        self._improvement = one_of("reward_mode", reward_mode, REWARD_MODES) == "improvement"
        self._illegal_penalty = number("illegal_penalty", illegal_penalty)
        self._exact_mask = one_of("exact_mask", exact_mask, (False, True))
        self._info_texts = one_of("info_texts", info_texts, (False, True))
        self.render_mode = one_of("render_mode", render_mode, (None, *RENDER_MODES))
        self._render_size = whole("render_size", render_size, 16, 4096)
        self.action_space = gymnasium.spaces.Discrete(self.codec.n_actions)
        boxes: dict[str, gymnasium.Space[Any]] = {
            name: gymnasium.spaces.Box(field.low, field.high, field.shape, field.dtype)
            for name, field in self._observer.fields.items()
        }
        self.observation_space = cast(gymnasium.Space[Observation], gymnasium.spaces.Dict(boxes))
        self._episode: EnvState | None = None
        self._simulator = example  # of the episode's target, once there is an episode
        self._picture = self._observer.picture_of(_ANY_SHAPE)
        self._mask: BoolArray | None = None  # of the episode's state, once somebody asks

    # --- what Gymnasium asks for

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode: with a target drawn from `targets`, or as `options` say (see the class)."""
        super().reset(seed=seed)
        return run(self.reset_routine(options))

    def step(self, action: Any) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Apply the action with this index to the mesh.

        Raises IllegalActionError if there is no such index, EpisodeError before a reset and after the episode's end.
        """
        return run(self.step_routine(action))

    def reset_routine(self, options: dict[str, Any] | None = None) -> Routine[tuple[Observation, dict[str, Any]]]:
        """`reset` without a seed as a routine, for those who step many environments at once."""
        options = _checked_options(options)
        if "state" in options:
            self.restore_state(options["state"])
        else:
            yield from self._begin(self._beginning(options), options.get("mesh"))
        return self._observation(), self._info()

    def step_routine(self, action: Any) -> Routine[tuple[Observation, float, bool, bool, dict[str, Any]]]:
        """`step` as a routine."""
        index, before = self._index(action), self.state
        if before.done:
            raise EpisodeError(f"a step after the end of the episode ({before.done}): call reset() first")
        chosen = self.codec.decode(index)
        illegal = not self._legal_mask()[index]
        after = None if illegal else (yield from self._transition(before, chosen))
        no_room = (index,) if after is None and not illegal else ()
        self._advance(after or self._simulator.idle(before), chosen, illegal, no_room)
        done = self.state.done
        return self._observation(), self._reward(before), done in ("stop", "matched"), done == "max_steps", self._info()

    def prepare_reset(self) -> None:
        """Draw and fit now what the next `reset` without a seed or options begins with: it takes less time then."""
        random = self.np_random.bit_generator
        before = random.state
        try:
            beginning = self._beginning({})
        finally:
            random.state = before
        if beginning.initial is None:
            beginning.initial = run(self._simulator_of(beginning.silhouette).initial_routine())

    def render(self) -> Any:
        """The mesh over its target with a caption, (H, W, 3) uint8, or in words; None without a render mode."""
        if self.render_mode is None:
            return None
        episode, score = self._current(), self.state.score
        happened = "nothing (illegal action)" if episode.illegal else _words(episode)
        title = f"step {episode.state.step} of {self._simulator.max_steps}: {happened}"
        facts = f"r_all {score.total:.2f}   r_sm {score.iou:.3f}   r_sc {score.complexity}   r_si "
        facts += f"{score.self_intersections}   best r_all {episode.best_r_all:.2f}"
        if self.render_mode == "ansi":
            return f"{title}\n{facts}\n"
        mesh = episode.state.mesh
        new = changed(episode.previous or mesh, mesh)
        size, text = self._render_size, f"{title}\n{facts}"
        frame = draw_mesh(mesh, episode.silhouette, size=size, highlight=new, caption=text)
        return np.pad(frame, ((0, len(frame) % 2), (0, 0), (0, 0)), mode="edge")  # video codecs want even sizes

    def action_masks(self) -> BoolArray:
        """(n_actions,) which actions are legal now; the name is the one that MaskablePPO looks for."""
        return self._legal_mask().copy()

    def set_price(self, w_sc: float) -> None:
        """Let an element cost `w_sc` points from the next reset on. States of another price are not restored then."""
        weights = replace(self._simulator_settings["weights"], w_sc=number("w_sc", w_sc))
        self._simulator_settings["weights"] = weights
        self._rules = tuple((name, weights.w_sc if name == "w_sc" else value) for name, value in self._rules)
        self._source = _Source(self.targets)  # what it has prepared has a score at the price before

    # --- what planners ask for

    @property
    def state(self) -> State:
        """The simulator's state. Raises EpisodeError before the first reset."""
        return self._current().state

    @property
    def simulator(self) -> Simulator:
        """The rules and the target of this episode. Raises EpisodeError before the first reset."""
        self._current()
        return self._simulator

    def clone_state(self) -> EnvState:
        """The episode as it stands: an immutable value, to be restored here or in another environment."""
        return self._current()

    def restore_state(self, state: EnvState) -> None:
        """Go on from a state that `clone_state` gave. Raises ConfigError if its rules are not this environment's."""
        if not isinstance(state, EnvState):
            raise ConfigError(f"a state of type {type(state).__name__} was given: expected what clone_state() gives")
        if state.rules != self._rules:
            theirs = dict(state.rules)
            name, ours = next(rule for rule in self._rules if theirs.get(rule[0]) != rule[1])
            raise ConfigError(
                f"the state comes from an environment with {name}={theirs.get(name)!r}, this one has {ours!r}: "
                "restore it where the two agree"
            )
        self._observer.check_fits(state.state.mesh)
        if self._episode is None or state.silhouette is not self._episode.silhouette:
            self._simulator = self._simulator_of(state.silhouette)
            self._picture = self._observer.picture_of(state.silhouette)
        self._episode, self._mask = state, None

    # --- how

    def _current(self) -> EnvState:
        if self._episode is None:
            raise EpisodeError("there is no episode yet: call reset() first")
        return self._episode

    def _simulator_of(self, silhouette: Silhouette) -> Simulator:
        return Simulator(silhouette, **self._simulator_settings)

    def _beginning(self, options: dict[str, Any]) -> "_Beginning":
        if "target" not in options:
            if self._source.targets is not self.targets:  # others were put in their place
                self._source = _Source(self.targets)
            return _drawn(self._source, int(self.np_random.integers(self._seeds.start, self._seeds.stop)))
        target = options["target"]
        return _Beginning(target if isinstance(target, Silhouette) else load_silhouette(target))

    def _begin(self, beginning: "_Beginning", mesh: PolyMesh | None) -> Routine[None]:
        silhouette = beginning.silhouette
        if mesh is not None:
            if not isinstance(mesh, PolyMesh):
                raise ConfigError(f"a mesh of type {type(mesh).__name__} was given: expected a PolyMesh")
            validate(mesh)
            self._observer.check_fits(mesh)
        simulator, picture = self._simulator_of(silhouette), self._observer.picture_of(silhouette)
        if mesh is not None:
            initial = yield from simulator.initial_routine(mesh)
        elif beginning.initial is None:
            initial = beginning.initial = yield from simulator.initial_routine()
        else:
            initial = beginning.initial
            simulator.n_refits += initial.n_refits
        state = replace(initial, done="")  # whether it is over is asked after a step
        self._simulator, self._picture = simulator, picture
        self._episode = EnvState(self._rules, silhouette, state, None, state.score.total, None, False)
        self._mask = None

    def _transition(self, state: State, action: Action) -> Routine[State | None]:
        """The state after an action that the mask allows; None if there proves to be no room for it after all."""
        try:
            return (yield from self._simulator.transition_routine(state, action))
        except IllegalActionError:
            return None

    def _advance(self, state: State, action: Action, illegal: bool, no_room: tuple[int, ...]) -> None:
        now = self._current()
        best, known = max(now.best_r_all, state.score.total), (*now.no_room, *no_room) if illegal or no_room else ()
        self._episode = EnvState(self._rules, now.silhouette, state, now.state.mesh, best, action, illegal, known)
        self._mask = None

    def _reward(self, before: State) -> float:
        now = self._current()
        gain = now.state.score.total - (before.score.total if self._improvement else 0.0)
        return gain - self._illegal_penalty if now.illegal else gain

    def _legal_mask(self) -> BoolArray:
        if self._mask is None:
            self._mask = self.codec.legal_mask(self.state.mesh)
            if self._simulator.faces != "any" and self._exact_mask:
                self._mask &= self.codec.mask_of(self._simulator.legal_actions(self.state))
            if self._current().no_room:
                self._mask[list(self._current().no_room)] = False
        return self._mask

    def _observation(self) -> Observation:
        state = self.state
        remaining = max(0, self._simulator.max_steps - state.step)
        return self._observer.observe(state.mesh, self._picture, remaining)

    def _info(self) -> dict[str, Any]:
        """One dtype per key, always, and nothing but numbers unless texts are asked for: libraries make arrays of them.

        A numpy scalar each, but for a 0-d array of bool: Gymnasium and torch take `np.bool_` for no number.
        """
        episode, score = self._current(), self.state.score
        info: dict[str, Any] = {
            "r_sm": np.float64(score.iou),
            "r_sc": np.int64(score.complexity),
            "r_si": np.int64(score.self_intersections),
            "r_all": np.float64(score.total),
            "best_r_all": np.float64(episode.best_r_all),
            "n_refits": np.int64(episode.state.n_refits),
            "invalid_action": np.array(episode.illegal),
            "end": np.int64(ENDS.index(episode.state.done)),
            "action_mask": self._legal_mask().astype(np.int8),
        }
        if self._info_texts:
            info |= {"action": _words(episode), "ended_by": episode.state.done, "target": episode.silhouette.name}
        return info

    def _index(self, action: Any) -> int:
        try:
            index = None if isinstance(action, bool | np.bool_) else operator.index(action)
        except TypeError:
            index = None
        if index is None:
            raise IllegalActionError(f"action {action!r} is no whole number; give one of 0..{self.codec.n_actions - 1}")
        if not 0 <= index < self.codec.n_actions:
            raise IllegalActionError(f"action {index} does not exist; give one of 0..{self.codec.n_actions - 1}")
        return index


def _words(episode: EnvState) -> str:
    """The action of the last step."""
    if episode.action is None or episode.previous is None:
        return "start"
    return describe(episode.previous, episode.action)


def _checked_options(options: dict[str, Any] | None) -> dict[str, Any]:
    options = options or {}
    unknown = [name for name in options if name not in RESET_OPTIONS]
    if unknown:
        raise ConfigError(f"reset option {unknown[0]!r} is unknown; give some of {', '.join(RESET_OPTIONS)}")
    if "state" in options and len(options) > 1:
        raise ConfigError("reset options: a state has a target and a mesh of its own; give it alone")
    return options


def target_source(targets: str | os.PathLike[str] | TargetSource | None) -> TargetSource:
    """The source of this name or folder; a source as it is. Raises ConfigError for anything else."""
    if targets is None or targets == "":
        raise ConfigError("targets are missing; give targets=FOLDER, a folder of images")
    if isinstance(targets, str | os.PathLike):
        return make_targets(targets)
    if not callable(getattr(targets, "sample", None)):
        raise ConfigError(f"targets {targets!r}: expected a name, a folder, or an object with a method sample(seed)")
    return targets
