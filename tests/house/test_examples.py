"""The examples: silhouettes are what the script draws and what their README says; the short agent beats chance."""

import ast
import runpy
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from skimage.measure import label

from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator
from examples import draw_examples
from examples.alphazero_search import search
from tests.helpers.environments import play
from tests.helpers.paths import ROOT

EXAMPLES = Path(draw_examples.__file__).parent
PICTURES = sorted(EXAMPLES.glob("*.png"))


def pixels(path: Path) -> np.ndarray:
    """The picture as it is stored, (512, 512) uint8."""
    with Image.open(path) as image:
        return np.asarray(image)


def readme_rows() -> dict[str, tuple[int, int]]:
    """(pieces, holes) by picture name, from the table in the README."""
    lines = (EXAMPLES / "README.md").read_text(encoding="utf-8").splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| `")]
    return {name.strip("`"): (int(pieces), int(holes)) for name, _, pieces, holes in rows}


def test_drawing_again__gives_the_committed_pixels(tmp_path: Path) -> None:
    draw_examples.main(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [path.name for path in PICTURES]
    for picture in PICTURES:
        np.testing.assert_array_equal(pixels(tmp_path / picture.name), pixels(picture), err_msg=picture.name)


def test_readme__lists_every_picture() -> None:
    assert sorted(readme_rows()) == [path.name for path in PICTURES]


@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.stem)
def test_picture__is_a_small_black_and_white_silhouette_clear_of_the_edge(picture: Path) -> None:
    image = pixels(picture)
    assert image.shape == (512, 512)
    assert set(np.unique(image)) == {0, 255}
    assert not np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]]).any()
    assert picture.stat().st_size < 20_000


@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.stem)
def test_picture__has_the_pieces_and_holes_that_the_readme_says(picture: Path) -> None:
    inside = pixels(picture) > 0
    n_pieces = label(inside, connectivity=2).max()
    n_holes = label(~inside, connectivity=1).max() - 1  # the surroundings are one region of the background
    assert (n_pieces, n_holes) == readme_rows()[picture.name]


@pytest.mark.slow
def test_agent_in_fifteen_lines__beats_random_play(capsys: pytest.CaptureFixture[str]) -> None:
    path = ROOT / "examples" / "agent_in_fifteen_lines.py"
    tree = ast.parse(path.read_text(encoding="utf-8"))
    first = tree.body[1].lineno  # after the docstring
    assert sum(bool(line.strip()) for line in path.read_text(encoding="utf-8").splitlines()[first - 1 :]) <= 15
    example = runpy.run_path(str(path))
    printed = [float(line.split("+")[1]) for line in capsys.readouterr().out.splitlines()]
    assert min(printed) >= 0.0
    env, solve = example["env"], example["solve"]
    env.action_space.seed(0)  # the example draws anew each time; here the same actions always
    gains = [solve(seed)[0] for seed in range(len(printed))]
    at_random = []
    for seed in range(len(gains)):
        _, start = env.reset(seed=seed)
        at_random.append(play(env, 20, seed)[-1][-1]["best_r_all"] - start["r_all"])
    assert np.mean(gains) > 2.0 * np.mean(at_random)


@pytest.mark.slow
def test_alphazero_search__leads_to_what_it_says_and_is_worth_it() -> None:
    simulator = Simulator(load_silhouette(EXAMPLES / "mug.png"), resolution=64, max_steps=10)
    best, actions = search(simulator, 200)
    state = simulator.initial()
    begun = state.score.total
    for action in actions:
        state = simulator.transition(state, action)
    assert state.score == best.score and best.score.total > begun + 5.0


def test_alphazero_search__fits_on_a_page() -> None:
    assert len((EXAMPLES / "alphazero_search.py").read_text(encoding="utf-8").splitlines()) <= 100
