"""Environments for training policies: many at once, courses, difficulties."""

import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import SubprocVecEnv

from agents.rl.config import TaskSpec
from agents.rl.envs import EnvFactory, NativeVecEnv, TrainingEnv, make_vec_env
from autopoly_env.targets import LEARNING
from tests.helpers.policies import factory

torch.set_num_threads(1)  # as tests run beside each other


def target_of(env: TrainingEnv) -> str:
    """The name of the target that it shows."""
    return env.unwrapped.clone_state().silhouette.name  # type: ignore[attr-defined, no-any-return]


def test_training_environment__is_the_environment_with_mask_and_price() -> None:
    env = factory().make(TaskSpec("objects", w_sc=0.3))
    seen, info = env.reset(seed=3)
    assert env.observation_space.contains(seen)
    assert np.array_equal(seen["action_mask"], info["action_mask"]) and seen["price"].tolist() == [np.float32(0.3)]
    total, rewards = info["r_all"], 0.0
    over = False
    while not over:
        seen, reward, over, truncated, info = env.step(int(np.flatnonzero(seen["action_mask"])[-1]))
        assert not truncated  # the steps that are left are in the observation
        rewards += reward
    assert rewards == pytest.approx(0.1 * (info["r_all"] - total)) == pytest.approx(info["episode"]["r"])
    assert info["episode"]["l"] == 5 and int(target_of(env).rpartition("_")[2]) in LEARNING


def test_native_environments__do_what_each_does_alone() -> None:
    many = make_vec_env(factory(), [TaskSpec(), TaskSpec("objects", 0.3)], 4, "native", seed=5)
    alone = [factory().make((TaskSpec(), TaskSpec("objects", 0.3))[k % 2]) for k in range(4)]
    seen = many.reset()
    starts = [env.reset(seed=5 + k)[0] for k, env in enumerate(alone)]
    rng = np.random.default_rng(0)
    for _ in range(8):
        for name, array in seen.items():
            assert np.array_equal(array, np.stack([one[name] for one in starts])), name
        actions = [int(rng.choice(np.flatnonzero(mask))) for mask in seen["action_mask"]]
        seen, rewards, dones, infos = many.step(np.array(actions))
        for k, env in enumerate(alone):
            starts[k], reward, over, _, _ = env.step(actions[k])
            assert rewards[k] == pytest.approx(reward) and dones[k] == over
            if over:
                assert np.array_equal(infos[k]["terminal_observation"]["vertices"], starts[k]["vertices"])
                starts[k], _ = env.reset()
    assert isinstance(many, NativeVecEnv) and many.seconds > 0.0


@pytest.mark.slow
def test_processes__do_the_same_as_one() -> None:
    courses = [TaskSpec(difficulty=(1, 2))]
    native = make_vec_env(factory(), courses, 2, "native", seed=1)
    workers = make_vec_env(factory(), courses, 2, "subproc", seed=1)
    try:
        assert isinstance(workers, SubprocVecEnv)
        first, second = native.reset(), workers.reset()
        assert all(np.array_equal(first[name], second[name]) for name in first)
        for envs in (native, workers):
            envs.env_method("set_difficulty", 1)
        assert (
            np.stack(workers.env_method("action_masks")).tolist()
            == np.stack(native.env_method("action_masks")).tolist()
        )
        third, fourth = native.step(np.array([1, 0])), workers.step(np.array([1, 0]))
        assert np.allclose(third[1], fourth[1]) and third[2].tolist() == fourth[2].tolist() == [False, True]
    finally:
        workers.close()


def test_target__comes_as_often_as_it_is_to_be_played() -> None:
    env = EnvFactory(factory().spec, resolution=32, n_plays=3).make(TaskSpec())
    starts = [(env.reset(seed=seed)[0], target_of(env)) for seed in (2, None, None, None)]
    targets = [target for _, target in starts]
    assert targets[0] == targets[1] == targets[2] != targets[3]
    assert all(np.array_equal(starts[0][0][name], starts[2][0][name]) for name in starts[0][0])
    for seed in (2, 3):
        env.reset(seed=seed)
        assert (target_of(env) == targets[0]) == (seed == 2)


def test_curriculum__draws_easy_constructions_first() -> None:
    env = factory().make(TaskSpec(difficulty=(1, 5)))
    env.set_difficulty(1)
    env.reset(seed=0)
    assert env.unwrapped.targets.source.difficulty == (1, 1)
    env.set_difficulty(9)
    assert env.unwrapped.targets.source.difficulty == (1, 5)
