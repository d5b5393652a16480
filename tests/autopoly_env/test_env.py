"""AutoPolyEnv: what it shows, what it pays, when it ends, what it refuses; and that it can be restored exactly."""

import ast
import copy
import doctest
import inspect
import pickle
import re
import runpy
import subprocess
import sys
import warnings
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import autopoly_env.env
from autopoly_env.conformance import check_env as check_autopoly_env
from autopoly_env.env import AutoPolyEnv
from autopoly_env.errors import AutoPolyError, ConfigError, EpisodeError, IllegalActionError, SilhouetteError
from autopoly_env.export.gif import save_gif
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action
from autopoly_env.raster import coverage
from autopoly_env.silhouette import Silhouette
from autopoly_env.targets import ConstructionTargets, split_seed
from tests.helpers.paths import ROOT

IDS = {"AutoPoly-v0": {}, "AutoPolyObjects-v0": {}, "AutoPolyFolder-v0": {"targets": str(ROOT / "examples")}}
SMALL: dict[str, Any] = {"resolution": 16, "obs_resolution": 16}
BOX = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)


def l_shape(size: int = 32) -> np.ndarray:
    """An L whose upper right quarter is missing: its bounding box has an IoU of 3/4."""
    mask = np.zeros((size, size), bool)
    mask[size // 8 : -size // 8, size // 8 : -size // 8] = True
    mask[: size // 2, size // 2 :] = False
    return mask


def make(**settings: Any) -> AutoPolyEnv:
    return AutoPolyEnv(**{**SMALL, **settings})


def begun(**settings: Any) -> AutoPolyEnv:
    env = make(**settings)
    env.reset(seed=1, options={"target": l_shape()})
    return env


def index_of(env: AutoPolyEnv, operator: str, element: int) -> int:
    return env.codec.encode(Action(operator, element))


def play(env: Any, n_steps: int, seed: int = 0, with_stop: bool = True) -> list[tuple[Any, ...]]:
    """Random legal actions; what each step returned, with the action first."""
    rng, steps = np.random.default_rng(seed), []
    for _ in range(n_steps):
        legal = np.flatnonzero(env.unwrapped.action_masks())
        action = int(rng.choice(legal if with_stop or len(legal) == 1 else legal[1:]))
        steps.append((action, *env.step(action)))
        if steps[-1][3] or steps[-1][4]:
            break
    return steps


def same(a: Any, b: Any) -> bool:
    """Whether two observations, infos or numbers are equal bit for bit."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    return type(a) is type(b) and a == b


# --- Gymnasium


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


def test_example_of_the_class__runs() -> None:
    parts = doctest.DocTestFinder().find(AutoPolyEnv, "AutoPolyEnv", module=autopoly_env.env)
    assert sum(doctest.DocTestRunner().run(part).attempted for part in parts) >= 5
    assert all(not doctest.DocTestRunner().run(part).failed for part in parts)


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


# --- what is seen


def test_observation__shows_the_mesh_and_the_target() -> None:
    env = make(obs_resolution=32)
    seen, _ = env.reset(options={"target": l_shape(), "mesh": PolyMesh.grid(2, 0.25, 0.25, 0.75, 0.75)})
    np.testing.assert_array_equal(seen["target"][0], 255 * l_shape())
    np.testing.assert_array_equal(seen["rendering"][0, 8:24, 8:24], 255)
    assert seen["rendering"].sum() == 255 * 16 * 16
    assert seen["counts"].tolist() == [9, 12, 4, 16]
    assert seen["remaining_steps"].tolist() == [20]
    vertices, edges = seen["vertices"].reshape(-1, 2), seen["edges"].reshape(-1, 2)
    faces = seen["faces"].reshape(-1, 2)
    assert vertices[4].tolist() == [0.5, 0.5]
    assert edges[:3].tolist() == [[0, 1], [0, 3], [1, 2]]
    assert faces[:5].tolist() == [[0, 0], [0, 1], [0, 4], [0, 3], [1, 1]]
    assert (vertices[9:] == -1).all() and (edges[12:] == -1).all() and (faces[16:] == -1).all()


def test_coverage__is_rounded_to_bytes_and_neither_overlaps_nor_flipped_faces_wrap_around() -> None:
    env = make(obs_resolution=8)
    half = PolyMesh.rectangle(0.0, 0.0, 0.5 / 8, 1.0)  # half of the first column
    twice = PolyMesh.from_faces(np.tile(BOX.vertices, (2, 1)), [(0, 1, 2, 3), (4, 5, 6, 7)])
    seen, _ = env.reset(options={"target": l_shape(), "mesh": half})
    assert set(seen["rendering"][0, :, 0].tolist()) == {128}
    seen, _ = env.reset(options={"target": l_shape(), "mesh": twice})
    assert seen["rendering"].max() == 255
    seen, _ = env.reset(options={"target": l_shape(), "mesh": PolyMesh.from_faces(BOX.vertices, [(3, 2, 1, 0)])})
    assert seen["rendering"].max() == 0


def test_vertices_far_outside__are_clipped_into_the_space() -> None:
    env = make()
    seen, _ = env.reset(options={"target": l_shape(), "mesh": PolyMesh.rectangle(-5.0, 0.25, 9.0, 0.75)})
    assert seen in env.observation_space
    assert seen["vertices"][:2].tolist() == [-1.0, 0.25]


def test_observations__are_in_their_space_in_every_step_of_long_random_play() -> None:
    env = make(operators="full", max_steps=300, max_vertices=24, match_threshold=1.0)
    for seed in range(3):
        env.reset(seed=seed)
        for _, seen, _, _, _, info in play(env, 120, seed, with_stop=False):
            assert seen in env.observation_space
            assert not info["invalid_action"]
    assert env.state.mesh.counts[0] > 20  # so that the masking of operators that overflow was needed


def test_operators_that_would_overflow__are_masked() -> None:
    env = make(operators="full", max_vertices=4)
    env.reset(options={"target": l_shape(), "mesh": BOX})
    legal = {env.codec.decode(int(index)).operator for index in np.flatnonzero(env.action_masks())}
    assert legal == {"stop", "face_split", "vertex_dissolve"}


def test_infos__keep_one_type_per_key_and_say_what_happened() -> None:
    env = make(max_steps=3)
    _, first = env.reset(options={"target": l_shape(), "mesh": BOX})
    assert (first["action"], first["ended_by"], first["invalid_action"]) == ("start", "", False)
    seen = [first, *(step[-1] for step in play(env, 3, with_stop=False))]
    expected = {
        "r_sm": float, "r_sc": int, "r_si": int, "r_all": float, "best_r_all": float, "n_refits": int, "action": str,
        "invalid_action": bool, "ended_by": str, "target": str, "action_mask": np.ndarray,
    }  # fmt: skip
    for info in seen:
        assert {key: type(value) for key, value in info.items()} == expected
        assert info["r_all"] == 100 * info["r_sm"] - info["r_sc"] - 5 * info["r_si"]
    assert seen[-1]["ended_by"] == "max_steps"
    assert seen[-1]["best_r_all"] == max(info["r_all"] for info in seen)


def test_words__name_elements_by_their_ids() -> None:
    env = make()
    env.reset(options={"target": l_shape(), "mesh": BOX})
    *_, info = env.step(index_of(env, "edge_subdivide", 0))
    assert info["action"] == "edge_subdivide edge 0–1"
    *_, info = env.step(0)
    assert info["action"] == "stop"


# --- what is paid


def test_score_reward__is_r_all_after_the_step() -> None:
    env = begun()
    for _, _, reward, _, _, info in play(env, 10):
        assert type(reward) is float
        assert reward == info["r_all"]


def test_improvements__add_up_to_the_final_minus_the_initial_score() -> None:
    env = begun(reward_mode="improvement", match_threshold=1.0)
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


# --- states


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


def test_same_seed__gives_the_same_episode_in_another_process() -> None:
    code = (
        "import gymnasium\n"
        "env = gymnasium.make('autopoly_env:AutoPoly-v0', resolution=16, obs_resolution=16)\n"
        "print(env.reset(seed=4)[1]['target'], env.step(3)[1].hex(), env.reset()[1]['target'])"
    )
    env = gymnasium.make("autopoly_env:AutoPoly-v0", **SMALL)
    expected = [env.reset(seed=4)[1]["target"], env.step(3)[1].hex(), env.reset()[1]["target"]]
    told = subprocess.run([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    assert told.split() == expected


def test_split__decides_which_targets_are_drawn() -> None:
    names = {split: make(split=split).reset(seed=1)[1]["target"] for split in ("train", "test")}
    seeds = {split: int(name.split("_")[1]) for split, name in names.items()}
    assert seeds["train"] < split_seed("test", 0) <= seeds["test"]


# --- what it takes


def test_target__may_be_an_array_a_path_or_a_silhouette(tmp_path: Path) -> None:
    env, path = make(), tmp_path / "l.npy"
    shape = Silhouette(l_shape(), "an L")
    assert env.reset(options={"target": shape})[1]["target"] == "an L"
    by_array = env.reset(options={"target": l_shape()})[0]
    assert same(env.reset(options={"target": shape})[0], by_array)
    assert env.reset(options={"target": str(ROOT / "examples" / "mug.png")})[1]["target"] == "mug"
    with pytest.raises(SilhouetteError):
        env.reset(options={"target": path})


def test_targets__may_be_a_source_of_ones_own() -> None:
    env = make(targets=ConstructionTargets(difficulty=1, operators="edge_subdivide"))
    assert env.reset(seed=0)[1]["target"].startswith("construction_")


def test_mesh_option__is_where_the_episode_begins() -> None:
    env = make()
    env.reset(seed=0, options={"mesh": BOX})
    assert env.state.mesh is BOX
    assert env.reset(seed=0)[1]["target"] == env.reset(seed=0, options={"mesh": BOX})[1]["target"]


BAD_SETTINGS: list[tuple[dict[str, Any], str]] = [
    ({"reward_mode": "scores"}, "'score', 'improvement'"),
    ({"render_mode": "human3d"}, "'rgb_array'"),
    ({"split": "valid"}, "'train', 'test'"),
    ({"operators": "papr"}, "paper"),
    ({"targets": "constructions"}, "construction"),
    ({"targets": 3}, "sample"),
    ({"targets": None}, "FOLDER"),
    ({"resolution": 4}, "8 to 1024"),
    ({"resolution": "64"}, "whole number"),
    ({"resolution": 64.0}, "whole number"),
    ({"obs_resolution": 0}, "at least"),
    ({"max_steps": 0}, "at least 1"),
    ({"max_steps": True}, "whole number"),
    ({"max_vertices": 3}, "at least 4"),
    ({"match_threshold": 0.0}, "above 0"),
    ({"match_threshold": "high"}, "number"),
    ({"w_sc": -1.0}, "at least 0"),
    ({"w_si": float("nan")}, "number"),
    ({"illegal_penalty": None}, "number"),
    ({"render_size": 3}, "at least 16"),
]


@pytest.mark.parametrize(("settings", "allowed"), BAD_SETTINGS, ids=[str(case[0]) for case in BAD_SETTINGS])
def test_bad_setting__is_refused_with_what_is_allowed(settings: dict[str, Any], allowed: str) -> None:
    with pytest.raises(ConfigError) as caught:
        make(**settings)
    assert allowed in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("action", [-1, 10**6, 2.0, "3", None, True, np.array([1, 2]), np.float64(1.0)], ids=repr)
def test_action_that_does_not_exist__is_refused(action: Any) -> None:
    env = begun()
    before = env.clone_state()
    with pytest.raises(IllegalActionError, match=r"0\.\.\d+") as caught:
        env.step(action)
    assert "\n" not in str(caught.value)
    assert env.clone_state() is before


@pytest.mark.parametrize("action", [3, np.int64(3), np.uint8(3), np.array(3)], ids=repr)
def test_whole_numbers_of_any_type__are_actions(action: Any) -> None:
    assert begun().step(action)[-1]["action"] == "edge_subdivide edge 1–2"


@pytest.mark.parametrize("wrapped", [True, False])
@pytest.mark.parametrize(
    "use",
    [
        lambda env: env.step(0),
        lambda env: env.unwrapped.state,
        lambda env: env.unwrapped.simulator,
        lambda env: env.unwrapped.clone_state(),
        lambda env: env.unwrapped.action_masks(),
    ],
)
def test_use_before_reset__is_refused(use: Any, wrapped: bool) -> None:
    env = gymnasium.make("autopoly_env:AutoPoly-v0", **SMALL) if wrapped else make()
    with pytest.raises(EpisodeError, match=r"reset\(\)"):
        use(env)


def test_step_after_the_end__is_refused() -> None:
    env = begun()
    env.step(0)
    with pytest.raises(EpisodeError, match=r"after the end of the episode \(stop\)"):
        env.step(0)


BIG = PolyMesh.grid(6, 0.2, 0.2, 0.8, 0.8)
BAD_OPTIONS: list[tuple[Any, str]] = [
    ({"targets": 1}, "target, mesh, state"),
    ({"mesh": BIG}, "max_vertices=32"),
    ({"mesh": [(0, 0), (1, 0), (1, 1)]}, "PolyMesh"),
    ({"mesh": BOX.with_vertices(np.full((4, 2), np.nan))}, "finite"),
    ({"target": np.zeros((16, 16), bool)}, "object"),
    ({"target": np.zeros((4, 4, 9))}, "expected"),
    ({"target": "no_such_file.png"}, "no_such_file.png"),
    ({"target": 7}, "expected"),
    ({"state": 7}, "clone_state"),
    ({"state": None, "mesh": BOX}, "alone"),
]


@pytest.mark.parametrize(("options", "says"), BAD_OPTIONS, ids=[case[1] for case in BAD_OPTIONS])
def test_bad_reset_option__is_refused_and_the_episode_goes_on(options: Any, says: str) -> None:
    env = begun()
    with pytest.raises(AutoPolyError) as caught:
        env.reset(options=options)
    assert says in str(caught.value) and "\n" not in str(caught.value)
    assert env.step(3)[-1]["action"] == "edge_subdivide edge 1–2"


OTHER_RULES = [{"resolution": 24}, {"max_vertices": 8}, {"operators": "full"}, {"w_sc": 0.3}, {"max_steps": 9}]


@pytest.mark.parametrize("other", OTHER_RULES, ids=str)
def test_state_of_other_rules__is_refused(other: dict[str, Any]) -> None:
    state, env = begun().clone_state(), begun(**other)
    with pytest.raises(ConfigError, match=f"{next(iter(other))}="):
        env.restore_state(state)


def test_state_that_a_planner_let_grow_too_large__is_refused() -> None:
    env = begun(max_vertices=4)
    state = env.simulator.transition(env.state, Action("edge_subdivide", 0))
    grown = autopoly_env.env.replace(env.clone_state(), state=state)
    with pytest.raises(ConfigError, match="at most 4 fit max_vertices=4"):
        env.restore_state(grown)


# --- pictures


def test_frames__have_one_even_size_and_show_what_changed() -> None:
    env = begun(render_mode="rgb_array", render_size=120)
    first = env.render()
    env.step(3)
    second = env.render()
    assert first.shape == second.shape and first.dtype == np.uint8
    assert first.shape[0] % 2 == first.shape[1] % 2 == 0
    green = (second == (14, 150, 72)).all(axis=-1)
    assert green.any() and not (first == (14, 150, 72)).all(axis=-1).any()


def test_words__of_a_frame_say_step_action_and_score() -> None:
    env = begun(render_mode="ansi")
    env.step(index_of(env, "edge_subdivide", 63))
    title, facts = env.render().splitlines()
    assert title == "step 1 of 20: nothing (illegal action)"
    assert facts.startswith(f"r_all {env.state.score.total:.2f} ")


def test_without_a_render_mode__nothing_is_drawn() -> None:
    assert begun().render() is None


def test_gif__has_a_frame_per_step_and_holds_the_last(tmp_path: Path) -> None:
    from PIL import Image

    env = begun(render_mode="rgb_array", render_size=64)
    frames = [env.render()]
    for _ in range(3):
        play(env, 1, len(frames), with_stop=False)
        frames.append(env.render())
    with Image.open(save_gif(frames, tmp_path / "episode.gif", fps=4)) as picture:
        assert (picture.n_frames, picture.size) == (4, frames[0].shape[1::-1])
        durations = []
        for k in range(4):
            picture.seek(k)
            durations.append(picture.info["duration"])
            shown = np.asarray(picture.convert("RGB"), np.int64)
            assert (shown == frames[k]).all(axis=-1).mean() > 0.9
            assert np.abs(shown - frames[k]).mean() < 1.0
    assert durations == [250, 250, 250, 2000]


@pytest.mark.parametrize(
    ("frames", "fps", "says"),
    [
        ([], 2.0, "one or more"),
        ([np.zeros((4, 4), np.uint8)], 2.0, "(H, W, 3)"),
        ([np.zeros((4, 4, 3), np.uint8), np.zeros((6, 4, 3), np.uint8)], 2.0, "one shape"),
        ([np.zeros((4, 4, 3))], 2.0, "uint8"),
        ([np.zeros((4, 4, 3), np.uint8)], 0.0, "0.1 to 50"),
    ],
)
def test_gif_of_bad_frames__is_refused(frames: Any, fps: float, says: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        save_gif(frames, tmp_path / "bad.gif", fps=fps)
    assert says in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_record_video__writes_an_episode(tmp_path: Path) -> None:
    pytest.importorskip("moviepy", reason="RecordVideo needs moviepy")
    env = gymnasium.make("autopoly_env:AutoPoly-v0", render_mode="rgb_array", render_size=64, **SMALL)
    env = gymnasium.wrappers.RecordVideo(env, str(tmp_path / "videos"), episode_trigger=lambda k: True)
    env.reset(seed=0)
    play(env, 3, with_stop=False)
    env.step(0)
    env.close()
    (video,) = (tmp_path / "videos").glob("*.mp4")
    assert video.stat().st_size > 1000


def test_human_mode__is_gymnasiums_wrapper() -> None:
    pytest.importorskip("pygame", reason="gymnasium's human rendering needs pygame")
    with pytest.warns(UserWarning, match="HumanRendering"):
        env = gymnasium.make("autopoly_env:AutoPoly-v0", render_mode="human", **SMALL)
    assert env.render_mode == "human"


# --- a stranger's agent


def test_agent_in_fifteen_lines__beats_random_play(capsys: pytest.CaptureFixture[str]) -> None:
    path = ROOT / "examples" / "agent_in_fifteen_lines.py"
    tree = ast.parse(path.read_text(encoding="utf-8"))
    first = tree.body[1].lineno  # after the docstring
    assert sum(bool(line.strip()) for line in path.read_text(encoding="utf-8").splitlines()[first - 1 :]) <= 15
    env = runpy.run_path(str(path))["env"]
    gains = [float(line.split("+")[1]) for line in capsys.readouterr().out.splitlines()]
    at_random = []
    for seed in range(len(gains)):
        _, start = env.reset(seed=seed)
        at_random.append(play(env, 20, seed)[-1][-1]["best_r_all"] - start["r_all"])
    assert np.mean(gains) > 2.0 * np.mean(at_random)
    assert min(gains) >= 0.0


# --- imports


def test_import__registers_all_ids_without_loading_what_only_an_episode_needs() -> None:
    code = (
        "import sys, autopoly_env, gymnasium\n"
        f"assert all(name in gymnasium.registry for name in {list(IDS)!r})\n"
        "assert not {'torch', 'skimage', 'scipy', 'numba'}.intersection(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_observations__never_share_memory() -> None:
    env = begun()
    seen = [step[1] for step in play(env, 4, with_stop=False)]
    for a, b in pairwise(seen):
        assert not any(np.shares_memory(a[key], b[key]) for key in a)
    np.testing.assert_array_equal(
        seen[-1]["rendering"][0], (255 * np.minimum(coverage(env.state.mesh, 16), 1) + 0.5).astype(np.uint8)
    )
