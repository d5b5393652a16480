"""Frames of AutoPolyEnv: pictures, words, videos."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest

from tests.helpers.environments import SMALL, begun, index_of, play


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
