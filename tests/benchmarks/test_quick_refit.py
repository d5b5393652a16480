"""The benchmark of quick refits: shares and errors with known answers, and a short run."""

import numpy as np
import pytest

from autopoly_env.mesh import PolyMesh
from autopoly_env.refit import QUICK, THOROUGH, quick_resolution, refit
from autopoly_env.simulator import Simulator
from benchmarks import quick_refit
from benchmarks.quick_refit import Case, refitting, share_of
from tests.helpers.drawings import BOTTLE, painted

SQUARE = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)


def case() -> Case:
    return Case(0, Simulator(painted(BOTTLE), resolution=64), SQUARE, 0.5)


def test_share__is_of_the_sums_and_its_interval_of_targets() -> None:
    gains, whole, owners = np.array([1.0, 2.0, 0.0]), np.array([2.0, 2.0, 2.0]), np.array([0, 0, 1])
    share, low, high = share_of(gains, whole, owners)
    assert share == 0.5
    assert (low, high) == (0.0, 0.75)  # of one target alone, twice


def test_errors__are_told_apart_across_and_along_the_outline() -> None:
    """At a corner of a square the outline runs along the one diagonal, and across is the other."""
    moved = SQUARE.vertices.copy()
    moved[0] += (0.5, 0.5) / np.array(64.0)  # lower left, inwards
    across, along = quick_refit.apart(case(), SQUARE.with_vertices(moved), SQUARE)[0]
    assert abs(across) == pytest.approx(0.5 * 2**0.5) and along == pytest.approx(0.0, abs=1e-12)


def test_refits__are_those_of_the_public_function() -> None:
    one = case()
    for config, resolution in ((THOROUGH, 64), (QUICK, quick_resolution(64))):
        meshes, seconds = refitting(config, resolution / 64)([one])
        expected = refit(SQUARE, one.simulator.refit_target(0.5, resolution), config).mesh
        np.testing.assert_array_equal(meshes[0].vertices, expected.vertices)
        assert seconds > 0.0


@pytest.mark.slow
def test_command__shows_both_tables(capsys: pytest.CaptureFixture[str]) -> None:
    assert quick_refit.main(["--made-each", "1"]) == 0
    printed = capsys.readouterr().out
    assert "test split" in printed and "across / along" in printed and "quick refit" in printed
