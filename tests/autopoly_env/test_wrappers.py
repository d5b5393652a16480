"""Wrappers: the same observation as a vector, with the mask in it, as a graph."""

import pickle
import re
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from autopoly_env.conformance import check_env as check_autopoly_env
from autopoly_env.env import AutoPolyEnv
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.wrappers import FlatObservation, GraphObservation, MaskInObservation, action_masks

SMALL: dict[str, Any] = {"resolution": 16, "obs_resolution": 16, "max_vertices": 9, "max_steps": 10}


def rllib(env: Any) -> MaskInObservation:
    return MaskInObservation(FlatObservation(env), observation_key="observations", dtype="float32")


def tianshou(env: Any) -> MaskInObservation:
    return MaskInObservation(FlatObservation(env), "mask", "obs", bool)


ALL = [FlatObservation, MaskInObservation, GraphObservation, rllib, tianshou]


def disc() -> np.ndarray:
    rows, columns = np.mgrid[:32, :32] - 15.5
    return rows**2 + columns**2 < 100


def begun(wrap: Any, mesh: PolyMesh | None = None) -> tuple[Any, Any]:
    env = wrap(AutoPolyEnv(**SMALL))
    options = {"target": disc()} if mesh is None else {"target": disc(), "mesh": mesh}
    return env, env.reset(options=options)[0]


@pytest.mark.parametrize("wrap", ALL)
def test_wrapped_env__passes_gymnasiums_check_and_ours(wrap: Any) -> None:
    env = wrap(gymnasium.make("autopoly_env:AutoPoly-v0", **SMALL))
    check_autopoly_env(env)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*different from the unwrapped version.*")
        check_env(env, skip_render_check=True)


@pytest.mark.parametrize("wrap", ALL)
def test_wrapped_env__keeps_its_masks_and_pickles(wrap: Any) -> None:
    env, _ = begun(wrap)
    copy = pickle.loads(pickle.dumps(env))
    assert env.get_wrapper_attr("action_masks")().sum() == copy.get_wrapper_attr("action_masks")().sum() > 4


def test_flat__scales_every_array_from_its_bounds() -> None:
    env, seen = begun(FlatObservation, PolyMesh.rectangle(0.0, 0.0, 1.0, 0.5))
    raw = env.env.observation_space.spaces
    sizes = {name: int(np.prod(box.shape)) for name, box in raw.items()}
    assert seen.shape == (sum(sizes.values()),) and seen.dtype == np.float32
    starts = dict(zip(raw, np.cumsum([0, *sizes.values()]), strict=False))

    def part(name: str) -> np.ndarray:
        return seen[starts[name] : starts[name] + sizes[name]]

    np.testing.assert_allclose(part("vertices")[:6], [1 / 3, 1 / 3, 2 / 3, 1 / 3, 2 / 3, 1 / 2], rtol=1e-6)
    assert (part("vertices")[8:] == 0).all()  # padding
    assert part("rendering").reshape(16, 16).mean(axis=1).tolist() == [1.0] * 8 + [0.0] * 8
    np.testing.assert_allclose(part("counts"), np.array([4, 4, 1, 4]) / 36)
    assert part("remaining_steps").tolist() == [1.0]


def test_mask__is_a_key_beside_the_others_or_beside_the_vector() -> None:
    env, seen = begun(MaskInObservation)
    np.testing.assert_array_equal(seen["action_mask"], env.unwrapped.action_masks())
    assert seen["action_mask"].dtype == np.int8
    assert seen.keys() == {*env.env.observation_space.spaces, "action_mask"}
    _, seen = begun(lambda env: MaskInObservation(FlatObservation(env)))
    assert seen.keys() == {"observation", "action_mask"}


