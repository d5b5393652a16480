"""What hangs together in a mask and how deep it is, by hand and beside SciPy and scikit-image."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from scipy import ndimage
from skimage.measure import label

from autopoly_env.arrays import BoolArray
from autopoly_env.refit import RefitTarget
from autopoly_env.silhouette import WEIGHT_STEPS, Target, areas, distances_within
from autopoly_env.silhouette.connectivity import grown, shrunk

MASKS = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=12))
EIGHT = np.ones((3, 3), np.bool_)


def test_areas__of_a_fork_are_one_and_numbered_by_rows() -> None:
    mask = np.array([[1, 0, 1, 0, 0, 1], [1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 0, 1]], np.bool_)
    labels, count = areas(mask)
    assert count == 4
    assert labels.tolist() == [[1, 0, 1, 0, 0, 2], [1, 1, 1, 0, 0, 0], [0, 0, 0, 3, 0, 4]]
    labels, count = areas(mask, with_corners=True)
    assert count == 3
    assert labels.tolist() == [[1, 0, 1, 0, 0, 2], [1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 0, 3]]


@given(MASKS, st.booleans())
def test_areas__are_those_of_scikit_image(mask: BoolArray, with_corners: bool) -> None:
    labels, count = areas(mask, with_corners=with_corners)
    theirs, their_count = label(mask, connectivity=1 + with_corners, return_num=True)
    assert count == their_count
    assert np.array_equal(labels, theirs)


def test_distances__in_a_corner_are_to_the_nearest_outside() -> None:
    mask = np.ones((4, 4), np.bool_)
    mask[0, 0] = False
    assert distances_within(mask)[3].tolist() == pytest.approx([3.0, 10**0.5, 13**0.5, 18**0.5])
    assert np.isinf(distances_within(np.ones((3, 2), np.bool_))).all()


@given(MASKS)
def test_distances__are_those_of_scipy(mask: BoolArray) -> None:
    if not mask.all():  # where SciPy says nothing of use
        assert np.array_equal(distances_within(mask), ndimage.distance_transform_edt(mask))


@given(MASKS)
def test_growing_and_shrinking__are_those_of_scipy(mask: BoolArray) -> None:
    assert np.array_equal(grown(mask), ndimage.binary_dilation(mask, EIGHT))
    assert np.array_equal(shrunk(mask), ndimage.binary_erosion(mask, EIGHT))


def test_areas__take_masks_that_are_read_only_or_transposed() -> None:
    mask = np.zeros((2, 5), np.bool_)
    mask[:, 1] = mask[:, 3] = True
    mask.setflags(write=False)
    assert areas(mask)[1] == areas(mask.T)[1] == 2


@given(st.integers(1, 24), st.integers(0, 16), st.booleans(), st.integers(0, 2**32 - 1))
def test_sums__are_those_of_numpy_with_the_background_as_heavy_as_asked(
    size: int, sixteenths: int, has_weights: bool, seed: int
) -> None:
    rng, background = np.random.default_rng(seed), sixteenths / 16
    target = Target(rng.random((size, size)), rng.random((size, size)) if has_weights else None)
    weights = target.coverage + background * (1.0 - target.coverage)
    weights = np.rint((weights if target.weights is None else weights * target.weights) * WEIGHT_STEPS) / WEIGHT_STEPS
    wanted = [np.cumsum(values * weights, axis=1) for values in (target.coverage, target.coverage**2, 1.0)]
    found_sums = RefitTarget.of_levels([target] * 4, background).pictures[0][1:]
    for found, sums in zip(found_sums, wanted, strict=True):
        if not found.size:  # no weights: each pixel weighs 1
            assert background == 1.0 and not has_weights
            continue
        assert (found[:, 0] == 0.0).all() and np.array_equal(found[:, 1:], sums)
