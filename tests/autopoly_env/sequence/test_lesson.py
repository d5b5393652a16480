"""A construction judged as a lesson, and the weight that lets steps leave old vertices alone."""

from dataclasses import replace

import pytest
from hypothesis import assume, given
from shapely import Polygon

from autopoly_env.conformance import check_simulator
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS
from autopoly_env.score import ScoreWeights
from autopoly_env.sequence import Lesson
from autopoly_env.sequence.follower import mirror_image
from autopoly_env.sequence.lesson import moves, n_concave, share_moved
from autopoly_env.simulator import Simulator
from tests.helpers.constructions import house
from tests.helpers.drawings import BOTTLE, FRAME, HOUSE, painted
from tests.helpers.lessons import SQUARE, subdivided
from tests.helpers.sequences import gabled
from tests.helpers.strategies import meshes


def test_lesson__of_no_steps_is_its_start() -> None:
    assert Lesson.of(subdivided()) == Lesson(
        valid=1.0, blocking_in=0.5, moved=0.0, n_actions=0, quads=1.0, ngons=0, concave=0, effort=0.0, returns=0
    )


def test_lesson__blocking_in_is_the_area_below_the_ious() -> None:
    assert Lesson.of(subdivided(({}, 0.9))).blocking_in == pytest.approx(0.7)
    assert Lesson.of(subdivided(({}, 0.8), ({}, 1.0))).blocking_in == pytest.approx((0.65 + 0.9) / 2)


def test_lesson__is_better_where_the_big_shape_comes_first() -> None:
    early, late = subdivided(({}, 0.9), ({}, 1.0)), subdivided(({}, 0.6), ({}, 1.0))
    assert Lesson.of(early).blocking_in > Lesson.of(late).blocking_in


def test_lesson__counts_moves_of_old_vertices_only() -> None:
    elsewhere = subdivided(({4: (0.5, 0.1)}, 0.6))  # the new one, wherever it is put
    assert Lesson.of(elsewhere).moved == 0.0
    one_of_four = subdivided(({2: (0.85, 0.75)}, 0.6))
    assert Lesson.of(one_of_four).moved == 0.25
    then_two_of_five = subdivided(({2: (0.85, 0.75)}, 0.6), ({2: (0.75, 0.75), 4: (0.5, 0.2)}, 0.7))
    assert Lesson.of(then_two_of_five).moved == pytest.approx((1 / 4 + 2 / 5) / 2)


@pytest.mark.parametrize(("distance", "share"), [(0.0, 0.0), (0.0099, 0.0), (0.0101, 1.0), (0.3, 1.0)])
def test_share_moved__begins_at_one_per_cent_of_the_image(distance: float, share: float) -> None:
    assert share_moved(SQUARE, SQUARE.with_vertices(SQUARE.vertices + (distance, 0.0))) == share


def test_moves__are_told_by_id_and_only_of_vertices_in_both() -> None:
    gable = OPERATORS["edge_subdivide"].apply(SQUARE, 0)
    corner = OPERATORS["vertex_dissolve"].apply(gable, 1)
    assert corner.vertex_ids == (0, 2, 3, 4)
    shifted = corner.with_vertices(corner.vertices + [(0.0, 0.0), (0.3, 0.4), (0.0, 0.0), (0.0, 0.1)])
    assert moves(gable, shifted) == pytest.approx([0.0, 0.5, 0.0, 0.1])
    assert moves(SQUARE, shifted) == pytest.approx([0.0, 0.5, 0.0])


def test_lesson__valid_is_the_share_of_meshes_that_neither_cross_nor_flip() -> None:
    crossed = subdivided(({}, 0.6), ({4: (0.5, 0.9)}, 0.7))  # the new vertex through the opposite edge
    assert Lesson.of(crossed).valid == pytest.approx(2 / 3)
    assert Lesson.of(house()).valid == 1.0


