"""The seconds that a construction takes by hand, added up on paper.

A key takes 0.28, pointing 1.1, a click 0.2, getting ready 1.35. So to select an element takes 1.35 + 1.1 + 0.2 = 2.65,
each further one 1.1 + 0.2 + 0.28 = 1.58; a group of moved vertices takes 1.3 for its first, 1.58 for each further one,
and 0.28 + 1.1 + 0.2 = 1.58 to move it: 2.88 for a vertex alone.
"""

from dataclasses import replace

import pytest
from hypothesis import given

from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, PRESETS, operator_named
from autopoly_env.operators.wording import Gesture, from_a_menu
from autopoly_env.sequence import ConstructionSequence, Lesson
from autopoly_env.sequence.effort import effort, seconds_of
from tests.helpers.constructions import house
from tests.helpers.lessons import subdivided
from tests.helpers.sequences import SCORE
from tests.helpers.strategies import Transition, walks
from tests.helpers.tables import a_step, table

SELECT = 2.65
EXTRUDE = 1.58  # E, and a click where the copy is wanted
MENU = 1.5  # right click, click
MOVE_ONE = 2.88
SLAB = PolyMesh.rectangle(0.2, 0.3, 0.8, 0.4)  # vertices 0 to 3 from the upper left, clockwise


def seconds_of_steps(sequence: ConstructionSequence) -> list[float]:
    meshes = sequence.meshes()
    return [seconds_of(*one) for one in zip(sequence.steps, meshes, meshes[1:], strict=False)]


def extruded(*moved: tuple[int, float, float]) -> float:
    """Seconds to extrude the slab's lower edge; the copies of 2, (0.8, 0.4), and of 3, (0.2, 0.4), are 4 and 5."""
    slab = ConstructionSequence.record({}, SLAB, SCORE, [])
    return effort(slab.with_step(0, insert=a_step("edge_extrude", {"edge": [2, 3]}, *moved)))


def test_effort__of_no_steps_is_none() -> None:
    assert effort(subdivided()) == 0.0


def test_effort__of_a_table_is_that_of_two_cuts_which_are_moved_and_two_legs() -> None:
    cut, leg = SELECT + MENU + MOVE_ONE, SELECT + EXTRUDE
    assert (cut, leg) == (pytest.approx(7.03), pytest.approx(4.23))
    assert seconds_of_steps(table()) == pytest.approx([cut, cut, leg, leg])
    assert effort(table()) == Lesson.of(table()).effort == pytest.approx(22.52)


def test_effort__of_every_operator_by_hand() -> None:
    """Vertex 4 is raised after the cut; after the extrusion vertex 3 moves, and vertex 6 apart from its twin."""
    knife = 0.28 + 6 * 1.3 + 0.28 + 1.3 + 1.58  # K, six clicks, Enter; the face inside, X, Faces
    by_hand = [
        SELECT + MENU + MOVE_ONE,
        SELECT + 1.58 + 0.28,  # two corners, J
        SELECT + EXTRUDE + 2 * MOVE_ONE,
        SELECT + knife,
        SELECT + 2 * 0.28,
        SELECT + 2 * 0.28,
        SELECT + 1.58,  # X, Faces
    ]
    assert seconds_of_steps(house()) == pytest.approx(by_hand)
    assert effort(house()) == pytest.approx(46.07)


def test_effort__of_an_extrusion_that_goes_one_way_is_its_drag_wherever_it_goes() -> None:
    for x, y in ((0.0, 0.4), (0.1, 0.02), (0.0, 1e-6)):
        assert extruded((4, 0.8 + x, 0.4 + y), (5, 0.2 + x, 0.4 + y)) == pytest.approx(SELECT + EXTRUDE)


def test_effort__of_an_extrusion_that_narrows_has_one_vertex_to_move() -> None:
    assert extruded((4, 0.7, 0.6), (5, 0.2, 0.6)) == pytest.approx(SELECT + EXTRUDE + MOVE_ONE)
    assert extruded((4, 0.7, 0.6), (5, 0.3, 0.6)) == pytest.approx(SELECT + EXTRUDE + MOVE_ONE)


