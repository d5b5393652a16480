"""What is seen of an episode: observations in their spaces, masks, infos, words."""

from itertools import pairwise

import numpy as np
import pytest

from autopoly_env.env import ENDS
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import coverage
from tests.helpers.environments import BOX, begun, index_of, l_shape, make, play


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


@pytest.mark.slow
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
    env = make(max_steps=3, info_texts=False)
    _, first = env.reset(options={"target": l_shape(), "mesh": BOX})
    assert (first["end"], first["invalid_action"]) == (0, False)
    seen = [first, *(step[-1] for step in play(env, 3, with_stop=False))]
    expected = {
        "r_sm": (np.float64, "f8"), "r_sc": (np.int64, "i8"), "r_si": (np.int64, "i8"), "r_all": (np.float64, "f8"),
        "best_r_all": (np.float64, "f8"), "n_refits": (np.int64, "i8"), "invalid_action": (np.ndarray, "?"),
        "end": (np.int64, "i8"), "action_mask": (np.ndarray, "i1"),
    }  # fmt: skip
    for info in seen:
        assert {key: (type(value), value.dtype) for key, value in info.items()} == expected
        assert info["r_all"] == 100 * info["r_sm"] - info["r_sc"] - 5 * info["r_si"]
    assert ENDS[seen[-1]["end"]] == "max_steps"
    assert seen[-1]["best_r_all"] == max(info["r_all"] for info in seen)


def test_texts__come_where_they_are_asked_for() -> None:
    env = make()
    _, info = env.reset(options={"target": l_shape(), "mesh": BOX})
    assert (info["action"], info["ended_by"], info["target"]) == ("start", "", env.clone_state().silhouette.name)
    *_, info = env.step(0)
    assert (info["action"], info["ended_by"]) == ("stop", "stop")


def test_words__name_elements_by_their_ids() -> None:
    env = make()
    env.reset(options={"target": l_shape(), "mesh": BOX})
    *_, info = env.step(index_of(env, "edge_subdivide", 0))
    assert info["action"] == "edge_subdivide edge 0–1"
    *_, info = env.step(0)
    assert info["action"] == "stop"


def test_observations__never_share_memory() -> None:
    env = begun()
    seen = [step[1] for step in play(env, 4, with_stop=False)]
    for a, b in pairwise(seen):
        assert not any(np.shares_memory(a[key], b[key]) for key in a)
    np.testing.assert_array_equal(
        seen[-1]["rendering"][0], (255 * np.minimum(coverage(env.state.mesh, 16), 1) + 0.5).astype(np.uint8)
    )
