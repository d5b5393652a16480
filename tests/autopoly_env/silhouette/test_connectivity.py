"""What hangs together in a picture: lines a pixel wide do, wide parts that meet in a corner do not."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from skimage.measure import label

from autopoly_env.arrays import FloatArray
from autopoly_env.silhouette import label_holes, label_parts, torn_corners


def picture(rows: str) -> FloatArray:
    return np.array([[c == "#" for c in row] for row in rows.split()], np.float64)


def counts(coverage: FloatArray) -> tuple[int, int]:
    """(parts, holes)."""
    return int(label_parts(coverage).max()), int(label_holes(coverage).max())


def test_parts__of_a_line_one_pixel_wide_hang_together() -> None:
    assert counts(picture(".....  .#...  ..#..  ...#.  .....")) == (1, 0)
    assert counts(picture(".....  ..#..  .#.#.  ..#..  .....")) == (1, 1)  # the smallest diamond, and its hole


def test_parts__that_are_wide_and_meet_in_a_corner_are_two() -> None:
    assert counts(picture("##..  ##..  ..##  ..##")) == (2, 0)
    assert torn_corners(picture("##..  ##..  ..##  ..##")).tolist() == [[False] * 3, [False, True, False], [False] * 3]


def test_parts__of_a_wide_one_and_a_line_that_meet_in_a_corner_are_one() -> None:
    assert counts(picture("##...  ##...  ..#..  ...#.  .....")) == (1, 0)


def test_holes__that_meet_in_a_corner_are_two() -> None:
    assert counts(picture("######  #..###  #..###  ###..#  ###..#  ######")) == (1, 2)


def test_holes__do_not_reach_the_border() -> None:
    assert counts(picture("####  #..#  #..#  ####")) == (1, 1)
    assert counts(picture("####  #..#  #...  ####")) == (1, 0)


@given(st.integers(0, 2**32 - 1))
def test_parts__are_no_fewer_than_with_8_neighbours_and_no_more_than_with_4(seed: int) -> None:
    coverage = (np.random.default_rng(seed).random((9, 9)) < 0.5).astype(np.float64)
    n_parts, n_holes = counts(coverage)
    most, least = label(coverage > 0.5, connectivity=1).max(), label(coverage > 0.5, connectivity=2).max()
    assert least <= n_parts <= most
    assert euler_number(coverage) == n_parts - n_holes


def euler_number(coverage: FloatArray) -> int:
    """V - E + F of the pixels as squares, corners that are torn counted twice."""
    padded = np.pad(coverage > 0.5, 1)
    n_faces = int(padded.sum())
    n_edges = int((padded[1:] | padded[:-1]).sum() + (padded[:, 1:] | padded[:, :-1]).sum())
    corners = padded[1:, 1:] | padded[1:, :-1] | padded[:-1, 1:] | padded[:-1, :-1]
    return int(corners.sum()) + int(torn_corners(np.pad(coverage, 1)).sum()) - n_edges + n_faces
