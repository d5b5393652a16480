"""The frame: which colour stands where, what counts as changed, captions."""

import numpy as np
import pytest

from autopoly_env import viewer
from autopoly_env.errors import ConfigError, MeshError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS
from autopoly_env.silhouette import Silhouette
from autopoly_env.viewer import Highlight, changed, draw_mesh

LEFT_HALF = PolyMesh.rectangle(0.0, 0.0, 0.5, 1.0)


def upper_half() -> Silhouette:
    mask = np.zeros((8, 8), np.bool_)
    mask[:4] = True
    return Silhouette(mask)


def colour_at(frame: np.ndarray, x: float, y: float) -> tuple[int, ...]:
    """The pixel at a point of the unit square."""
    size = frame.shape[1]
    column, row = (int(size * (viewer.MARGIN + (1 - 2 * viewer.MARGIN) * value)) for value in (x, y))
    return tuple(frame[row, column].tolist())


def test_frame__tells_match_bare_excess_and_paper_apart() -> None:
    frame = draw_mesh(LEFT_HALF, upper_half(), size=200)
    assert (frame.shape, frame.dtype) == ((200, 200, 3), np.uint8)
    assert colour_at(frame, 0.25, 0.25) == viewer.MATCH
    assert colour_at(frame, 0.75, 0.25) == viewer.BARE
    assert colour_at(frame, 0.25, 0.75) == viewer.EXCESS
    assert colour_at(frame, 0.75, 0.75) == viewer.PAPER
    assert (frame[:6] == viewer.PAPER).all(), "the margin is empty"


def test_frame_without_target__is_blue_where_the_mesh_is() -> None:
    frame = draw_mesh(LEFT_HALF)
    assert colour_at(frame, 0.25, 0.75) == viewer.MATCH
    assert colour_at(frame, 0.75, 0.25) == viewer.PAPER


def test_frame__shows_a_hole_as_paper_and_not_covered() -> None:
    grid = PolyMesh.grid(3, 0.0, 0.0, 1.0, 1.0)
    frame = draw_mesh(OPERATORS["face_delete"].apply(grid, 4))
    assert colour_at(frame, 0.5, 0.5) == viewer.PAPER
    assert colour_at(frame, 0.5, 0.2) == viewer.MATCH


@pytest.mark.parametrize("size", [100, 256, 512])
def test_edges_and_vertices__are_dark_and_the_highlighted_ones_green(size: int) -> None:
    highlight = Highlight(vertices=(1,), edges=((2, 3),))
    frame = draw_mesh(PolyMesh.rectangle(0.2, 0.2, 0.8, 0.8), size=size, highlight=highlight)
    assert colour_at(frame, 0.2, 0.2) == viewer.INK
    assert colour_at(frame, 0.8, 0.2) == viewer.CHANGED
    assert np.mean(colour_at(frame, 0.5, 0.2)) < np.mean(viewer.MATCH) - 50, "a dark edge"
    red, green, blue = colour_at(frame, 0.5, 0.8)
    assert green > red + 50 and green > blue + 20, "a green edge"


def test_highlighted_face__is_green_on_and_off_the_target() -> None:
    frame = draw_mesh(LEFT_HALF, upper_half(), highlight=Highlight(faces=(0,)))
    assert colour_at(frame, 0.25, 0.25) == viewer.CHANGED_MATCH
    assert colour_at(frame, 0.25, 0.75) == viewer.CHANGED_EXCESS
    assert colour_at(frame, 0.75, 0.25) == viewer.BARE


def test_target__is_drawn_at_the_place_of_its_pixels() -> None:
    mask = np.zeros((4, 4), np.bool_)
    mask[3, 0] = True
    frame = draw_mesh(PolyMesh.rectangle(0.8, 0.1, 0.9, 0.2), Silhouette(mask), size=200)
    assert colour_at(frame, 0.1, 0.9) == viewer.BARE
    assert colour_at(frame, 0.4, 0.9) == viewer.PAPER
    assert colour_at(frame, 0.1, 0.6) == viewer.PAPER


