"""From a labelled construction to what a policy that is cloned reads, and what it is to answer.

Letters: S states of a construction, k the number of one of them, A actions, G actions of the codec, H corners.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from torch.utils.data import Dataset

from agents.rl.config import NetConfig, SpaceSpec
from agents.rl.network import observer_of
from agents.rl.player import allowed, observation_of
from autopoly_env.arguments import above, at_least
from autopoly_env.arrays import BoolArray, Float32Array, IntArray
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import FaceRule
from autopoly_env.observation import PADDING, Observation
from autopoly_env.operators import Action, ActionCodec, operator_named, preset
from training.networks.samples import LabelConfig, Sample
from training.networks.streams import Made, Stored
from training.networks.trainer import OptimConfig, RunConfig
from training.networks.trajectories import Labelled, Trajectory
from training.policies.config import EnvConfig

PICTURES = ("rendering", "target")
HOPELESS = -1e3  # r_all points: gain of an action whose outcome is not known


@dataclass(frozen=True)
class CloneData:
    """Where samples come from, and how they are labelled."""

    shards: str = "runs/expert"  # folders of make_expert, with commas between them
    held_out: str = "runs/held_out"  # the same of held-out targets
    plays: str = ""  # a folder of training.improve's plays: half of the samples; all of them where `shards` is empty
    n_held_out: int = 512  # samples to measure with, rounded up to whole batches of 64
    temperature: float = 0.5  # r_all points: of the softmax over what actions gain
    least_gain: float = 0.05  # r_all points below which a state of a play teaches nothing

    def __post_init__(self) -> None:
        if not (self.shards or self.plays):
            raise ConfigError("shards and plays are empty: expected one of them")
        at_least(0, least_gain=self.least_gain)
        at_least(1, n_held_out=self.n_held_out)
        above(0, temperature=self.temperature)


@dataclass(frozen=True)
class CloneConfig:
    """Everything that can be set."""

    net: NetConfig = field(default_factory=NetConfig)
    env: EnvConfig = field(default_factory=EnvConfig)  # its spaces, and the prices of its tasks
    data: CloneData = field(default_factory=CloneData)
    value_weight: float = 0.5  # of the value's squared error beside the cross entropy
    optim: OptimConfig = field(default_factory=OptimConfig)
    run: RunConfig = field(default_factory=RunConfig)
    n_exam: int = 48  # unseen targets of each task that the result is evaluated on
    init: str = ""  # weights to begin with: a .safetensors file

    def __post_init__(self) -> None:
        if self.n_exam < 1 or not self.value_weight >= 0.0:
            raise ConfigError(
                f"n_exam {self.n_exam}, value_weight {self.value_weight}: expected at least 1 and at least 0"
            )

    def price(self, faces: FaceRule, rng: np.random.Generator) -> float:
        """Of an element, as a task of that rule of faces has it. Raises ConfigError where there is none."""
        tasks = sorted({task.prices: task for task in self.env.courses if task.faces == faces}.items())
        if not tasks:
            raise ConfigError(f"env.courses: none has faces={faces}, which shards are of; add one")
        _, task = tasks[int(rng.integers(len(tasks)))]
        return task.w_sc if isinstance(task.w_sc, float | int) else task.price_at(rng.random())


# --- one sample ---


@dataclass(frozen=True)
class Prepared:
    """A labelled state as the policy sees it, but for the price."""

    seen: "Turning"
    index: IntArray  # (A,) number of each action; -1 where there is no room for it
    state: Labelled
    totals: Float32Array  # (S - k, 3) score of this state and of all later ones of the construction


@dataclass(frozen=True)
class Turning:
    """A state as the policy sees it, but for the price, that can be turned."""

    observation: Observation
    mask: BoolArray  # (G,)
    codec: ActionCodec

    @cached_property
    def mirrored(self) -> IntArray:
        """(G,) where each action goes when every face is wound the other way: corners change places, others stay."""
        order = np.arange(self.codec.n_actions)
        swap = _reversed_corners(self.observation["faces"])
        for name in self.codec.operators:
            if operator_named(name).element.base == "corner":
                start = self.codec.encode(Action(name, 0))
                order[start : start + len(swap)] = start + swap
        return order

    def sample(
        self, way: int, w_sc: float, faces: FaceRule, arrays: dict[str, Float32Array], value: Float32Array
    ) -> Sample:
        """It, mirrored (bit 0: x, bit 1: y) and transposed (bit 2), with `arrays` (G,) and its value (1,)."""
        seen = observation_of(turned_observation(self.observation, way), self.mask, w_sc, faces)
        sample: Sample = {**seen, **arrays, "value": value}
        if way.bit_count() % 2:
            for name in ("action_mask", *arrays):
                moved = np.empty_like(sample[name])
                moved[self.mirrored] = sample[name]
                sample[name] = moved
        return sample


class CloneStream(Dataset[Sample]):
    """Endless samples by number; number i depends on (seed, i) alone."""

    def __init__(
        self, trajectories: Stored, config: CloneConfig, seed: int, turn: bool = True, made: Made | None = None
    ) -> None:
        self._trajectories, self._config, self._seed, self._turn = trajectories, config, seed, turn
        self._spec, self._made = config.env.spec(), made or Made()
        self._prepared: dict[int, list[Prepared]] = {}  # by number of the construction: unpacking takes longer

    def __getitem__(self, i: int) -> Sample:
        rng = np.random.default_rng((self._seed, i))
        states: list[Prepared] = []
        while not states:
            states = self._states(int(rng.integers(len(self._trajectories))))
        one = states[int(rng.integers(len(states)))]
        w_sc = self._config.price(self._made.faces, rng)
        return clone_sample(one, w_sc, int(rng.integers(8)) if self._turn else 0, self._config, self._made.faces)

    def _states(self, number: int) -> list[Prepared]:
        if number not in self._prepared:
            self._prepared[number] = prepared(self._trajectories[number], self._spec, self._made.operators)
        return self._prepared[number]


def prepared(trajectory: Trajectory, spec: SpaceSpec, operators: str = "full") -> list[Prepared]:
    """The states of a construction in which something may be done and that the padding has room for.

    `operators` are those that it was made with.
    """
    observer, codec = observer_of(spec), ActionCodec(spec.operators, spec.max_vertices)
    picture, names = observer.picture_of(trajectory.silhouette), [operator.name for operator in preset(operators)]
    found = []
    for k, state in enumerate(trajectory.states):
        try:
            observer.check_fits(state.mesh)
        except ConfigError:
            continue
        if state.actions and k < spec.max_steps:
            scores = np.stack([later.score for later in trajectory.states[k:]])
            mask = allowed(codec, state.mesh, names)
            seen = Turning(observer.observe(state.mesh, picture, spec.max_steps - k), mask, codec)
            found.append(Prepared(seen, numbers_of(codec, state.actions), state, scores))
    return found


def numbers_of(codec: ActionCodec, actions: Sequence[Action]) -> IntArray:
    """(A,) the codec's number of each action, -1 where it has none."""
    numbers = []
    for action in actions:
        try:
            numbers.append(codec.encode(action))
        except IllegalActionError:
            numbers.append(-1)
    return np.array(numbers, np.int64)


