"""AutoPolyEnv: what Gymnasium asks of it, what it pays, when it ends."""

import inspect
import re
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import autopoly_env.env
from autopoly_env.conformance import check_env as check_autopoly_env
from autopoly_env.env import AutoPolyEnv
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.silhouette import Silhouette
from tests.helpers.environments import BOX, IDS, SMALL, begun, index_of, l_shape, make, play, same
from tests.helpers.paths import ROOT

# --- Gymnasium


@pytest.mark.slow
@pytest.mark.parametrize("name", IDS)
def test_gymnasiums_check__passes_without_a_warning(name: str) -> None:
    env = gymnasium.make(f"autopoly_env:{name}", **IDS[name]).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env)


@pytest.mark.parametrize("name", IDS)
def test_own_check__passes(name: str) -> None:
    check_autopoly_env(gymnasium.make(f"autopoly_env:{name}", **SMALL, **IDS[name]))


def test_folder_id__asks_for_the_folder() -> None:
    with pytest.raises(ConfigError, match="targets=FOLDER"):
        gymnasium.make("autopoly_env:AutoPolyFolder-v0")


def test_class_docstring__has_gymnasiums_headings() -> None:
    headings = re.findall(r"^## (.+)$", inspect.getdoc(AutoPolyEnv) or "", re.M)
    assert set(headings) >= {"Description", "Observation", "Action", "Reward", "Termination", "State", "Example"}


def test_documentation__names_every_key_argument_and_option() -> None:
    text = (ROOT / "docs" / "environment.md").read_text(encoding="utf-8")
    env = begun()
    _, info = env.reset()
    arguments = inspect.signature(AutoPolyEnv.__init__).parameters.keys() - {"self"}
    for name in (*env.observation_space.spaces, *info, *arguments, *autopoly_env.env.RESET_OPTIONS, *IDS):
        assert f"`{name}`" in text, name


def test_documentation__states_the_shapes_as_they_are() -> None:
    rows = re.findall(r"^\| `(\w+)` \| \(([^)]*)\) (\w+) \|", (ROOT / "docs/environment.md").read_text(), re.M)
    sizes = {"1": 1, "4": 4, "2 N": 64, "4 N": 128, "8 N": 256, "R": 48, "n_actions": -1}
    spaces = make(obs_resolution=48, max_vertices=32).observation_space.spaces
    stated = {
        key: (tuple(sizes[n.strip()] for n in shape.split(",") if n.strip()), dtype) for key, shape, dtype in rows
    }
    assert {key: stated[key] for key in spaces} == {key: (box.shape, str(box.dtype)) for key, box in spaces.items()}


# --- what is paid


def test_score_reward__is_r_all_after_the_step() -> None:
    env = begun()
    for _, _, reward, _, _, info in play(env, 10):
        assert type(reward) is float
        assert reward == info["r_all"]


def test_improvements__add_up_to_the_final_minus_the_initial_score() -> None:
    env = begun(reward_mode="improvement", match_threshold=1.0, illegal_penalty=0.0)  # some actions have no room
    initial = env.state.score.total
    steps = play(env, 20, with_stop=False)
    assert len(steps) > 4
    assert sum(step[2] for step in steps) == pytest.approx(steps[-1][-1]["r_all"] - initial)


def test_weights__are_those_given() -> None:
    env = make(w_sm=10.0, w_sc=2.0, w_si=0.0)
    _, info = env.reset(options={"target": l_shape(), "mesh": BOX})
    assert info["r_all"] == 10 * info["r_sm"] - 2 * 9


@pytest.mark.parametrize(("mode", "expected"), [("score", -2.5), ("improvement", -2.5)])
def test_illegal_action__is_a_step_in_which_nothing_is_done(mode: str, expected: float) -> None:
    env = make(reward_mode=mode, illegal_penalty=2.5)
    seen, info = env.reset(options={"target": l_shape(), "mesh": BOX})
    before = env.state
    after, reward, terminated, truncated, told = env.step(index_of(env, "edge_subdivide", 63))
    assert reward == expected + (info["r_all"] if mode == "score" else 0.0)
    assert (told["invalid_action"], told["n_refits"], terminated, truncated) == (True, 0, False, False)
    assert told["action"] == "edge_subdivide edge #63, not in this mesh"
    assert env.state.mesh is before.mesh and env.state.step == 1
    assert after.pop("remaining_steps") == seen.pop("remaining_steps") - 1
    assert same(after, seen)