def test_target__of_few_pixels_has_their_corners_and_a_large_one_is_smooth() -> None:
    mask = np.zeros((2, 2), np.bool_)
    mask[0, 0] = True
    mesh = PolyMesh.rectangle(0.8, 0.8, 0.9, 0.9)
    assert colour_at(draw_mesh(mesh, Silhouette(mask), size=200), 0.48, 0.48) == viewer.BARE
    large = np.zeros((64, 64), np.bool_)
    large[31, 31] = True
    assert colour_at(draw_mesh(mesh, Silhouette(large), size=800), 31.1 / 64, 31.1 / 64) == viewer.PAPER


def test_mesh_that_leaves_the_page__is_cut_off() -> None:
    frame = draw_mesh(PolyMesh.rectangle(-3.0, 0.4, 0.5, 0.6))
    assert tuple(frame[128, 0]) == viewer.MATCH
    assert colour_at(frame, 0.75, 0.5) == viewer.PAPER


def test_caption__adds_the_same_height_whatever_it_says() -> None:
    plain = draw_mesh(LEFT_HALF, size=128)
    short, long = (draw_mesh(LEFT_HALF, size=128, caption=text) for text in ("a", "a very long name " * 5))
    assert len(short) == len(long) == 128 + viewer.caption_height(128, 1)
    np.testing.assert_array_equal(short[:128], plain)
    for frame in (short, long):
        assert (frame[128:] != 255).any(), "there is something written"
        assert (frame[128:, 0] == 255).all() and (frame[-1] == 255).all(), "and it fits"
    assert len(draw_mesh(LEFT_HALF, size=128, caption="a\nb")) == 128 + viewer.caption_height(128, 2)


def test_caption__draws_dashes_that_the_font_lacks_as_plain_ones() -> None:
    np.testing.assert_array_equal(draw_mesh(LEFT_HALF, caption="edge 3–7"), draw_mesh(LEFT_HALF, caption="edge 3-7"))


def test_frame__is_a_new_array_each_time() -> None:
    frame = draw_mesh(LEFT_HALF)
    frame[:] = 0
    assert (draw_mesh(LEFT_HALF)[0] == 255).all()


def test_frame__refuses_a_size_in_which_nothing_can_be_seen() -> None:
    with pytest.raises(ConfigError, match=r"frame of 8 pixels.*at least 16"):
        draw_mesh(LEFT_HALF, size=8)


@pytest.mark.parametrize("highlight", [Highlight(vertices=(9,)), Highlight(edges=((0, 2),)), Highlight(faces=(5,))])
def test_frame__refuses_a_highlight_that_the_mesh_does_not_have(highlight: Highlight) -> None:
    with pytest.raises(MeshError):
        draw_mesh(LEFT_HALF, highlight=highlight)


def test_changed__is_nothing_between_a_mesh_and_itself_moved() -> None:
    assert changed(LEFT_HALF, LEFT_HALF.with_vertices(LEFT_HALF.vertices + 0.1)) == Highlight()


def test_changed__names_the_new_vertex_and_the_two_edges_of_a_subdivision() -> None:
    after = OPERATORS["edge_subdivide"].apply(LEFT_HALF, LEFT_HALF.edge_index(0, 1))
    assert changed(LEFT_HALF, after) == Highlight(vertices=(4,), edges=((0, 4), (1, 4)))


def test_changed__names_the_quad_of_an_extrusion() -> None:
    after = OPERATORS["edge_extrude"].apply(LEFT_HALF, LEFT_HALF.edge_index(1, 2))
    assert changed(LEFT_HALF, after) == Highlight(vertices=(4, 5), edges=((1, 4), (2, 5), (4, 5)), faces=(1,))


def test_changed__names_the_edge_that_a_dissolved_vertex_leaves_by_ids_not_indices() -> None:
    house = PolyMesh.from_faces([(0.2, 0.5), (0.5, 0.1), (0.8, 0.5), (0.8, 0.9), (0.2, 0.9)], [range(5)])
    after = OPERATORS["vertex_dissolve"].apply(house, 1)
    assert after.vertex_ids == (0, 2, 3, 4)
    assert changed(house, after) == Highlight(edges=((0, 2),))