def _reversed_corners(faces: IntArray) -> IntArray:
    """(H,) the number of each corner when each face's corners stand in the other order."""
    owners = faces.reshape(-1, 2)[:, 0]
    owners = owners[owners != PADDING]
    begins = np.flatnonzero(np.diff(owners, prepend=-1))
    sizes = np.diff(np.append(begins, len(owners)))
    first, size = np.repeat(begins, sizes), np.repeat(sizes, sizes)
    return 2 * first + size - 1 - np.arange(len(owners))


def clone_sample(one: Prepared, w_sc: float, way: int, config: CloneConfig, faces: FaceRule = "any") -> Sample:
    """What the policy sees, turned as `Turning.sample` says, and what it is to answer."""
    labels = LabelConfig(temperature=config.data.temperature)
    policy, gains = np.zeros(len(one.seen.mask)), np.full(len(one.seen.mask), HOPELESS)
    probabilities, known = labels.policy(one.state, w_sc), one.index >= 0
    policy[0], gains[0] = probabilities[0], 0.0
    policy[one.index[known]] = probabilities[1:][known]
    gains[one.index[known]] = np.maximum(labels.gains(one.state, w_sc)[known], HOPELESS)
    policy *= one.seen.mask
    totals = one.totals @ np.array((labels.w_sm, -w_sc, -labels.w_si))
    value = config.env.reward_scale * (totals.max() - totals[0])
    arrays = {
        "policy": (policy / max(policy.sum(), 1e-9)).astype(np.float32),
        "gains": gains.astype(np.float32),
    }
    return one.seen.sample(way, w_sc, faces, arrays, np.array((value,), np.float32))


def turned_observation(seen: Observation, way: int) -> Observation:
    """The observation mirrored and transposed as `way` says; where that flips areas, faces are wound the other way."""
    mirror_x, mirror_y, transpose = way & 1, way & 2, way & 4
    made = dict(seen)
    for name in PICTURES:
        picture = seen[name][:, :, ::-1] if mirror_x else seen[name]
        picture = picture[:, ::-1] if mirror_y else picture
        made[name] = np.ascontiguousarray(np.swapaxes(picture, 1, 2) if transpose else picture)
    n = 2 * int(seen["counts"][0])
    points = seen["vertices"][:n].reshape(-1, 2).copy()
    points[:, 0] = 1.0 - points[:, 0] if mirror_x else points[:, 0]
    points[:, 1] = 1.0 - points[:, 1] if mirror_y else points[:, 1]
    made["vertices"] = seen["vertices"].copy()
    made["vertices"][:n] = (points[:, ::-1] if transpose else points).ravel()
    if way.bit_count() % 2:
        corners = seen["faces"].reshape(-1, 2).copy()
        swap = _reversed_corners(seen["faces"])
        corners[swap] = seen["faces"].reshape(-1, 2)[: len(swap)]
        made["faces"] = corners.ravel()
    return made
