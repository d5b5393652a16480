"""Environments for training policies: many at once, courses, difficulties."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import SubprocVecEnv

from agents.rl.config import TaskSpec
from agents.rl.envs import EnvFactory, NativeVecEnv, TrainingEnv, make_vec_env
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import check_faces
from autopoly_env.operators import OPERATORS, PRESETS, STOP, ActionCodec
from autopoly_env.targets import LEARNING
from tests.helpers.policies import config, factory

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


# --- styles and prices ---

MODELLER = TaskSpec("objects", (0.1, 1.5), faces="quads", policy_operators="modeller")
BOTH = EnvFactory(config().env.spec(), resolution=32, n_plays=2)
BOTH = replace(
    BOTH, spec=replace(BOTH.spec, operators=tuple(OPERATORS), faces=("any", "quads"), w_sc=(0.1, 1.5), max_steps=8)
)


@pytest.mark.parametrize("task", [MODELLER, TaskSpec(policy_operators="full")], ids=["modeller", "paper"])
def test_course__steps_only_legal_actions_of_its_own_operators(task: TaskSpec) -> None:
    env, codec = BOTH.make(task), ActionCodec(tuple(OPERATORS), BOTH.spec.max_vertices)
    own = {operator.name for operator in PRESETS[task.policy_operators]}
    rng = np.random.default_rng(0)
    seen, _ = env.reset(seed=2)
    taken = set()
    for _ in range(40):
        legal = np.flatnonzero(seen["action_mask"])
        assert {codec.decode(int(k)).operator for k in legal} <= own | {STOP.operator}
        assert np.array_equal(env.action_masks(), seen["action_mask"] > 0) and seen["rule"][2] == (task is MODELLER)
        before, number = env.unwrapped.state, int(rng.choice(legal))  # type: ignore[attr-defined]
        seen, _, over, _, info = env.step(number)
        after = env.unwrapped.state  # type: ignore[attr-defined]
        check_faces(after.mesh, task.faces, "the mesh")
        assert not info["invalid_action"] and after.action in (None, codec.decode(number))
        assert after.action is not None or after.mesh is before.mesh  # for which there was no room
        taken.add(after.action.operator if after.action else "")
        if over:
            seen, _ = env.reset()
    assert len(taken - {"", STOP.operator}) > 2
    other = next(name for name in OPERATORS if name not in own)
    with pytest.raises(IllegalActionError, match="of none of the operators"):
        env.step(codec.indices_of(other).start)


def test_prices__are_drawn_each_episode_by_the_seed_and_charged() -> None:
    def prices(seed: int) -> list[float]:
        env = BOTH.make(MODELLER)
        return [float(env.reset(seed=seed if k == 0 else None)[0]["price"][0]) for k in range(6)]

    drawn = prices(3)
    assert drawn == prices(3) != prices(4)
    assert len(set(drawn)) == 6 and all(0.1 <= price <= 1.5 for price in drawn)
    many = [MODELLER.price_at(k / 10) for k in range(11)]
    assert (many[0], many[10]) == (0.1, 1.5) and many[5] == pytest.approx((0.1 * 1.5) ** 0.5)
    env = BOTH.make(MODELLER)
    for seed in (1, None):  # a new target, then the same one at another price
        seen, first = env.reset(seed=seed)
        _, reward, _, _, info = env.step(int(np.flatnonzero(seen["action_mask"])[1]))
        gained = 100 * (info["r_sm"] - first["r_sm"]) - 5 * (info["r_si"] - first["r_si"])
        elements = float(info["r_sc"] - first["r_sc"])
        assert reward == pytest.approx(0.1 * (gained - float(seen["price"][0]) * elements), abs=1e-5)


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"w_sc": (1.5, 0.1)}, "w_sc .1.5, 0.1.: expected two prices of at least 0, the lower first"),
        ({"w_sc": (0.0, 1.0)}, "w_sc"),
        ({"policy_operators": "edge_crap"}, "edge_crap"),
    ],
)
def test_course_that_is_none__is_refused(settings: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint):
        TaskSpec(**settings)


def test_course__has_no_operators_but_the_policys() -> None:
    with pytest.raises(ConfigError, match="policy_operators modeller: the policy has full only"):
        factory().make(MODELLER)
