"""Drawings in thin lines, many corners, and what is to be kept whatever it costs."""

import numpy as np
import pytest
import shapely

from agents.budget import Budget
from agents.commands.losses import in_words, losses_of
from agents.registry import make_agent
from autopoly_env.details import Losses
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import painted


def diamond(size: int) -> Silhouette:
    """The outline of a square on its tip, one pixel wide."""
    rows, columns = np.indices((size, size))
    middle = size // 2
    return Silhouette(abs(rows - middle) + abs(columns - middle) == middle - 4)


def comb(n_teeth: int) -> Silhouette:
    """A bar with teeth 5 pixels wide, 5 apart."""
    mask = np.zeros((256, 256), np.bool_)
    mask[180:220, 8 : 8 + 10 * n_teeth - 5] = True
    for k in range(n_teeth):
        mask[60:180, 8 + 10 * k : 13 + 10 * k] = True
    return Silhouette(mask)


@pytest.mark.parametrize("size", [32, 64, 128])
def test_trace__of_a_slanting_line_one_pixel_wide_is_a_ring(size: int) -> None:
    solution = make_agent("trace").solve(Simulator(diamond(size)))
    assert solution.score.iou >= 0.95 and solution.mesh.topology.n_holes == 1


@pytest.mark.slow
def test_trace__gives_a_contour_as_many_corners_as_it_is_worth() -> None:
    game = Simulator(comb(24), weights=ScoreWeights(w_sc=0.02), max_steps=1000)
    solution = make_agent("trace").solve(game)
    assert solution.score.iou == 1.0 and len(solution.mesh.vertices) == 4 * 24
    assert all(map(is_sane, solution.sequence.meshes()))


def plate_with_holes() -> Silhouette:
    """A plate with three holes that are not worth their price."""
    holes = shapely.union_all([shapely.box(x, 0.45, x + 0.05, 0.5) for x in (0.25, 0.5, 0.7)])
    return painted(shapely.box(0.125, 0.125, 0.875, 0.875) - holes, 128)


def test_losses__are_told_with_the_price_that_keeps_them() -> None:
    game = Simulator(plate_with_holes())
    solution = make_agent("trace").solve(game)
    words = in_words(losses_of(solution, game), game)
    assert words.startswith("the picture has 3 holes, the mesh none: --w-sc 0.")
    price = float(words.split("--w-sc ")[1].split()[0])
    kept = make_agent("trace").solve(Simulator(plate_with_holes(), weights=ScoreWeights(w_sc=0.5 * price)))
    assert kept.mesh.topology.n_holes == 3
    assert in_words(losses_of(kept, game), game) == ""


def test_losses__in_quads_are_told_with_the_wish_that_keeps_them_or_the_other_style() -> None:
    game = Simulator(plate_with_holes(), operators="modeller", faces="quads")
    plate = PolyMesh.rectangle(0.125, 0.125, 0.875, 0.875)
    words = in_words(Losses.of(plate, game.silhouette), game)
    assert words == "the picture has 3 holes, the mesh none: --keep holes keeps them"
    wished = Simulator(plate_with_holes(), operators="modeller", faces="quads", keep="holes")
    assert in_words(Losses.of(plate, game.silhouette), wished).startswith(
        "the picture has 3 holes, the mesh none: --style paper --w-sc 0."
    )


def test_losses__in_one_piece_are_told_by_the_iou() -> None:
    rows, columns = np.indices((128, 128)) - 64
    turns = np.hypot(rows, columns) / 6 - np.arctan2(rows, columns) / (2 * np.pi)
    game = Simulator(Silhouette((turns % 1 < 0.5) & (turns < 9)))
    octagon = PolyMesh.from_faces(
        0.5 + 0.4 * np.array([(np.cos(a), np.sin(a)) for a in np.arange(8) * np.pi / 4]), [tuple(range(8))]
    )
    losses, iou = Losses.of(octagon, game.silhouette), game.final_score(octagon).iou
    assert iou < 0.6 and in_words(losses, game, 0.75) == ""
    assert in_words(losses, game, iou).startswith(f"most details are lost (IoU {iou:.2f}): --w-sc 0.")


@pytest.mark.slow
def test_losses__in_quads_are_kept_by_the_wish_that_is_told() -> None:
    game = Simulator(plate_with_holes(), operators="modeller", faces="quads", keep="holes")
    assert make_agent("quads").solve(game, Budget(200)).mesh.topology.n_holes == 3


@pytest.mark.parametrize("agent", ["trace", "decimate"])
def test_keep__has_holes_whatever_they_cost(agent: str) -> None:
    game = Simulator(plate_with_holes(), weights=ScoreWeights(w_sc=1.0), keep="holes")
    solution = make_agent(agent).solve(game)
    assert solution.mesh.topology.n_holes == 3
    assert game.off(solution.mesh) == 0.0 and game.settings()["keep"] == "holes"
    assert solution.score == game.final_score(solution.mesh)  # the wish is no part of the score


def test_keep__is_refused_where_it_is_nothing_known() -> None:
    with pytest.raises(ConfigError, match="keep 'eyes': expected one of holes, parts, all"):
        Simulator(plate_with_holes(), keep="eyes")
