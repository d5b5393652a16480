"""Environments as the algorithms see them: with the action mask and the price of an element in the observation.

The number of steps that are left is part of the observation, so an episode that `max_steps` ends has simply ended: its
last state is worth nothing more, and nothing is bootstrapped.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

from agents.rl.config import SpaceSpec, TaskSpec
from agents.rl.player import observation_of
from autopoly_env.arrays import AnyArray, BoolArray, IntArray
from autopoly_env.compute import Routine, run, run_all, set_threads
from autopoly_env.env import AutoPolyEnv, EnvState
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import FACE_RULES
from autopoly_env.observation import Observation
from autopoly_env.operators import ActionCodec
from autopoly_env.silhouette import Silhouette
from autopoly_env.targets import LEARNING, TargetSource

_HIGHEST_PRICE = 1e6
_OTHER = -1  # instead of the number of an action


@dataclass(frozen=True)
class _LearningTargets:
    """A source whose held-out targets never come up."""

    source: TargetSource

    @property
    def name(self) -> str:
        return self.source.name

    def sample(self, seed: int) -> Silhouette:
        return self.source.sample(LEARNING[seed % len(LEARNING)])


@dataclass(frozen=True)
class EnvFactory:
    """Makes environments to learn in; its fields are what all those of a training have in common."""

    spec: SpaceSpec
    resolution: int = 64  # pixels a side at which meshes are fitted and scored
    reward_scale: float = 0.1  # reward of a point of r_all
    illegal_penalty: float = 1.0  # points of r_all
    n_plays: int = 1  # episodes with a target before the next one comes, which takes longer than a step

    def make(self, task: TaskSpec) -> "TrainingEnv":
        """An environment for a task. Raises ConfigError."""
        spec = self.spec
        env = AutoPolyEnv(
            targets=_LearningTargets(task.source()),
            operators=",".join(task.operators_of(spec)),
            faces=task.faces,
            exact_mask=False,
            resolution=self.resolution,
            obs_resolution=spec.obs_resolution,
            max_steps=spec.max_steps,
            max_vertices=spec.max_vertices,
            match_threshold=1.0,
            reward_mode="improvement",
            illegal_penalty=self.illegal_penalty,
            w_sc=task.prices[0],
        )
        return TrainingEnv(env, task, self.reward_scale, self.n_plays, spec.operators)


class TrainingEnv(gymnasium.Wrapper[Observation, Any, Observation, Any]):
    """An environment to learn in; see the module. `info["episode"]` at an end is what SB3's Monitor would say."""

    def __init__(
        self,
        env: AutoPolyEnv,
        task: TaskSpec,
        reward_scale: float,
        n_plays: int = 1,
        operators: tuple[str, ...] = (),
    ) -> None:
        """`operators`: those that the policy numbers its actions by, if it knows more than the environment's."""
        super().__init__(env)
        self._inner, self._task, self._reward_scale = env, task, reward_scale
        codec = ActionCodec(operators or env.codec.operators, env.codec.max_vertices)
        self._number = _numbers(env.codec, codec)  # (G,) the environment's number of each action; _OTHER for none
        self._price, self._prices = task.prices[0], np.random.default_rng()
        boxes = dict(env.observation_space.spaces)  # type: ignore[attr-defined]
        more: dict[str, gymnasium.Space[Any]] = {
            "action_mask": spaces.Box(0, 1, (codec.n_actions,), np.int8),
            "price": spaces.Box(0.0, _HIGHEST_PRICE, (1,), np.float32),
            "rule": spaces.Box(0.0, 1.0, (len(FACE_RULES),), np.float32),
        }
        self.observation_space = cast(gymnasium.Space[Observation], spaces.Dict({**boxes, **more}))
        self.action_space = spaces.Discrete(codec.n_actions)
        self._return = 0.0
        self._n_plays, self._n_played = n_plays, 0
        self._first: EnvState | None = None  # of this target

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        if seed is not None:
            self.seed(seed)
        return run(self.reset_routine(options))

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        return run(self.step_routine(action))

    def reset_routine(self, options: dict[str, Any] | None = None) -> Routine[tuple[Observation, dict[str, Any]]]:
        """As that of `AutoPolyEnv`; without options the same target again, until it has had its plays."""
        low, high = self._task.prices
        if low < high:
            self._price = self._task.price_at(self._prices.random())
            self._inner.set_price(self._price)
        if not options and self._first is not None and self._n_played < self._n_plays:
            options = {"state": self._first} if low == high else _from(self._first)
        else:
            self._n_played = 0
        observation, info = yield from self._inner.reset_routine(options)
        self._first = self._inner.clone_state()
        self._return, self._n_played = 0.0, self._n_played + 1
        return self._seen(observation, info), info

    def step_routine(self, action: Any) -> Routine[tuple[Observation, float, bool, bool, dict[str, Any]]]:
        """As that of `AutoPolyEnv`. Raises IllegalActionError for an action of an operator that its task has not."""
        observation, points, terminated, truncated, info = yield from self._inner.step_routine(self._own(action))
        reward = self._reward_scale * points
        self._return += reward
        if terminated or truncated:
            length = self._inner.state.step + (self._inner.state.done == "stop")
            info["episode"] = {"r": self._return, "l": length, "t": 0.0}
        return self._seen(observation, info), reward, terminated or truncated, False, info

    def seed(self, seed: int) -> None:
        """Draw the next targets from this seed on."""
        gymnasium.Env.reset(self._inner, seed=seed)
        self._prices = np.random.default_rng((seed, 1))
        self._first = None

    def action_masks(self) -> AnyArray:
        """(n_actions,) bool, which actions are legal now."""
        return self._widened(self._inner.action_masks())

    def set_difficulty(self, most: int) -> None:
        """Draw constructions of at most this difficulty from now on."""
        if self._task.targets == "construction":
            low, high = self._task.difficulty
            self._inner.targets = _LearningTargets(self._task.source((min(low, most), min(high, most))))

    def _own(self, action: Any) -> int:
        """The environment's number of an action of the policy's."""
        number = int(self._number[int(action)])
        if number == _OTHER:
            raise IllegalActionError(f"action {action} is of none of the operators {self._inner.codec.operators} here")
        return number

    def _widened(self, mask: BoolArray) -> BoolArray:
        """(G,) the environment's mask in the policy's numbers."""
        return np.where(self._number == _OTHER, False, mask[self._number])

    def _seen(self, observation: Observation, info: dict[str, Any]) -> Observation:
        mask = self._widened(info["action_mask"].astype(np.bool_))
        info["action_mask"] = mask.astype(np.int8)
        return observation_of(observation, mask, self._price, self._task.faces)