def test_effort__drags_that_way_after_which_least_is_left() -> None:
    """4 goes by (0, 0.2), 5 by (-0.1, 0.2), and 3 by (-0.1, 0): dragged with 4, the other two are one group."""
    group_of_two = 1.3 + 1.58 + 1.58
    moved = ((4, 0.8, 0.6), (5, 0.1, 0.6), (3, 0.1, 0.4))
    assert extruded(*moved) == pytest.approx(SELECT + EXTRUDE + group_of_two)


@pytest.mark.parametrize(
    ("ways", "moving"),
    [
        ([(0.0, -0.1)], 2.88),
        ([(0.0, -0.1), (0.0, -0.1)], 1.3 + 1.58 + 1.58),
        ([(0.0, -0.1), (0.0, -0.1049)], 1.3 + 1.58 + 1.58),
        ([(0.0, -0.1), (0.0, -0.1051)], 2 * 2.88),
        ([(0.0, -0.1), (0.1, 0.0), (0.0, -0.1)], 1.3 + 1.58 + 1.58 + 2.88),
        ([(0.0, 0.0049), (-0.0049, 0.0)], 0.0),  # less than half a per cent of the side
        ([(0.0, 0.0051)], 2.88),
    ],
)
def test_effort__moves_vertices_together_that_go_alike(ways: list[tuple[float, float]], moving: float) -> None:
    corners = SLAB.vertices.tolist()
    moved = [(v, x + dx, y + dy) for v, ((x, y), (dx, dy)) in enumerate(zip(corners, ways, strict=False))]
    slab = ConstructionSequence.record({}, SLAB, SCORE, [])
    told = slab.with_step(0, insert=a_step("edge_subdivide", {"edge": [2, 3]}, *moved))
    assert effort(told) == pytest.approx(SELECT + MENU + moving)


def test_effort__of_an_operator_that_says_nothing_is_a_command_of_a_menu(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = replace(operator_named("edge_extrude"), phrases=None)
    monkeypatch.setitem(OPERATORS, "edge_extrude", plain)
    assert plain.told.gesture(table().steps[2]) == from_a_menu(table().steps[2]) == Gesture("BBPBB", 1, drags=False)
    assert extruded() == pytest.approx(SELECT + MENU)  # where the operator itself puts them
    assert extruded((4, 0.8, 0.9)) == pytest.approx(SELECT + MENU + MOVE_ONE)


def test_gesture__is_told_in_letters_of_the_model() -> None:
    with pytest.raises(ConfigError, match=r"strokes 'KPX': expected letters of K, P, B and M"):
        Gesture("KPX")
    with pytest.raises(ConfigError, match="n_selected -1: expected 0 or more"):
        Gesture(n_selected=-1)


def test_gesture__without_a_selection_only_takes_getting_ready(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = operator_named("edge_subdivide")
    said = replace(whole.told, gesture=lambda _: Gesture("KK", 0))
    monkeypatch.setitem(OPERATORS, "edge_subdivide", replace(whole, phrases=said))
    assert effort(subdivided(({}, 0.6))) == pytest.approx(1.35 + 2 * 0.28)


@pytest.mark.slow
@given(walks(1, 25))
def test_effort__is_the_sum_over_the_steps_and_at_least_a_selection_and_a_key_each(walk: list[Transition]) -> None:
    taken = [(one.action, one.choice, one.after, SCORE) for one in walk]
    sequence = ConstructionSequence.record({}, walk[0].before, SCORE, taken)
    n = len(walk) // 2
    steps = seconds_of_steps(sequence)
    assert all(seconds > SELECT + 0.28 for seconds in steps)
    assert effort(sequence.trim(n)) == pytest.approx(sum(steps[:n]))
    assert effort(ConstructionSequence.from_json(sequence.to_json())) == effort(sequence)


def test_every_operator_of_ours_says_what_it_costs_the_hand() -> None:
    ours = {operator for operators in PRESETS.values() for operator in operators}
    silent = [operator.name for operator in ours if operator.told.gesture is from_a_menu]
    assert silent == []