def test_mask__is_where_the_library_looks_in_its_dtype() -> None:
    for wrap, keys, dtype in ((rllib, ("observations", "action_mask"), "float32"), (tianshou, ("obs", "mask"), "bool")):
        env, seen = begun(wrap)
        assert tuple(seen) == keys and seen[keys[1]].dtype == dtype
        np.testing.assert_array_equal(seen[keys[1]] == 1, env.action_masks())
        assert seen in env.observation_space
    env, seen = begun(lambda env: MaskInObservation(env, observation_key="everything"))
    assert seen.keys() == {"everything", "action_mask"} and seen["everything"].keys() > {"vertices", "edges"}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"key": "edges"}, "the observation has a key 'edges' already; give the mask another one, key=..."),
        ({"observation_key": "action_mask"}, "the observation has a key 'action_mask' already"),
        ({"dtype": "U1"}, "a mask of dtype 'U1': expected bool, or whole or real numbers"),
        ({"dtype": complex}, "a mask of dtype <class 'complex'>: expected bool"),
        ({"dtype": "nonsense"}, "a mask of dtype 'nonsense': expected bool"),
    ],
)
def test_mask_that_cannot_be_there__is_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(message)):
        MaskInObservation(AutoPolyEnv(**SMALL), **settings)


@pytest.mark.parametrize("kind", ["native", "sync"])
def test_masks__are_read_through_gymnasiums_vector_wrappers(kind: str) -> None:
    mode = "vector_entry_point" if kind == "native" else kind
    envs = gymnasium.make_vec("autopoly_env:AutoPoly-v0", num_envs=2, vectorization_mode=mode, **SMALL)
    wrapped = RecordEpisodeStatistics(envs)
    _, infos = wrapped.reset(seed=0)
    np.testing.assert_array_equal(action_masks(wrapped), infos["action_mask"] == 1)
    env = gymnasium.make("autopoly_env:AutoPoly-v0", **SMALL)
    _, info = env.reset(seed=0)
    np.testing.assert_array_equal(action_masks(env), info["action_mask"] == 1)


def test_graph__has_the_vertices_and_edges_of_the_mesh() -> None:
    env, seen = begun(GraphObservation, PolyMesh.grid(2, 0.25, 0.25, 0.75, 0.75).with_vertices(_grid_of_9()))
    mesh, graph = env.unwrapped.state.mesh, seen["graph"]
    np.testing.assert_allclose(graph.nodes[:, :2], mesh.vertices, rtol=1e-6)
    assert graph.nodes[:, 2].tolist() == [1, 1, 1, 1, 0, 1, 1, 1, 1]
    assert graph.nodes[4, 3] == 1.0 and graph.nodes[0, 3] == 0.0  # the disc is in the middle
    np.testing.assert_array_equal(graph.edge_links, mesh.edges)
    np.testing.assert_allclose(graph.edges[:, 0], 0.45, rtol=1e-6)
    assert graph.edges[:, 1].sum() == 8
    assert seen in env.observation_space


def _grid_of_9() -> np.ndarray:
    return np.array([(0.05 + 0.45 * column, 0.05 + 0.45 * row) for row in range(3) for column in range(3)])


def test_graph__follows_the_mesh_as_it_grows_and_takes_vertices_outside() -> None:
    env, seen = begun(GraphObservation, PolyMesh.rectangle(-3.0, 0.2, 5.0, 0.8))
    assert seen in env.observation_space
    assert seen["graph"].nodes[:, 3].tolist() == [0, 0, 0, 0]
    seen, *_ = env.step(1)
    assert len(seen["graph"].nodes) == 5 and len(seen["graph"].edge_links) == 5


def test_wrapping_what_is_no_autopoly_env__is_refused() -> None:
    with pytest.raises(ConfigError, match="AutoPolyEnv"):
        FlatObservation(gymnasium.make("CartPole-v1"))


@pytest.mark.parametrize("wrap", [FlatObservation, GraphObservation])
def test_wrapping_another_form_of_the_observation__is_refused(wrap: Any) -> None:
    with pytest.raises(ConfigError, match="wrap it first"):
        wrap(FlatObservation(AutoPolyEnv(**SMALL)))


def test_wrappers__can_be_made_again_from_the_spec() -> None:
    env = rllib(gymnasium.make("autopoly_env:AutoPoly-v0", **SMALL))
    assert env.spec is not None
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.observation_space == env.observation_space
    assert again.reset(seed=1)[0].keys() == env.reset(seed=1)[0].keys()