def test_lesson__counts_the_faces_of_the_last_mesh_by_their_corners() -> None:
    wall = Lesson.of(gabled())  # quads [0, 4, 2, 3] and [2, 1, 5, 6], triangle [4, 1, 2]
    assert (wall.quads, wall.ngons, wall.concave) == (2 / 3, 0, 0)
    gable = Lesson.of(gabled().trim(1))
    assert (gable.quads, gable.ngons, gable.concave) == (0.0, 1, 0)


@pytest.mark.parametrize(("depth", "concave"), [(0.2, 0), (0.25, 0), (0.25 + 1e-10, 0), (0.25 + 1e-7, 1), (0.4, 1)])
def test_n_concave__counts_faces_with_a_reflex_corner(depth: float, concave: int) -> None:
    """The new vertex of the upper edge, which lies at 0.25, pressed in or raised; cross product: width times way."""
    mesh = subdivided(({4: (0.5, depth)}, 0.6)).final()
    assert n_concave(mesh) == concave
    assert n_concave(mirror_image(mesh)) == concave


def test_n_concave__judges_a_face_that_is_wound_backwards_as_its_mirror_image() -> None:
    backwards = SQUARE.with_vertices(SQUARE.vertices[::-1])
    assert n_concave(backwards) == 0


@pytest.mark.slow
@given(meshes())
def test_n_concave__is_what_shapely_says_of_simple_faces(mesh: PolyMesh) -> None:
    """A simple polygon is convex where it fills its convex hull."""
    shapes = [Polygon(mesh.vertices[list(face)]) for face in mesh.faces]
    assume(all(shape.is_valid for shape in shapes))
    lost = [shape.convex_hull.area - shape.area for shape in shapes]
    rings = [mesh.vertices[list(face)] for face in mesh.faces]
    corners = [ring[[i - 1, i, (i + 1) % len(ring)]] for ring in rings for i in range(len(ring))]
    near = lost + [Polygon(corner).area for corner in corners]
    assume(not any(1e-12 < area < 1e-7 for area in near))  # nearly straight, or too small to tell
    assert n_concave(mesh) == sum(area >= 1e-7 for area in lost)


def test_w_locality__has_to_be_a_weight() -> None:
    with pytest.raises(ConfigError, match="w_locality"):
        ScoreWeights(w_locality=-1.0)


def test_w_locality__is_off_the_total_of_a_step_and_not_off_that_of_a_mesh() -> None:
    game = Simulator(painted(HOUSE), resolution=64, weights=ScoreWeights(w_locality=8.0))
    free = Simulator(painted(HOUSE), resolution=64)
    moved = SQUARE.with_vertices(SQUARE.vertices + [(0.1, 0.0), (0.0, 0.0), (0.0, 0.0), (0.005, 0.0)])
    assert game.docked(SQUARE, moved) == 2.0
    assert game.score(moved) == free.score(moved) == free.score(moved, SQUARE)
    assert game.score(moved, SQUARE) == replace(free.score(moved), total=free.score(moved).total - 2.0)
    assert game.final_score(moved) == free.final_score(moved)


def test_w_locality__makes_a_step_leave_old_vertices_alone() -> None:
    silhouette = painted(BOTTLE, 128)
    free, dear = (Simulator(silhouette, weights=ScoreWeights(w_locality=w)) for w in (0.0, 1e6))
    start = free.initial()
    actions = free.legal_actions(start)[1:]
    freely, held = free.transition_all(start, actions), dear.transition_all(dear.initial(), actions)
    assert max(share_moved(start.mesh, state.mesh) for state in freely) > 0.2
    assert [share_moved(start.mesh, state.mesh) for state in held] == [0.0] * len(held)
    assert max(state.n_refits for state in held) > max(state.n_refits for state in freely)
    assert all(is_sane(state.mesh) for state in held)


@pytest.mark.slow
@pytest.mark.parametrize("symmetry", [None, 0.5])
def test_w_locality__keeps_to_the_rules_of_a_simulator(symmetry: float | None) -> None:
    weights = ScoreWeights(w_locality=3.0)
    check_simulator(Simulator(painted(FRAME), resolution=32, weights=weights, symmetry=symmetry, max_steps=6))
