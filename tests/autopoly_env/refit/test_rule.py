"""A refit under a rule of faces: what it promises for any mesh that keeps it, and what it comes to."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from autopoly_env.mesh import ASKED_TURN, FaceRule, PolyMesh, broken_faces, defects_of, is_sane
from autopoly_env.refit import (
    FROM_AFAR,
    LOCAL,
    THOROUGH,
    Bonds,
    RefitConfig,
    RefitTarget,
    mended,
    refit,
    tune,
)
from autopoly_env.refit.refitting import shape_arguments
from autopoly_env.refit.rule_kernels import hinge
from autopoly_env.refit.shape_kernels import shape_of
from autopoly_env.silhouette import Silhouette
from tests.helpers.drawings import noise, painted
from tests.helpers.ruled import ruled_meshes
from tests.helpers.shapes import polygon

CONFIGS = {"from afar": FROM_AFAR, "thorough": THOROUGH, "local": LOCAL, "free": RefitConfig(keep_defects=True)}
DART = np.array([(0.25, 0.25), (0.5, 0.45), (0.75, 0.25), (0.5, 0.85)])


@pytest.mark.parametrize("config", CONFIGS)
@given(ruled_meshes(), st.integers(0, 2**32 - 1))
@settings(max_examples=12)
def test_refit__keeps_the_rule_and_loses_nothing(config: str, mesh: PolyMesh, seed: int) -> None:
    target = RefitTarget.of(noise(seed), 32)
    result = refit(mesh, target, CONFIGS[config], faces="quads")
    assert not broken_faces(result.mesh, "quads") and result.loss <= result.loss_before
    assert (result.mesh.vertices >= 0.0).all() and (result.mesh.vertices <= 1.0).all()
    if config != "free":
        assert is_sane(result.mesh, "quads")
    again = refit(mesh, target, CONFIGS[config], faces="quads")
    assert (again.mesh.vertices == result.mesh.vertices).all()


@given(ruled_meshes(), st.integers(0, 2**32 - 1))
@settings(max_examples=12)
def test_refit__keeps_the_rule_with_vertices_that_are_locked(mesh: PolyMesh, seed: int) -> None:
    locked = np.random.default_rng(seed).random(len(mesh.vertices)) < 0.4
    bonds = Bonds(locked, np.full(len(locked), -1))
    after = refit(mesh, RefitTarget.of(noise(seed), 32), THOROUGH, bonds, "convex").mesh
    assert is_sane(after, "convex")
    assert (after.vertices[locked] == mesh.vertices[locked]).all()


@given(ruled_meshes(), st.integers(0, 2**32 - 1))
@settings(max_examples=12)
def test_tuning__keeps_the_rule(mesh: PolyMesh, seed: int) -> None:
    assert is_sane(tune(mesh, noise(seed).target(48), faces="quads"), "quads")


def test_refit__fits_a_dart_as_well_as_a_convex_quad_can() -> None:
    """The hull of a dart is the triangle of its other corners; without a rule the dart itself is found."""
    silhouette, start = painted(shapely.Polygon(DART), 128), polygon(DART - [(0, 0), (0, 0.25), (0, 0), (0, 0)])
    target = RefitTarget.of(silhouette, 64)
    free, ruled = (refit(start, target, THOROUGH, faces=rule) for rule in ("any", "quads"))
    assert broken_faces(free.mesh, "convex") == [0] and not broken_faces(ruled.mesh, "convex")
    hull = polygon(np.array([DART[0], (0.5, 0.25 - 0.25 * ASKED_TURN), DART[2], DART[3]]))
    assert free.loss < ruled.loss <= refit(hull, target, LOCAL, faces="quads").loss * 1.001


def test_refit__under_any_is_the_refit_without_a_rule() -> None:
    mesh = PolyMesh.grid(2, 0.2, 0.25, 0.8, 0.8)
    target = RefitTarget.of(noise(3), 64)
    assert (refit(mesh, target).mesh.vertices == refit(mesh, target, faces="any").mesh.vertices).all()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_refit__makes_no_corner_worse_that_breaks_the_rule_already(seed: int) -> None:
    rng = np.random.default_rng(seed)
    star = polygon(0.5 + rng.uniform(0.1, 0.45, (8, 1)) * [(np.cos(a), np.sin(a)) for a in 0.25 * np.pi * np.arange(8)])
    after = refit(star, RefitTarget.of(noise(seed), 32), THOROUGH, faces="convex").mesh
    assert len(broken_faces(after, "convex")) <= len(broken_faces(star, "convex"))
    assert all(np.less_equal(defects_of(after), defects_of(star)))


def test_hinge__has_the_gradient_of_what_it_costs() -> None:
    """Against central differences; the asked turn is 0, so that lengths, which count as fixed, do not matter."""
    grid = PolyMesh.grid(2, 0.2, 0.2, 0.8, 0.8)
    rule = replace_asked(shape_of.py_func(*shape_arguments(grid.topology, "quads", None)).rule)
    order = np.concatenate((grid.topology.boundary_half_edges[:, 0], [4]))
    origin, rng = grid.vertices[order], np.random.default_rng(0)
    points = origin + rng.normal(0.0, 0.15, origin.shape)

    def cost(at: np.ndarray) -> float:
        return float(hinge(rule, origin, at, 16, np.zeros_like(at), np.zeros((18, 18))))

    gradient, normal = np.zeros_like(points), np.zeros((18, 18))
    assert hinge(rule, origin, points, 16, gradient, normal) > 1.0
    step = 1e-3
    off = np.array(
        [(cost(points + step * one) - cost(points - step * one)) / (2 * step) for one in units(points.shape)]
    )
    assert np.corrcoef(off, gradient.ravel())[0, 1] > 0.9  # lengths in the denominator are taken for fixed
    assert (np.triu(normal, 1) == 0.0).all() and (np.diag(normal) >= 0.0).all()


def units(shape: tuple[int, ...]) -> np.ndarray:
    return np.eye(shape[0] * shape[1]).reshape(-1, *shape)


def replace_asked(rule: object) -> object:
    return rule._replace(asked=0.0)  # type: ignore[attr-defined]


@pytest.mark.parametrize("rule", ["convex", "quads"])
def test_mended__bends_a_straight_corner_out_and_leaves_what_keeps_the_rule(rule: FaceRule) -> None:
    square = PolyMesh.rectangle(0.2, 0.2, 0.8, 0.8)
    assert mended(square, rule) is square
    straight = polygon(np.array([(0.2, 0.2), (0.5, 0.2), (0.8, 0.2), (0.5, 0.7)]))
    made = mended(straight, rule)
    assert made is not None and not broken_faces(made, rule)
    assert np.abs(made.vertices - straight.vertices).max() < 0.005
    assert made.vertices[1, 1] < straight.vertices[1, 1]


def test_mended__finds_nothing_where_nothing_can_be_had() -> None:
    pentagon = polygon(np.array([(0.2, 0.2), (0.8, 0.2), (0.8, 0.6), (0.5, 0.8), (0.2, 0.6)]))
    assert mended(pentagon, "quads") is None and mended(pentagon, "convex") is pentagon
    between = PolyMesh.from_faces(  # a vertex in the middle of an inner edge: what is convex here is reflex there
        [(0.2, 0.2), (0.5, 0.2), (0.8, 0.2), (0.8, 0.8), (0.5, 0.8), (0.2, 0.8), (0.5, 0.5)],
        [(0, 1, 6, 4, 5), (1, 2, 3, 4, 6)],
    )
    assert mended(between, "convex") is None


def test_mended__heeds_bonds() -> None:
    straight = polygon(np.array([(0.2, 0.2), (0.5, 0.2), (0.8, 0.2), (0.5, 0.7)]))
    locked = np.array([True, False, True, True])
    made = mended(straight, "convex", Bonds(locked, np.full(4, -1)))
    assert made is not None and (made.vertices[locked] == straight.vertices[locked]).all()
    images = np.array([2, 1, 0, 3])
    made = mended(straight, "convex", Bonds(np.zeros(4, np.bool_), images, 0.5))
    assert made is not None and made.vertices[1, 0] == made.vertices[3, 0] == 0.5
    np.testing.assert_allclose(made.vertices[0] + made.vertices[2], (1.0, 2.0 * made.vertices[0, 1]), atol=1e-15)
    assert mended(straight, "convex", Bonds(np.ones(4, np.bool_), np.full(4, -1))) is None


def test_an_empty_target__is_no_trouble() -> None:
    grid = PolyMesh.grid(2, 0.3, 0.3, 0.7, 0.7)
    blank = Silhouette(np.eye(8, dtype=np.bool_))
    after = refit(grid, RefitTarget.of(blank, 16), replace(THOROUGH, n_far=20), faces="quads").mesh
    assert is_sane(after, "quads")
