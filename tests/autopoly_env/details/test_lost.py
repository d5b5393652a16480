"""What a mesh has of a picture's parts, holes and small details."""

import numpy as np
import shapely

from autopoly_env.details import Details, Losses
from autopoly_env.mesh import PolyMesh
from autopoly_env.silhouette import Silhouette
from tests.helpers.drawings import painted

SIZE = 64
TWO_HOLES = shapely.box(0.1, 0.1, 0.9, 0.9) - shapely.box(0.2, 0.2, 0.4, 0.4) - shapely.box(0.6, 0.6, 0.8, 0.8)


def boxes(*sides: tuple[float, float, float, float]) -> PolyMesh:
    """Quads of their own."""
    points = [corner for x0, y0, x1, y1 in sides for corner in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    return PolyMesh.from_faces(np.array(points), [tuple(range(4 * k, 4 * k + 4)) for k in range(len(sides))])


def framed(x0: float, y0: float, x1: float, y1: float) -> PolyMesh:
    """The box 0.1 to 0.9 with a hole, as two faces."""
    outer = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)]
    hole = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return PolyMesh.from_faces(np.array(outer + hole), [(0, 1, 2, 6, 5, 4), (2, 3, 0, 4, 7, 6)])


def test_details__have_points_in_every_part_and_hole() -> None:
    silhouette = painted(shapely.union_all([TWO_HOLES, shapely.box(0.27, 0.27, 0.33, 0.33)]), SIZE)
    details = Details.of(silhouette)
    assert (len(details.parts), len(details.holes)) == (2, 2)
    for points, value in ((details.parts, True), (details.holes, False)):
        columns, rows = np.floor(points.reshape(-1, 2) * SIZE).astype(int).T
        assert (silhouette.mask[rows, columns] == value).all()
    assert Details.of(silhouette) is details


def test_kept__counts_parts_and_holes_that_the_mesh_has_for_its_own() -> None:
    details = Details.of(painted(TWO_HOLES, SIZE))
    assert details.kept(boxes((0.1, 0.1, 0.9, 0.9))) == (1, 0)
    assert details.kept(framed(0.2, 0.2, 0.4, 0.4)) == (1, 1)
    assert details.kept(framed(0.15, 0.15, 0.85, 0.85)) == (1, 1)  # one hole about both is one


def test_kept__does_not_count_parts_that_are_one_in_the_mesh() -> None:
    details = Details.of(painted(shapely.box(0.1, 0.1, 0.3, 0.9) | shapely.box(0.6, 0.1, 0.9, 0.9), SIZE))
    assert details.kept(boxes((0.1, 0.1, 0.9, 0.9))) == (1, 0)
    assert details.kept(boxes((0.1, 0.1, 0.3, 0.9), (0.6, 0.1, 0.9, 0.9))) == (2, 0)
    assert details.kept(boxes((0.1, 0.1, 0.3, 0.9))) == (1, 0)


def test_losses__count_places_that_differ_by_more_than_a_seam() -> None:
    back = shapely.box(0.125, 0.5, 0.875, 0.875)
    teeth = [shapely.box(x, 0.25, x + 0.0625, 0.5) for x in (0.125, 0.25, 0.375, 0.5, 0.625, 0.75)]
    comb = painted(shapely.union_all([back, *teeth]), 256)
    assert Losses.of(boxes((0.125, 0.5, 0.875, 0.875)), comb) == Losses(1, 0, 1, 0, 6)
    assert Losses.of(boxes((0.12, 0.5, 0.88, 0.875)), painted(back, 256)) == Losses(1, 0, 1, 0, 0)


def test_kept__is_a_part_whose_outline_is_coarse_where_the_part_is_widest() -> None:
    heart = shapely.Polygon([(0.1, 0.3), (0.3, 0.1), (0.45, 0.29), (0.55, 0.29), (0.7, 0.1), (0.9, 0.3), (0.5, 0.9)])
    points = np.array([(0.1, 0.3), (0.3, 0.1), (0.5, 0.36), (0.7, 0.1), (0.9, 0.3), (0.5, 0.9)])
    notched = PolyMesh.from_faces(points, [(0, 1, 2, 5), (2, 3, 4, 5)])  # deeper than the widest row is high
    assert Details.of(painted(heart, SIZE)).kept(notched) == (1, 0)


def test_parts__that_a_line_joins_which_is_thin_in_a_large_picture_are_one() -> None:
    mask = np.zeros((1024, 1024), np.bool_)
    mask[500:524, 100:300] = mask[500:524, 600:900] = True
    assert len(Details.of(Silhouette(mask)).parts) == 2
    mask[511:512, 300:600] = True
    assert len(Details.of(Silhouette(mask)).parts) == 1


def test_losses__count_no_slivers_that_a_coarse_outline_leaves_of_a_curve() -> None:
    disc = shapely.Point(0.5, 0.5).buffer(0.35)
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    octagon = PolyMesh.from_faces(0.5 + 0.36 * np.stack((np.cos(angles), np.sin(angles)), axis=1), [tuple(range(8))])
    assert Losses.of(octagon, painted(disc, 256)) == Losses(1, 0, 1, 0, 0)


def test_losses__count_no_single_pixels_of_a_picture_of_many() -> None:
    notched = painted(shapely.box(0.25, 0.25, 0.75, 0.75), SIZE).mask.copy()
    notched[16, 17:48:2] = False
    assert Losses.of(boxes((0.25, 0.25, 0.75, 0.75)), Silhouette(notched)) == Losses(1, 0, 1, 0, 0)
