"""What a hand changes, as a construction that replays."""

import pytest

from agents.options import validated
from agents.studio import edits
from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.score import Score, ScoreWeights, score
from autopoly_env.sequence import ConstructionSequence
from tests.helpers.constructions import house
from tests.helpers.drawings import HOUSE, painted

TARGET = painted(HOUSE).target(64)


def scored(mesh: PolyMesh) -> Score:
    return score(mesh, TARGET, ScoreWeights())


def done(sequence: ConstructionSequence, operator: str, element: object, choice: object = None) -> ConstructionSequence:
    """As the server does what a page asks for."""
    asked = validated(edits.Asked, {"operator": operator, "element": element, "choice": choice})
    return edits.done(sequence, asked, scored)


def again(sequence: ConstructionSequence) -> PolyMesh:
    """The last mesh, read from the text of the sequence and replayed."""
    return ConstructionSequence.from_json(sequence.to_json()).final()


@pytest.mark.parametrize("n_steps", [0, 3])
def test_pulled_vertex__is_a_move_of_the_last_step_and_replays(n_steps: int) -> None:
    sequence = edits.pulled(house(n_steps), {2: (0.8, 0.9)}, scored)
    mesh = again(sequence)
    assert len(sequence.steps) == n_steps
    assert mesh.vertices[mesh.vertex_index(2)].tolist() == [0.8, 0.9]
    others = [v for v in mesh.vertex_ids if v != 2]
    before = house(n_steps).final()
    assert all((mesh.vertices[mesh.vertex_index(v)] == before.vertices[before.vertex_index(v)]).all() for v in others)
    told = sequence.steps[-1].score if n_steps else sequence.start_score
    assert told == scored(mesh).as_dict()


def test_pulling_twice__moves_to_the_last_place() -> None:
    once = edits.pulled(house(1), {2: (0.8, 0.9)}, scored)
    twice = edits.pulled(once, {2: (0.7, 0.8), 3: (0.3, 0.8)}, scored)
    mesh = again(twice)
    assert mesh.vertices[[mesh.vertex_index(2), mesh.vertex_index(3)]].tolist() == [[0.7, 0.8], [0.3, 0.8]]


@pytest.mark.parametrize(
    ("place", "said"),
    [((0.0, 0.0), "cross|flipped"), ((1.2, 0.5), "leave the picture"), ((float("nan"), 0.5), "leave the picture")],
)
def test_pulling__to_where_a_vertex_cannot_lie_is_refused(place: tuple[float, float], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        edits.pulled(house(0), {2: place}, scored)


def test_face_split__is_a_step_between_the_corners_that_were_chosen() -> None:
    sequence = done(house(1), "face_split", {"face": 0, "vertex": 4}, {"to": 2})
    mesh = again(sequence)
    assert len(sequence.steps) == 2 and len(mesh.faces) == 2
    assert mesh.edge_index(mesh.vertex_index(4), mesh.vertex_index(2)) >= 0


@pytest.mark.parametrize(
    ("operator", "element", "change"),
    [
        ("face_delete", {"face": 0}, (-1, -2, -1)),
        ("edge_subdivide", {"edge": [0, 1]}, None),
        ("edge_extrude", {"edge": [2, 3]}, (2, 3, 1)),
        ("edge_dissolve", {"edge": [4, 2]}, (0, -1, -1)),
    ],
)
def test_operators__are_steps_of_their_own(
    operator: str, element: dict[str, object], change: tuple[int, int, int] | None
) -> None:
    before = house(3)
    element = {"edge": [0, 4]} if operator == "edge_subdivide" else element
    sequence = done(before, operator, element)
    assert sequence.steps[:-1] == before.steps and sequence.steps[-1].operator == operator
    counts = [now - then for now, then in zip(again(sequence).counts, before.final().counts, strict=True)]
    if change is not None and operator != "face_delete":
        assert tuple(counts) == change
    assert counts[2] == {"face_delete": -1, "edge_extrude": 1, "edge_dissolve": -1}.get(operator, 0)


@pytest.mark.parametrize(
    ("operator", "element", "choice"),
    [
        ("face_hole", {"face": 0, "sides": 3}, None),
        ("os.system", {"face": 0}, None),
        ("face_delete", {"face": 99}, None),
        ("face_delete", {"edge": [0, 1]}, None),
        ("face_split", {"face": 0, "vertex": 0}, {"to": 4}),
        ("face_split", {"face": 0, "vertex": 0}, {"to": [2]}),
        ("face_split", {"face": 0, "vertex": 0}, None),
        ("vertex_dissolve", {"vertex": [0]}, None),
        ("vertex_dissolve", {"vertex": {}}, None),
        ("vertex_dissolve", {"vertex": 2**70}, None),
        ("edge_subdivide", {"edge": [0, "1"]}, None),
        ("edge_subdivide", {"edge": [0, 1], "more": 2}, None),
    ],
)
def test_odd_edits__are_refused_in_one_line(operator: str, element: dict[str, object], choice: object) -> None:
    with pytest.raises(AutoPolyError) as refusal:
        done(house(1), operator, element, choice)
    assert "\n" not in str(refusal.value)


def test_the_last_face__stays() -> None:
    with pytest.raises(AutoPolyError, match="only face"):
        done(house(0), "face_delete", {"face": 0})


def test_edit_that_breaks_the_rule_of_faces__leaves_a_construction_without_it() -> None:
    ruled = house(0).under("quads")
    cut = done(ruled, "edge_subdivide", {"edge": [0, 1]})
    assert cut.faces == "any"
    assert edits.pulled(ruled, {2: (0.8, 0.8)}, scored).faces == "quads"
    assert again(cut).counts == (5, 5, 1)


def test_pull_under_symmetry__takes_the_mirror_image_along() -> None:
    mesh = house(0).final()
    assert edits.with_images(mesh, {0: (0.2, 0.3)}, 0.5) == {0: (0.2, 0.3), 1: (0.8, 0.3)}
    assert edits.with_images(mesh, {0: (0.2, 0.3)}, None) == {0: (0.2, 0.3)}
    assert edits.with_images(mesh, {0: (0.2, 0.3)}, 0.4) == {0: (0.2, 0.3)}  # it is not symmetric about that
