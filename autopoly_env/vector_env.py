"""`AutoPolyVectorEnv`: many environments that step at the same time, on all cores of one process."""

from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from autopoly_env.arrays import IntArray
from autopoly_env.compute import Routine, run_all
from autopoly_env.env import AutoPolyEnv, target_source
from autopoly_env.errors import ConfigError, EpisodeError, IllegalActionError
from autopoly_env.observation import Observation

Start = tuple[Observation, dict[str, Any]]


class AutoPolyVectorEnv(SyncVectorEnv):
    """Gymnasium's SyncVectorEnv over `num_envs` AutoPolyEnvs, except that it steps all of them at once.

    The refits, more than half of a step, run in kernels without the GIL: threads do them, as many as
    `autopoly_env.compute.n_threads()` says, while the calling thread does the rest. Seeds, autoreset, `reset_mask`,
    infos, `call`, `get_attr` and every number that comes out are SyncVectorEnv's.

    `autoreset_mode` is a `gymnasium.vector.AutoresetMode` or its value, `settings` are AutoPolyEnv's arguments. Raises
    ConfigError for what is not allowed.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **settings: Any,
    ) -> None:
        if num_envs < 1:
            raise ConfigError(f"num_envs={num_envs}: expected at least 1")
        modes = {mode.value: mode for mode in AutoresetMode}
        mode = modes.get(autoreset_mode, autoreset_mode) if isinstance(autoreset_mode, str) else autoreset_mode
        if not isinstance(mode, AutoresetMode):
            raise ConfigError(f"autoreset_mode={autoreset_mode!r}: expected one of {', '.join(modes)}")
        if "targets" in settings:
            settings["targets"] = target_source(settings["targets"])  # one for all
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
        over = [k for k, env in enumerate(self._early) if env.is_over]
        if over and self.autoreset_mode == AutoresetMode.DISABLED:
            raise EpisodeError(f"environments {over} have ended: reset them with options={{'reset_mask': ...}} first")
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


class _Early(gymnasium.Wrapper[Observation, Any, Observation, Any]):
    """An environment that has done its next `step`, and the `reset` due with it, before SyncVectorEnv asks for them."""

    def __init__(self, env: AutoPolyEnv, mode: AutoresetMode) -> None:
        super().__init__(env)
        self.is_over = False
        self._env = env
        self._mode = mode
        self._stepped: Any = None
        self._started: Start | None = None

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