def test_illegal_actions__use_up_the_steps() -> None:
    env = make(max_steps=3)
    env.reset(options={"target": l_shape(), "mesh": BOX})
    ends = [env.step(index_of(env, "face_delete", 0))[2:4] for _ in range(3)]
    assert ends == [(False, False), (False, False), (False, True)]


# --- when it ends


def test_stop__terminates() -> None:
    env = begun()
    _, reward, terminated, truncated, info = env.step(0)
    assert (terminated, truncated, info["ended_by"], reward) == (True, False, "stop", info["r_all"])


def test_match__terminates_also_in_the_last_step() -> None:
    env = make(match_threshold=0.9, max_steps=1, resolution=32)
    env.reset(options={"target": l_shape(), "mesh": PolyMesh.rectangle(0.1, 0.1, 0.9, 0.9)})
    _, _, terminated, truncated, info = env.step(index_of(env, "edge_extrude", 0))
    assert info["r_sm"] < 0.9 and truncated and not terminated
    env.reset(options={"target": l_shape(), "mesh": BOX})
    three_quarters = np.array([(0.125, 0.125), (0.5, 0.125), (0.5, 0.5), (0.875, 0.5), (0.875, 0.875), (0.125, 0.875)])
    env.reset(options={"target": l_shape(), "mesh": PolyMesh.from_faces(three_quarters, [range(6)])})
    _, _, terminated, truncated, info = env.step(index_of(env, "edge_subdivide", 0))
    assert (terminated, truncated, info["ended_by"]) == (True, False, "matched")


def test_target_that_a_rectangle_matches__can_still_be_played() -> None:
    env = make()
    mask = np.zeros((32, 32), bool)
    mask[8:24, 8:24] = True
    _, info = env.reset(options={"target": mask})
    assert (info["r_sm"], info["ended_by"]) == (1.0, "")
    assert env.step(0)[2] is True


# --- the same seeds again


class Counting:
    """Squares of which each has its seed's side, and how often they were drawn."""

    def __init__(self) -> None:
        self.n_drawn = 0

    @property
    def name(self) -> str:
        return "squares"

    def sample(self, seed: int) -> Silhouette:
        self.n_drawn += 1
        mask = np.zeros((32, 32), bool)
        mask[4 : 12 + seed % 16, 4 : 12 + seed % 16] = True
        return Silhouette(mask, f"square {seed}")


def test_reset__to_a_seed_of_before_draws_no_target_and_begins_alike() -> None:
    source = Counting()
    env = make(targets=source)
    first, info = env.reset(seed=5)
    mesh, n_refits = env.state.mesh, env.simulator.n_refits
    env.step(index_of(env, "edge_subdivide", 0))
    again, info_again = env.reset(seed=5)
    assert source.n_drawn == 1
    assert env.state.mesh == mesh and env.simulator.n_refits == n_refits
    assert all(np.array_equal(first[name], again[name]) for name in first)
    assert {name: str(value) for name, value in info.items()} == {name: str(v) for name, v in info_again.items()}


def test_reset_that_was_prepared__is_the_same() -> None:
    prepared, plain = make(), make()
    for env in (prepared, plain):
        env.reset(seed=3)
    for env in (prepared, plain):
        play(env, 2)
    prepared.prepare_reset()
    assert prepared.clone_state().best_r_all == plain.clone_state().best_r_all
    for _ in range(2):
        seen = prepared.reset(), plain.reset()
        assert all(same(a, b) for a, b in zip(*seen, strict=True))
        assert prepared.simulator.n_refits == plain.simulator.n_refits
    assert same(prepared.reset(seed=8)[0], plain.reset(seed=8)[0])


def test_reset__after_other_targets_were_put_in_place_draws_those() -> None:
    env, other = make(targets=Counting()), Counting()
    env.reset(seed=5)
    env.targets = other
    env.reset(seed=5)
    assert other.n_drawn == 1


# --- imports


@pytest.mark.parametrize("first", ["autopoly_env", "gymnasium"])
def test_import__registers_all_ids_without_loading_what_only_an_episode_needs(first: str) -> None:
    code = (
        f"import sys, {first}, autopoly_env\n"
        f"assert ('gymnasium' in sys.modules) == ({first!r} == 'gymnasium')\n"
        "import gymnasium\n"
        f"assert all(name in gymnasium.registry for name in {list(IDS)!r})\n"
        "assert not {'torch', 'skimage', 'scipy', 'numba'}.intersection(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
