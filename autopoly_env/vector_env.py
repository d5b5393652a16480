"""`AutoPolyVectorEnv`: many environments that step at the same time, on all cores, here or in worker processes."""

import multiprocessing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import batch_space, create_shared_memory, read_from_shared_memory

from autopoly_env.arguments import one_of, whole
from autopoly_env.arrays import BoolArray, IntArray
from autopoly_env.compute import Routine, run_all
from autopoly_env.env import AutoPolyEnv, target_source
from autopoly_env.errors import ConfigError, EpisodeError, IllegalActionError
from autopoly_env.observation import Observation
from autopoly_env.workers import Request, Workers

Start = tuple[Observation, dict[str, Any]]
Infos = dict[str, Any]  # in Gymnasium's vector form: a row for every environment, and under `_key` who has one


class AutoPolyVectorEnv(SyncVectorEnv):
    """Gymnasium's SyncVectorEnv over `num_envs` AutoPolyEnvs, except that it steps all of them at once.

    The refits, nearly half of a step, run in kernels without the GIL: threads do them, as many as
    `autopoly_env.compute.n_threads()` says, while the calling thread does the rest. With `workers` of 2 or more, so
    many processes, at most one for each environment, do all of it for their share of the environments, and share
    those threads; what comes out is a `WorkersVectorEnv`. Seeds, autoreset, `reset_mask`, infos, `call`, `get_attr`
    and every number that comes out are SyncVectorEnv's.

    `autoreset_mode` is a `gymnasium.vector.AutoresetMode` or its value, `context` is how workers start ("spawn",
    "fork" or "forkserver"), `settings` are AutoPolyEnv's arguments. Raises ConfigError for what is not allowed.
    """

    def __new__(cls, num_envs: int = 1, *, workers: int = 1, **settings: Any) -> "AutoPolyVectorEnv":
        """With more than one worker for more than one environment: a WorkersVectorEnv."""
        n_workers = min(whole("num_envs", num_envs, 1), whole("workers", workers, 1))
        return super().__new__(WorkersVectorEnv if n_workers > 1 else cls)

    def __init__(
        self,
        num_envs: int = 1,
        *,
        workers: int = 1,
        context: str = "spawn",
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **settings: Any,
    ) -> None:
        one_of("context", context, tuple(multiprocessing.get_all_start_methods()))
        modes = {mode.value: mode for mode in AutoresetMode}
        mode = modes.get(autoreset_mode, autoreset_mode) if isinstance(autoreset_mode, str) else autoreset_mode
        if not isinstance(mode, AutoresetMode):
            raise ConfigError(f"autoreset_mode={autoreset_mode!r}: expected one of {', '.join(modes)}")
        if "targets" in settings:
            settings["targets"] = target_source(settings["targets"])  # one for all
        self._make(num_envs, workers, context, mode, settings)

    def _make(self, num_envs: int, workers: int, context: str, mode: AutoresetMode, settings: dict[str, Any]) -> None:
        envs = [AutoPolyEnv(**settings) for _ in range(num_envs)]
        self._n_actions = envs[0].codec.n_actions
        self._early = [_Early(env, mode) for env in envs]
        super().__init__([partial(_same, env) for env in self._early], autoreset_mode=mode)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """As SyncVectorEnv."""
        for env in self._early:
            env.forget()
        return super().reset(seed=seed, options=options)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step every environment with its action; `actions` (num_envs,) whole numbers.

        Raises IllegalActionError for actions that do not exist, EpisodeError where an environment has ended and
        nobody resets it (autoreset mode DISABLED), before any environment has moved.
        """
        indices = self._checked(actions)
        self._refuse_ended(env.is_over for env in self._early)
        pairs = zip(self._early, indices.tolist(), strict=True)
        steps_first = sorted(pairs, key=lambda pair: pair[0].is_over)  # they soon have jobs for the other threads
        run_all(env.work(action) for env, action in steps_first)
        return super().step(indices)

    def action_masks(self) -> Any:
        """(num_envs, n_actions) bool, which actions are legal now."""
        return np.stack(self.call("action_masks"))

    def _checked(self, actions: Any) -> IntArray:
        given = np.asarray(actions)
        if given.shape != (self.num_envs,) or not np.issubdtype(given.dtype, np.integer):
            raise IllegalActionError(
                f"actions of shape {given.shape} and dtype {given.dtype}: expected ({self.num_envs},) whole numbers"
            )
        if given.min() < 0 or given.max() >= self._n_actions:
            raise IllegalActionError(f"actions {given.tolist()}: expected each in 0..{self._n_actions - 1}")
        return given.astype(np.int64)

    def _refuse_ended(self, is_over: Iterable[bool]) -> None:
        over = [k for k, ended in enumerate(is_over) if ended]
        if over and self.autoreset_mode == AutoresetMode.DISABLED:
            raise EpisodeError(f"environments {over} have ended: reset them with options={{'reset_mask': ...}} first")


class WorkersVectorEnv(AutoPolyVectorEnv):
    """An AutoPolyVectorEnv whose environments are in worker processes, in shares of the same size but for one.

    Observations come back through shared memory, all else, `call` and `set_attr` included, pickled through pipes.
    Target sources and operators have to pickle, too: each worker has copies. There is no `envs`. Raises WorkerError
    where a worker has died, or where Ctrl-C or `close` has ended them.
    """

    def _make(self, num_envs: int, workers: int, context: str, mode: AutoresetMode, settings: dict[str, Any]) -> None:
        bounds = [k * num_envs // min(workers, num_envs) for k in range(min(workers, num_envs) + 1)]
        self._places = [slice(first, end) for first, end in pairwise(bounds)]
        shares = [AutoPolyVectorEnv(p.stop - p.start, autoreset_mode=mode, **settings) for p in self._places]
        one = shares[0]
        self.num_envs, self.autoreset_mode, self.metadata = num_envs, mode, one.metadata
        self.render_mode, self._n_actions = one.render_mode, one._n_actions
        self.single_action_space, self.single_observation_space = one.single_action_space, one.single_observation_space
        self.action_space = batch_space(one.single_action_space, num_envs)
        self.observation_space = batch_space(one.single_observation_space, num_envs)
        self._is_over = np.zeros(num_envs, np.bool_)
        processes: Any = multiprocessing.get_context(context)
        shared = create_shared_memory(one.single_observation_space, num_envs, processes)
        self._shared: Any = read_from_shared_memory(one.single_observation_space, shared, num_envs)
        makers = {
            f"environments {place.start} to {place.stop - 1}": partial(_Share, envs, place, num_envs)
            for envs, place in zip(shares, self._places, strict=True)
        }
        self._workers = Workers(makers, (shared,), context)

    def __reduce__(self) -> Any:
        raise TypeError("environments in worker processes do not pickle; call('clone_state') gives states that do")

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, Infos]:
        """As SyncVectorEnv."""
        if seed is None:
            seed = [None] * self.num_envs
        elif isinstance(seed, int):
            seed = [seed + k for k in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"{len(seed)} seeds: expected one for each of {self.num_envs} environments")
        given = dict(options or {})
        mask = _checked_mask(given.pop("reset_mask", np.ones(self.num_envs, np.bool_)), self.num_envs)
        requests: list[Request | None] = [
            ("reset", (seed[place], {**given, "reset_mask": mask[place]}), {}) if mask[place].any() else None
            for place in self._places
        ]
        infos = self._workers.ask(requests)
        self._is_over[mask] = False
        return self._observations_now(), self._joined([share or {} for share in infos])

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, Infos]:
        """As AutoPolyVectorEnv."""
        indices = self._checked(actions)
        self._refuse_ended(self._is_over)
        stepped = self._workers.ask([("step", (indices[place],), {}) for place in self._places])
        *arrays, infos = zip(*stepped, strict=True)
        rewards, terminated, truncated = map(np.concatenate, arrays)
        self._is_over = terminated | truncated
        return self._observations_now(), rewards, terminated, truncated, self._joined(infos)

    def render(self) -> tuple[Any, ...]:
        """As SyncVectorEnv."""
        return self.call("render")

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """As SyncVectorEnv."""
        shares = self._workers.ask([("call", (name, *args), kwargs)] * len(self._places))
        return tuple(result for results in shares for result in results)

    def set_attr(self, name: str, values: Any) -> None:
        """As SyncVectorEnv."""
        each = values if isinstance(values, list | tuple) else [values] * self.num_envs
        if len(each) != self.num_envs:
            raise ValueError(f"{len(each)} values of {name}: expected one for each of {self.num_envs} environments")
        self._workers.ask([("set_attr", (name, each[place]), {}) for place in self._places])

    def close_extras(self, **kwargs: Any) -> None:
        """End the workers."""
        self._workers.end("the environments have been closed")

    def _observations_now(self) -> Observation:
        return {name: array.copy() for name, array in self._shared.items()}

    def _joined(self, shares: Sequence[Mapping[str, Any]]) -> Infos:
        """The infos of all environments from those of each share."""
        infos: Infos = {}
        for key in dict.fromkeys(key for share in shares for key in share):
            rows: list[Any] = [share.get(key) for share in shares]
            one = next(some for some in rows if some is not None)
            if isinstance(one, dict):
                infos[key] = self._joined([some or {} for some in rows])
            elif all(some is not None for some in rows):
                infos[key] = np.concatenate(rows)
            else:
                infos[key] = np.full((self.num_envs, *one.shape[1:]), None if one.dtype == object else 0, one.dtype)
                for place, some in zip(self._places, rows, strict=True):
                    if some is not None:
                        infos[key][place] = some
        return infos


class _Share:
    """A worker's environments, as the others see them; what they observe goes to shared memory."""

    def __init__(self, envs: AutoPolyVectorEnv, place: slice, num_envs: int, shared: Any) -> None:
        everything: Any = read_from_shared_memory(envs.single_observation_space, shared, num_envs)
        envs._observations = {name: array[place] for name, array in everything.items()}
        envs.copy = False
        self._envs = envs
        self.call, self.set_attr = envs.call, envs.set_attr

    def prepare(self) -> Iterator[None]:
        """While the others still step, or somebody chooses actions: the resets that are due."""
        for env in self._envs._early:
            if env.is_over:
                env.prepare()
                yield

    def reset(self, seed: Any, options: dict[str, Any]) -> Infos:
        return self._envs.reset(seed=seed, options=options)[1]

    def step(self, actions: IntArray) -> tuple[Any, ...]:
        return self._envs.step(actions)[1:]


