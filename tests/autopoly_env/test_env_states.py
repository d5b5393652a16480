"""States of AutoPolyEnv: an episode is restored, copied and repeated bit for bit."""

import copy
import pickle
import subprocess
import sys

import gymnasium
import pytest

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
