"""Where the operators of the preset `modeller` begin: at what rendering and target disagree about."""

import numpy as np
import pytest
import shapely

from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action, Start
from autopoly_env.placement import Disagreement, tried
from tests.helpers.drawings import SQUARE, painted

RECTANGLE = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)  # SQUARE
PIXEL = 1 / 64
RIGHT, BOTTOM = RECTANGLE.edge_index(1, 2), RECTANGLE.edge_index(2, 3)
BUMP = shapely.box(48 * PIXEL, 26 * PIXEL, 56 * PIXEL, 38 * PIXEL)  # on the right edge
NOTCH = shapely.box(24 * PIXEL, 40 * PIXEL, 28 * PIXEL, 48 * PIXEL)  # in the bottom edge
WINDOW = shapely.box(24 * PIXEL, 24 * PIXEL, 40 * PIXEL, 40 * PIXEL)
BENT = OPERATORS["face_delete"].apply(PolyMesh.grid(2, 0.25, 0.25, 0.75, 0.75), 3)  # the lower right is missing


def starts(mesh: PolyMesh, target: shapely.Geometry, operator: str, element: int) -> list[Start]:
    return tried(Disagreement(mesh, painted(target)), Action(operator, element)).starts


def test_cap__begins_with_its_tip_at_the_far_end_of_the_bump() -> None:
    (_, pulled, _), (_, plain, _) = starts(RECTANGLE, SQUARE | BUMP, "edge_cap", RIGHT)
    x, y = pulled.vertices[-1]
    assert x == pytest.approx(55.5 * PIXEL) and 26 * PIXEL < y < 38 * PIXEL
    assert plain == OPERATORS["edge_cap"].apply(RECTANGLE, RIGHT)
    assert starts(RECTANGLE, SQUARE | BUMP, "edge_cap", BOTTOM) == [
        Start(None, OPERATORS["edge_cap"].apply(RECTANGLE, BOTTOM))
    ]


def test_loop_cut__begins_through_the_notch() -> None:
    (slide, pulled, _), (_, plain, _) = starts(RECTANGLE, SQUARE - NOTCH, "loop_cut", BOTTOM)
    assert isinstance(slide, float)
    x, y = pulled.vertices[-2:][np.argmax(pulled.vertices[-2:, 1])]  # the lower end of the loop
    assert y == pytest.approx(40.5 * PIXEL) and 24 * PIXEL < x < 28 * PIXEL
    assert pulled.vertices[-2:, 0] == pytest.approx([x, x])  # it runs straight up
    assert plain == OPERATORS["loop_cut"].apply(RECTANGLE, BOTTOM, 0.5)


def test_inset__begins_around_what_is_to_be_a_hole() -> None:
    (_, placed, _), (_, plain, _) = starts(RECTANGLE, SQUARE - WINDOW, "face_inset", 0)
    middle = shapely.Polygon(placed.vertices[list(placed.faces[0])])
    assert middle.area == pytest.approx(WINDOW.area) and middle.centroid.equals_exact(WINDOW.centroid, 1e-6)
    assert plain == OPERATORS["face_inset"].apply(RECTANGLE, 0)


@pytest.mark.parametrize(("operator", "element"), [("edge_fill", BENT.edge_index(4, 5)), ("vertex_merge", 5)])
def test_fill_and_merge__begin_at_every_partner_and_end_with_their_own(operator: str, element: int) -> None:
    found = starts(BENT, SQUARE, operator, element)
    own = OPERATORS[operator].choose(BENT, element)
    assert found[-1] == Start(own, OPERATORS[operator].apply(BENT, element, own))
    assert len({start.choice for start in found}) == len(found)
    assert all(start.mesh == OPERATORS[operator].apply(BENT, element, start.choice) for start in found)
    promise = OPERATORS[operator].promise_of(Disagreement(BENT, painted(SQUARE)), element)
    assert 0.0 < promise <= 0.0625  # no more than the quarter that is missing
