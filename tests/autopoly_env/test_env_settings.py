"""What AutoPolyEnv takes for settings, targets, actions and options, and what it refuses."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import autopoly_env.env
from autopoly_env.errors import AutoPolyError, ConfigError, EpisodeError, IllegalActionError, SilhouetteError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action
from autopoly_env.silhouette import Silhouette
from autopoly_env.targets import ConstructionTargets
from tests.helpers.environments import BOX, SMALL, begun, l_shape, make, same
from tests.helpers.paths import ROOT


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
