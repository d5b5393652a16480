"""Constructions told without detours, and shapes without what they do not need; the answers are known beforehand."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.budget import Meter
from agents.finish import finish
from agents.finish.pare import pare
from agents.finish.tidy import tidy
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.score import Score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator, State
from tests.helpers.drawings import HOUSE, SQUARE, noise, painted
from tests.helpers.sequences import SCORE, gabled, played, walked

QUAD = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
Places = Mapping[int, tuple[float, float]]


def scored(mesh: PolyMesh) -> Score:
    """A score that says which mesh it is of."""
    return Score(float(SCORE["iou"]), mesh.complexity, 0, float(mesh.vertices.sum()))


def told(*steps: tuple[str, dict[str, Any], Places]) -> ConstructionSequence:
    """A construction from the quad: operator, element by ids, and where vertices go after it."""
    mesh, transitions = QUAD, []
    for name, ids, places in steps:
        element = OPERATORS[name].element.index(mesh, ids)
        made = OPERATORS[name].apply(mesh, element)
        vertices = made.vertices.copy()
        for vertex, place in places.items():
            vertices[made.vertex_index(vertex)] = place
        mesh = made.with_vertices(vertices)
        transitions.append((Action(name, element), None, mesh, SCORE))
    return ConstructionSequence.record({}, QUAD, SCORE, transitions)


def words(sequence: ConstructionSequence) -> list[tuple[str, dict[str, Any]]]:
    return [(step.operator, dict(step.element)) for step in sequence.steps]


def outline(mesh: PolyMesh) -> set[frozenset[tuple[tuple[float, ...], ...]]]:
    """Its faces as sets of directed edges between places: the mesh without its ids."""
    faces = [[tuple(mesh.vertices[v].tolist()) for v in face] for face in mesh.faces]
    return {frozenset(zip(face, [*face[1:], face[0]], strict=True)) for face in faces}


SUBDIVIDE, DISSOLVE = "edge_subdivide", "vertex_dissolve"


def test_tidy__leaves_a_straight_construction_alone() -> None:
    assert tidy(gabled(), scored) == gabled()


def test_tidy__keeps_the_parts_of_the_steps_that_stay() -> None:
    cut, undone, lower = (
        (SUBDIVIDE, {"edge": [0, 1]}, {}),
        (DISSOLVE, {"vertex": 4}, {}),
        (SUBDIVIDE, {"edge": [2, 3]}, {}),
    )
    tidied = tidy(
        told(lower, cut, (DISSOLVE, {"vertex": 5}, {}), (SUBDIVIDE, {"edge": [0, 3]}, {})).with_parts("abcd"), scored
    )
    assert [(step.operator, step.part) for step in tidied.steps] == [(SUBDIVIDE, "a"), (SUBDIVIDE, "d")]
    assert tidy(told(cut, undone).with_parts("ab"), scored).parts == ()


def test_tidy__drops_a_vertex_that_comes_and_goes() -> None:
    sequence = told((SUBDIVIDE, {"edge": [0, 1]}, {}), (DISSOLVE, {"vertex": 4}, {}))
    assert tidy(sequence, scored) == sequence.trim(0)


def test_tidy__renames_what_comes_after_a_dropped_vertex() -> None:
    sequence = told(
        (SUBDIVIDE, {"edge": [0, 1]}, {4: (0.5, 0.1)}),
        (SUBDIVIDE, {"edge": [2, 3]}, {5: (0.5, 0.9)}),
        (DISSOLVE, {"vertex": 4}, {}),
        (SUBDIVIDE, {"edge": [3, 5]}, {6: (0.4, 0.95)}),
    )
    shorter = tidy(sequence, scored)
    assert words(shorter) == [(SUBDIVIDE, {"edge": [2, 3]}), (SUBDIVIDE, {"edge": [3, 4]})]
    assert outline(shorter.final()) == outline(sequence.final())
    assert shorter.steps[0].score == scored(shorter.meshes()[1]).as_dict()
    assert shorter.steps[-1].score == sequence.steps[-1].score


def test_tidy__keeps_a_detour_that_the_meshes_on_the_way_need() -> None:
    sequence = told(
        (SUBDIVIDE, {"edge": [0, 1]}, {4: (0.5, 0.1)}),
        (SUBDIVIDE, {"edge": [2, 3]}, {5: (0.5, 0.9)}),
        (DISSOLVE, {"vertex": 4}, {}),
        (SUBDIVIDE, {"edge": [3, 5]}, {6: (0.4, 0.95)}),
    )

    def poor(mesh: PolyMesh) -> Score:
        return replace(scored(mesh), iou=float(SCORE["iou"]) - 0.2)

    assert tidy(sequence, poor) == sequence


def test_tidy__works_on_the_whole_edge_where_its_half_was_split() -> None:
    sequence = told(
        (SUBDIVIDE, {"edge": [0, 1]}, {4: (0.5, 0.2)}),
        (SUBDIVIDE, {"edge": [1, 4]}, {5: (0.6, 0.1)}),
        (DISSOLVE, {"vertex": 4}, {}),
    )
    shorter = tidy(sequence, scored)
    assert words(shorter) == [(SUBDIVIDE, {"edge": [0, 1]})]
    assert outline(shorter.final()) == outline(sequence.final())


def test_tidy__drops_a_split_that_is_joined_again_and_an_extrusion_that_is_deleted() -> None:
    split = told(
        ("face_split", {"face": 0, "vertex": 0}, {}),
        (SUBDIVIDE, {"edge": [0, 1]}, {4: (0.5, 0.1)}),
        ("edge_dissolve", {"edge": [0, 2]}, {}),
    )
    assert words(tidy(split, scored)) == [(SUBDIVIDE, {"edge": [0, 1]})]
    extruded = told(
        ("edge_extrude", {"edge": [0, 1]}, {}),
        (SUBDIVIDE, {"edge": [4, 5]}, {}),
        (SUBDIVIDE, {"edge": [2, 3]}, {7: (0.5, 0.9)}),
        ("face_delete", {"face": 1}, {}),
    )
    assert words(tidy(extruded, scored)) == [(SUBDIVIDE, {"edge": [2, 3]})]


def test_tidy__keeps_an_extrusion_over_whose_quad_a_part_was_reached() -> None:
    sequence = told(
        ("edge_extrude", {"edge": [1, 2]}, {4: (0.8, 0.3), 5: (0.8, 0.7)}),
        ("edge_extrude", {"edge": [4, 5]}, {6: (0.95, 0.3), 7: (0.95, 0.7)}),
        ("face_delete", {"face": 1}, {}),
    )
    assert is_sane(sequence.final()) and tidy(sequence, scored) == sequence


def test_tidy__moves_what_the_dropped_steps_moved() -> None:
    sequence = told(
        (SUBDIVIDE, {"edge": [2, 3]}, {4: (0.5, 0.9)}),
        (SUBDIVIDE, {"edge": [0, 1]}, {2: (0.8, 0.8)}),
        (DISSOLVE, {"vertex": 5}, {3: (0.2, 0.8)}),
    )
    shorter = tidy(sequence, scored)
    assert words(shorter) == [(SUBDIVIDE, {"edge": [2, 3]})]
    assert outline(shorter.final()) == outline(sequence.final())


def test_tidy__keeps_a_detour_round_a_crossing() -> None:
    sequence = told(
        (SUBDIVIDE, {"edge": [0, 1]}, {4: (0.5, 0.05)}),  # the edge makes way ...
        (SUBDIVIDE, {"edge": [2, 3]}, {5: (0.5, 0.15)}),  # ... for what would cross it
        (SUBDIVIDE, {"edge": [2, 5]}, {6: (0.6, 0.4)}),
        (DISSOLVE, {"vertex": 4}, {5: (0.5, 0.6), 6: (0.6, 0.65)}),
    )
    assert all(map(is_sane, sequence.meshes()))
    assert tidy(sequence, scored) == sequence


@pytest.mark.slow
@given(st.integers(0, 10_000), st.booleans())
@settings(max_examples=25)
def test_tidy__never_ends_otherwise_and_never_takes_longer(seed: int, in_the_game: bool) -> None:
    sequence = played(seed, 12) if in_the_game else walked(seed, 14)
    shorter = tidy(sequence, scored)
    assert len(shorter.steps) <= len(sequence.steps)
    assert outline(shorter.final()) == outline(sequence.final())
    assert shorter.final().vertices.tobytes() == sequence.final().vertices.tobytes()
    last = (sequence.steps or shorter.steps)[-1:]
    assert not shorter.steps or shorter.steps[-1].score == last[0].score
    assert ConstructionSequence.from_json(shorter.to_json()) == shorter
    if all(map(is_sane, sequence.meshes())):
        assert all(map(is_sane, shorter.meshes()))


def with_a_bump(simulator: Simulator) -> list[State]:
    """The square, and a vertex more than it needs."""
    start = simulator.initial()
    mesh = OPERATORS[SUBDIVIDE].apply(start.mesh, 0)
    return [start, State(mesh, simulator.score(mesh), 1, "", Action(SUBDIVIDE, 0), None)]


def test_pare__takes_away_what_the_shape_does_not_need() -> None:
    game = Simulator(painted(SQUARE), match_threshold=1.0)
    states = with_a_bump(game)
    pared, n_refits, n_added = pare(game, states)
    assert pared[:2] == states and pared[2].action == Action(DISSOLVE, 4)
    assert n_added == len(pared) - 2 >= 1 and n_refits >= 1
    assert pared[-1].score.total > states[-1].score.total


def test_pare__does_only_what_is_allowed() -> None:
    square = with_a_bump(Simulator(painted(SQUARE)))[1].mesh
    for game in (
        Simulator(painted(SQUARE), operators="paper"),
        Simulator(painted(SQUARE), max_steps=1),
        Simulator(painted(SQUARE), start=square, locked=(0, 1, 2, 3, 4)),
    ):
        start = game.initial()
        mesh = OPERATORS[SUBDIVIDE].apply(start.mesh, 1)
        states = [start, State(mesh, game.score(mesh), 1, "", Action(SUBDIVIDE, 1), None)]
        pared, _, n_added = pare(game, states)
        assert {0, 1, 2, 3}.issubset(pared[-1].mesh.vertex_ids)
        assert all(4 in state.mesh.vertex_ids for state in pared) if game.guidance.locked else n_added == 0


def test_pare__leaves_a_start_alone() -> None:
    game = Simulator(painted(HOUSE))
    assert pare(game, [game.initial()]) == ([game.initial()], 0, 0)


def test_finish__pares_and_tidies_unless_the_steps_are_to_be_kept() -> None:
    game = Simulator(painted(SQUARE))
    states = with_a_bump(game)
    kept = finish(game, states, Meter.unlimited(), keep_steps=True)
    best = finish(game, states, Meter.unlimited())
    assert len(best.sequence.steps) == 0 and best.mesh.counts == (4, 4, 1)
    assert len(kept.sequence.steps) <= 1 and best.score.total >= kept.score.total


@pytest.mark.parametrize("seed", range(3))
def test_finish__is_never_worse_for_paring(seed: int) -> None:
    game = Simulator(noise(seed), resolution=32)
    states = [game.initial()]
    for _ in range(4):
        children = [state for state in game.transition_all(states[-1]) if is_sane(state.mesh)]
        states.append(children[len(children) // 3])
    kept = finish(game, states, Meter.unlimited(), keep_steps=True)
    best = finish(game, states, Meter.unlimited())
    assert best.score.total >= kept.score.total
    assert best.sequence.final() == best.mesh and game.final_score(best.mesh) == best.score
