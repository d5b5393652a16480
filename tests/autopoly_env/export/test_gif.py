"""GIFs: a frame a step, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from autopoly_env.errors import ConfigError
from autopoly_env.export.gif import save_gif
from tests.helpers.environments import begun, play


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
