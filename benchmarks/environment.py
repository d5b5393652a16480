"""Rows about the environment: steps a second alone and many at once, what observing costs, cloning, memory."""

import copy
import os
import pickle
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import gymnasium
import numpy as np

from autopoly_env.compute import set_threads
from autopoly_env.env import AutoPolyEnv, EnvState
from benchmarks.report import Must, Row, faster, not_measured
from benchmarks.timing import least_seconds

NAME = "autopoly_env:AutoPoly-v0"
RESOLUTION = 64
STEPS_A_SECOND = Must(">=", 1000.0)
SHARE_OF_OBSERVING = Must("<=", 0.25)
CLONE_SECONDS = Must("<=", 5e-6)
NATIVE_AGAINST_SINGLE = Must(">=", 1.6)
NATIVE_AGAINST_SYNC = Must(">=", 1.3)
GROWTH = Must("<=", 8.0)  # MB, of some 400
N_ENVS = 16
_N_STEPS = 1000  # of a measurement
_ROUNDS = 5
_WARM = 10_000  # steps after which memory must not grow
_MEMORY_RESOLUTION = 16  # memory does not depend on it, time does


def environment_rows() -> Iterator[Row]:
    """All but the memory: those take some 30 seconds."""
    set_threads(1)
    try:
        yield from _single_rows()
        yield from _observing_rows()
        yield _clone_row()
        yield from _vector_rows()
    finally:
        set_threads(None)


def memory_rows(n_steps: int = 60_000) -> Iterator[Row]:
    """What the process holds after `n_steps` random steps more than after the first 10,000."""
    name = f"memory gained in {n_steps:,} steps after the first {_WARM:,}"
    if not sys.platform.startswith("linux"):
        yield not_measured(name, "read from /proc, which Linux has")
        return
    env = gymnasium.make(NAME, resolution=_MEMORY_RESOLUTION, obs_resolution=_MEMORY_RESOLUTION)
    _play(env, _WARM)
    before = _megabytes()
    _play(env, n_steps, seed=1)
    after = _megabytes()
    yield Row(
        name, after - before, must=GROWTH, unit="MB", note=f"{before:.0f} MB before; resolution {_MEMORY_RESOLUTION}"
    )


def _single_rows() -> Iterator[Row]:
    for name, must in ((NAME, STEPS_A_SECOND), ("autopoly_env:AutoPolyObjects-v0", None)):
        env = gymnasium.make(name, resolution=RESOLUTION)
        _play(env, 200)
        rates = [_N_STEPS / _seconds(lambda env=env: _play(env, _N_STEPS)) for _ in range(_ROUNDS)]
        label = f"{name.split(':')[1]}, random legal actions"
        note = f"one core, {RESOLUTION}x{RESOLUTION}, drawing actions and resets included; best of {_ROUNDS} runs"
        yield Row(label, max(rates), must=must, unit="steps/s", note=note)


def _observing_rows() -> Iterator[Row]:
    """The share of a step that goes to observation, mask and info, on states whose topology nobody has looked at."""
    env = AutoPolyEnv(resolution=RESOLUTION)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    stepping, observing = [], []
    for _ in range(600):
        if env.state.done:
            env.reset()
        action = int(rng.choice(np.flatnonzero(env.action_masks())))
        stepping.append(_seconds(partial(env.step, action)))
        state: EnvState = pickle.loads(pickle.dumps(env.clone_state()))
        env.restore_state(state)
        observing.append(_seconds(lambda: (env._observation(), env._info())))
    share = float(np.sum(observing) / np.sum(stepping))
    note = f"{1e6 * np.mean(observing):.0f} of {1e6 * np.mean(stepping):.0f} µs"
    yield Row("observation, mask and info, share of a step", share, must=SHARE_OF_OBSERVING, note=note)


def _clone_row() -> Row:
    env = AutoPolyEnv(resolution=RESOLUTION)
    env.reset(seed=0)
    ours, deep = least_seconds(env.clone_state, lambda: copy.deepcopy(env), rounds=11)
    return Row("clone_state", ours, deep, must=CLONE_SECONDS, unit="s", note="against deepcopy(env)")


def _vector_rows() -> Iterator[Row]:
    """Times a step of 16 environments, natively on two threads, against one alone and 16 one after the other."""
    if (os.cpu_count() or 1) < 2:
        yield not_measured("native vector env, 2 threads", "this machine has one core")
        return
    players = [
        _player(
            gymnasium.make_vec(NAME, num_envs=N_ENVS, vectorization_mode="vector_entry_point", resolution=RESOLUTION)
        ),
        _player(gymnasium.make_vec(NAME, num_envs=N_ENVS, vectorization_mode="sync", resolution=RESOLUTION)),
        _player(gymnasium.make(NAME, resolution=RESOLUTION)),
    ]
    set_threads(2)
    for player in players:
        player(_N_STEPS // 4)
    turns = [[player(_N_STEPS) for player in players] for _ in range(2 * _ROUNDS)]
    native, sync, single = np.median(turns, axis=0)
    label, note = (
        f"native vector env, {N_ENVS} sub-envs, 2 threads",
        "time a step, resets included; both cores must be free",
    )
    yield faster(f"{label}: against one env", native, single, NATIVE_AGAINST_SINGLE, note)
    yield faster(f"{label}: against SyncVectorEnv", native, sync, NATIVE_AGAINST_SYNC, note)


def _player(env: Any) -> Callable[[int], float]:
    """A function that plays at least so many random legal steps on, and returns the seconds that a step took.

    Resets are part of it, drawing actions is not.
    """
    rng, n_envs = np.random.default_rng(0), getattr(env, "num_envs", 1)
    is_vector = hasattr(env, "num_envs")
    masks = [env.reset(seed=0)[1]["action_mask"]]

    def draw(mask: Any) -> Any:
        return rng.choice(np.flatnonzero(mask))

    def play(n_steps: int) -> float:
        seconds, n_calls = 0.0, -(-n_steps // n_envs)
        for _ in range(n_calls):
            action = np.array([draw(mask) for mask in masks[0]]) if is_vector else draw(masks[0])
            began = time.perf_counter()
            _, _, terminated, truncated, info = env.step(action)
            if not is_vector and (terminated or truncated):
                _, info = env.reset()
            seconds += time.perf_counter() - began
            masks[0] = info["action_mask"]
        return seconds / (n_calls * n_envs)

    return play


def _play(env: Any, n_steps: int, seed: int = 0) -> None:
    """Random legal actions, episode after episode."""
    env.action_space.seed(seed)
    _, info = env.reset(seed=seed)
    for _ in range(n_steps):
        _, _, terminated, truncated, info = env.step(env.action_space.sample(info["action_mask"]))
        if terminated or truncated:
            _, info = env.reset()


def _seconds(call: Any) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def _megabytes() -> float:
    """Resident memory of this process."""
    with open("/proc/self/statm", encoding="ascii") as stream:
        pages = int(stream.read().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