def _numbers(own: ActionCodec, known: ActionCodec) -> IntArray:
    """(G,) the number in codec `own` of each action of `known`; _OTHER for those of operators that it has not."""
    numbers = np.full(known.n_actions, _OTHER)
    numbers[0] = 0  # STOP
    for name in own.operators:
        places = own.indices_of(name)
        numbers[known.indices_of(name)] = np.arange(places.start, places.stop)
    return numbers


def _from(state: EnvState) -> dict[str, Any]:
    """The options of a reset that begins where an episode began, at another price."""
    return {"target": state.silhouette, "mesh": state.state.mesh}


class NativeVecEnv(VecEnv):
    """Many environments in one process that step at the same time, on all its threads, as `AutoPolyVectorEnv` does.

    `seconds` is the time spent in them.
    """

    def __init__(self, envs: Sequence[TrainingEnv]) -> None:
        self.envs = list(envs)
        self.seconds = 0.0
        self._actions: list[int] = []
        super().__init__(len(self.envs), self.envs[0].observation_space, self.envs[0].action_space)

    def reset(self) -> dict[str, AnyArray]:
        began = time.perf_counter()
        for env, seed in zip(self.envs, self._seeds, strict=True):
            if seed is not None:
                env.seed(seed)
        starts = run_all(env.reset_routine() for env in self.envs)
        self.reset_infos = [info for _, info in starts]
        self._reset_seeds()
        self._reset_options()
        self.seconds += time.perf_counter() - began
        return _stacked([observation for observation, _ in starts])

    def step_async(self, actions: AnyArray) -> None:
        self._actions = [int(action) for action in actions]

    def step_wait(self) -> tuple[Any, AnyArray, AnyArray, list[dict[str, Any]]]:
        began = time.perf_counter()
        stepped = run_all(_step(env, action) for env, action in zip(self.envs, self._actions, strict=True))
        observations, rewards, dones, infos = zip(*stepped, strict=True)
        self.seconds += time.perf_counter() - began
        return _stacked(observations), np.array(rewards, np.float32), np.array(dones), list(infos)

    def close(self) -> None:
        pass

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [env.get_wrapper_attr(attr_name) for env in self._some(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        for env in self._some(indices):
            setattr(env, attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        return [getattr(env, method_name)(*method_args, **method_kwargs) for env in self._some(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [isinstance(env, wrapper_class) for env in self._some(indices)]

    def _some(self, indices: Any) -> list[TrainingEnv]:
        return [self.envs[k] for k in self._get_indices(indices)]


def make_vec_env(factory: EnvFactory, tasks: Sequence[TaskSpec], n_envs: int, kind: str, seed: int) -> VecEnv:
    """`n_envs` environments that take the tasks in turn; `kind` "native": one process, "subproc": one each.

    Raises ConfigError for settings out of range.
    """
    if not tasks or n_envs < len(tasks):
        raise ConfigError(f"{n_envs} environments for {len(tasks)} tasks: expected a task, and an environment for each")
    chosen = [tasks[k % len(tasks)] for k in range(n_envs)]
    envs: VecEnv
    if kind == "native":
        envs = NativeVecEnv([factory.make(task) for task in chosen])
    else:
        factory.make(chosen[0])  # what is wrong with the settings is said here
        envs = SubprocVecEnv([_Worker(factory, task) for task in chosen], start_method="spawn")
    envs.seed(seed)
    return envs


class _Worker:
    """Makes an environment in a process of its own."""

    def __init__(self, factory: EnvFactory, task: TaskSpec) -> None:
        self._factory, self._task = factory, task

    def __call__(self) -> gymnasium.Env[Any, Any]:
        set_threads(1)
        return self._factory.make(self._task)


def _step(env: TrainingEnv, action: int) -> Routine[tuple[Observation, float, bool, dict[str, Any]]]:
    """A step and, where it ends the episode, the reset."""
    observation, reward, done, _, info = yield from env.step_routine(action)
    if done:
        info["terminal_observation"] = observation
        info["TimeLimit.truncated"] = False
        observation, _ = yield from env.reset_routine()
    return observation, reward, done, info


def _stacked(observations: Sequence[Observation]) -> dict[str, AnyArray]:
    return {name: np.stack([observation[name] for observation in observations]) for name in observations[0]}