class _Early(gymnasium.Wrapper[Observation, Any, Observation, Any]):
    """An environment that has done its next `step`, and the `reset` due with it, before SyncVectorEnv asks for them."""

    def __init__(self, env: AutoPolyEnv, mode: AutoresetMode) -> None:
        super().__init__(env)
        self.is_over = False
        self._env = env
        self._mode = mode
        self._stepped: Any = None
        self._started: Start | None = None

    def prepare(self) -> None:
        """Do what can be done of a reset beforehand."""
        self._env.prepare_reset()

    def forget(self) -> None:
        """Drop what an interrupted step has left."""
        self._stepped = self._started = None

    def work(self, action: int) -> Routine[None]:
        """Do what SyncVectorEnv will ask for: a step, a reset, or a step and then a reset."""
        if self.is_over:  # which the mode NEXT_STEP alone allows
            self._started = yield from self._env.reset_routine()
            return
        self._stepped = yield from self._env.step_routine(action)
        self.is_over = self._stepped[2] or self._stepped[3]
        if self.is_over and self._mode == AutoresetMode.SAME_STEP:
            self._started = yield from self._env.reset_routine()

    def step(self, action: Any) -> Any:
        stepped, self._stepped = self._stepped, None
        return stepped

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Start:
        self.is_over = False
        if self._started is not None:
            started, self._started = self._started, None
            return started
        return self.env.reset(seed=seed, options=options)


def _same(env: _Early) -> _Early:
    return env


def _checked_mask(mask: Any, num_envs: int) -> BoolArray:
    """Raises what SyncVectorEnv does for a mask that is none."""
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f"options['reset_mask'] is a {type(mask).__name__}: expected a numpy array of bool")
    if mask.shape != (num_envs,) or not mask.any():
        raise ValueError(f"options['reset_mask'] {mask}: expected ({num_envs},) bool, at least one of them True")
    return mask
