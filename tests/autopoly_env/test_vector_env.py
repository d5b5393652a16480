"""Vector environments: the native one gives what SyncVectorEnv gives, in every autoreset mode; workers that spawn."""

import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv

from autopoly_env.compute import set_threads
from autopoly_env.errors import ConfigError, EpisodeError, IllegalActionError
from autopoly_env.vector_env import AutoPolyVectorEnv
from tests.helpers.many import MODES, NAME, SMALL, rollout, same


def native(n: int = 3, mode: AutoresetMode = AutoresetMode.NEXT_STEP, **settings: Any) -> AutoPolyVectorEnv:
    envs = gymnasium.make_vec(
        NAME, num_envs=n, vectorization_mode="vector_entry_point", autoreset_mode=mode, **{**SMALL, **settings}
    )
    assert isinstance(envs, AutoPolyVectorEnv)
    return envs


def sync(n: int = 3, mode: AutoresetMode = AutoresetMode.NEXT_STEP) -> SyncVectorEnv:
    return gymnasium.make_vec(
        NAME, num_envs=n, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **SMALL
    )


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES, ids=str)
@pytest.mark.parametrize("n_threads", [1, 2])
def test_native__gives_what_sync_gives(mode: AutoresetMode, n_threads: int) -> None:
    set_threads(n_threads)
    try:
        ours, theirs = rollout(native(mode=mode), 25, mode), rollout(sync(mode=mode), 25, mode)
    finally:
        set_threads(None)
    assert len(ours) == len(theirs)
    assert all(same(a, b) for x, y in zip(ours, theirs, strict=True) for a, b in zip(x, y, strict=True))
    assert any((step[2] | step[3]).any() for step in ours if len(step) == 5)


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES, ids=str)
def test_async_with_spawned_workers__gives_what_sync_gives(mode: AutoresetMode) -> None:
    kwargs = {"context": "spawn", "autoreset_mode": mode}
    envs = gymnasium.make_vec(NAME, num_envs=2, vectorization_mode="async", vector_kwargs=kwargs, **SMALL)
    assert isinstance(envs, AsyncVectorEnv)
    try:
        theirs = rollout(envs, 8, mode)
    finally:
        envs.close()
    ours = rollout(native(2, mode), 8, mode)
    for x, y in zip(ours, theirs, strict=True):
        for a, b in zip(x, y, strict=True):
            assert same(a, b)


def test_make_vec_by_default__is_native() -> None:
    envs = gymnasium.make_vec(NAME, num_envs=2, **SMALL)
    assert isinstance(envs, AutoPolyVectorEnv)
    assert envs.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    assert envs.single_action_space == gymnasium.make(NAME, **SMALL).action_space


@pytest.mark.parametrize("mode", MODES, ids=str)
def test_mode_may_be_named(mode: AutoresetMode) -> None:
    assert AutoPolyVectorEnv(1, autoreset_mode=mode.value, **SMALL).metadata["autoreset_mode"] is mode


def test_modes_of_two_environments__do_not_mix() -> None:
    first = native(mode=AutoresetMode.SAME_STEP)
    native(mode=AutoresetMode.DISABLED)
    assert first.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP


def test_same_step_mode__shows_the_last_observation_in_the_info() -> None:
    envs = native(2, AutoresetMode.SAME_STEP)
    envs.reset(seed=0)
    seen, rewards, terminated, _, infos = envs.step(np.array([0, 1]))
    assert terminated.tolist() == [True, False]
    assert infos["_final_obs"].tolist() == [True, False]
    assert infos["final_info"]["end"].tolist() == [1, 0] and infos["end"].tolist() == [0, 0]
    assert {key: value.dtype.kind for key, value in infos["final_info"].items()} == {
        key: infos[key].dtype.kind for key in infos["final_info"]
    }
    assert rewards[0] == infos["final_info"]["r_all"][0]
    assert seen["remaining_steps"].tolist() == [[6], [5]]


def test_disabled_mode__refuses_to_go_on_after_an_end_and_moves_nobody() -> None:
    envs = native(2, AutoresetMode.DISABLED)
    envs.reset(seed=0)
    envs.step(np.array([0, 1]))
    before = envs.call("clone_state")
    with pytest.raises(EpisodeError, match=r"environments \[0\] have ended"):
        envs.step(np.array([0, 1]))
    assert all(a is b for a, b in zip(before, envs.call("clone_state"), strict=True))


@pytest.mark.parametrize(
    "actions", [[0], [0, 0, 9999], [0, -1, 0], [0.0, 1.0, 2.0], ["a", "b", "c"], 3, [[0, 0, 0]]], ids=str
)
def test_actions_that_do_not_exist__are_refused_before_anybody_moves(actions: Any) -> None:
    envs = native()
    envs.reset(seed=0)
    before = envs.call("clone_state")
    with pytest.raises(IllegalActionError, match=r"expected") as caught:
        envs.step(actions)
    assert "\n" not in str(caught.value)
    assert all(a is b for a, b in zip(before, envs.call("clone_state"), strict=True))


def test_step_before_reset__is_refused() -> None:
    with pytest.raises(EpisodeError, match=r"reset\(\)"):
        native().step([0, 0, 0])


@pytest.mark.parametrize(
    "make",
    [
        lambda: AutoPolyVectorEnv(0),
        lambda: AutoPolyVectorEnv(2, autoreset_mode="Never"),
        lambda: AutoPolyVectorEnv(2, targets="nowhere"),
        lambda: AutoPolyVectorEnv(2, reward_mode="nothing"),
    ],
)
def test_bad_setting__is_refused(make: Callable[[], Any]) -> None:
    with pytest.raises(ConfigError, match="expected"):
        make()


def test_masks__are_those_of_the_infos() -> None:
    envs = native()
    _, infos = envs.reset(seed=0)
    np.testing.assert_array_equal(envs.action_masks(), infos["action_mask"] == 1)
    _, _, _, _, infos = envs.step([1, 2, 3])
    np.testing.assert_array_equal(envs.action_masks(), infos["action_mask"] == 1)


def test_every_key_of_the_infos__has_one_type_for_all() -> None:
    envs = native(2)
    _, first = envs.reset(seed=0)
    _, _, _, _, second = envs.step([1, 2])
    types = {"r_sm": "f8", "r_sc": "i8", "r_si": "i8", "r_all": "f8", "best_r_all": "f8", "n_refits": "i8"}
    types |= {"invalid_action": "?", "end": "i8", "action_mask": "i1"}
    for infos in (first, second):
        assert {key: infos[key].dtype for key in infos if key[0] != "_"} == {
            key: np.dtype(name) for key, name in types.items()
        }


def test_reset_with_a_seed__is_the_same_after_a_step_that_broke_off() -> None:
    envs = native(2, AutoresetMode.SAME_STEP)
    expected = envs.reset(seed=3)
    for env in envs._early:  # as an interrupt leaves it: the work was done, and nobody collected it
        env.work(0)
    assert all(same(a, b) for a, b in zip(envs.reset(seed=3), expected, strict=True))


def test_native__survives_pickle() -> None:
    envs = native(2)
    envs.reset(seed=1)
    copy = pickle.loads(pickle.dumps(envs))
    assert all(same(a, b) for a, b in zip(envs.step([1, 2]), copy.step([1, 2]), strict=True))


def test_frames__come_from_every_environment() -> None:
    envs = native(2, render_mode="rgb_array", render_size=32)
    envs.reset(seed=0)
    assert [frame.shape[1:] for frame in envs.render()] == [(32, 3), (32, 3)]
