"""States of AutoPolyEnv: an episode is restored, copied and repeated bit for bit."""

import copy
import pickle
import subprocess
import sys

import gymnasium
import numpy as np
import pytest

from autopoly_env.errors import ConfigError
from autopoly_env.targets import split_seed
from tests.helpers.environments import SMALL, begun, make, play, same
from tests.helpers.paths import ROOT


@pytest.mark.slow
def test_replay_of_200_random_actions__is_the_same_bit_for_bit() -> None:
    rules = {"operators": "full", "max_steps": 250, "max_vertices": 40}
    env, other = make(**rules), make(**rules)
    env.reset(options={"target": ROOT / "examples" / "bicycle.png"})
    start = env.clone_state()
    steps = play(env, 200, with_stop=False)
    assert len(steps) == 200
    for player, state in ((env, start), (other, pickle.loads(pickle.dumps(start)))):
        player.restore_state(state)
        for action, *outcome in steps:
            assert all(same(a, b) for a, b in zip(outcome, player.step(action), strict=True))


def test_state_in_the_middle__is_restored_by_reset_with_its_info() -> None:
    env = begun()
    *_, (_, seen, _, _, _, info) = play(env, 3, with_stop=False)
    state = env.clone_state()
    play(env, 5, seed=1)
    again, told = env.reset(options={"state": state})
    assert same(seen, again) and same(info, told)


def test_env__survives_pickle_and_deepcopy_in_the_middle_of_an_episode() -> None:
    env = begun()
    play(env, 3, with_stop=False)
    copies = [pickle.loads(pickle.dumps(env)), copy.deepcopy(env)]
    steps = play(env, 5, seed=1, with_stop=False)
    for other in copies:
        for action, *outcome in steps:
            assert all(same(a, b) for a, b in zip(outcome, other.step(action), strict=True))
        assert other.np_random.bit_generator.state == env.np_random.bit_generator.state


def test_planner__uses_the_simulator_and_leaves_the_env_alone() -> None:
    env = begun()
    simulator, state = env.simulator, env.state
    children = simulator.transition_all(state)
    assert env.state is state
    best = max(children, key=lambda child: child.score.total)
    assert best.action is not None
    *_, info = env.step(env.codec.encode(best.action))
    assert info["r_all"] == best.score.total
    assert env.state == best


@pytest.mark.slow
def test_same_seed__gives_the_same_episode_in_another_process() -> None:
    code = (
        "import gymnasium\n"
        "env = gymnasium.make('autopoly_env:AutoPoly-v0', resolution=16, obs_resolution=16, info_texts=True)\n"
        "print(env.reset(seed=4)[1]['target'], env.step(3)[1].hex(), env.reset()[1]['target'])"
    )
    env = gymnasium.make("autopoly_env:AutoPoly-v0", **SMALL, info_texts=True)
    expected = [env.reset(seed=4)[1]["target"], env.step(3)[1].hex(), env.reset()[1]["target"]]
    told = subprocess.run([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    assert told.split() == expected


def test_split__decides_which_targets_are_drawn() -> None:
    names = {split: make(split=split).reset(seed=1)[1]["target"] for split in ("train", "test")}
    seeds = {split: int(name.split("_")[1]) for split, name in names.items()}
    assert seeds["train"] < split_seed("test", 0) <= seeds["test"]


# --- masks that are not exact, prices that change


def test_mask_that_is_not_exact__has_all_legal_actions_and_what_has_no_room_does_nothing() -> None:
    rules = {"operators": "full", "faces": "quads", "reward_mode": "improvement"}
    exact, quick = make(**rules), make(**rules, exact_mask=False)
    mask = exact.reset(seed=3)[1]["action_mask"]
    wider = quick.reset(seed=3)[1]["action_mask"]
    assert (wider >= mask).all() and wider.sum() > mask.sum()
    before = quick.unwrapped.state
    refused = int(np.flatnonzero(wider > mask)[0])
    _, reward, _, _, info = quick.step(refused)
    assert reward == 0.0 and not info["invalid_action"] and not info["action_mask"][refused]
    assert quick.unwrapped.state.mesh is before.mesh and quick.unwrapped.state.step == before.step + 1


def test_price__counts_from_the_next_reset_on() -> None:
    env = make(w_sc=1.0)
    first = env.reset(seed=5)[1]
    kept = env.unwrapped.clone_state()
    env.unwrapped.set_price(0.25)
    again = env.reset(seed=5)[1]
    assert again["r_all"] == pytest.approx(first["r_all"] + 0.75 * float(first["r_sc"]))
    assert env.unwrapped.simulator.weights.w_sc == 0.25
    with pytest.raises(ConfigError, match=r"w_sc=1\.0, this one has 0\.25"):
        env.unwrapped.restore_state(kept)
    with pytest.raises(ConfigError):
        env.unwrapped.set_price(-1.0)
