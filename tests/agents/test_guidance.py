"""Agents that are guided: a start or a sequence to go on from, all wishes at once, and the command."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image

from agents.budget import Budget, Meter
from agents.finish import finish
from agents.registry import AGENTS, make_agent
from agents.solve import HELP, main
from autopoly_env.errors import ConfigError
from autopoly_env.export import from_obj, to_obj
from autopoly_env.mesh import is_valid
from autopoly_env.operators import Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import BOTTLE, FRAME, HOUSE, L_SHAPE, painted
from tests.helpers.guidance import LEFT, PLAYERS, RULES, START, WHOLE, assert_symmetric, solve
from tests.helpers.paths import DOCS

# --- a mesh or a sequence to go on from


def test_start__is_the_first_state_as_it_is() -> None:
    game = Simulator(painted(HOUSE), resolution=32, start=START)
    state = game.initial()
    assert state.mesh == START and (state.n_refits, state.step) == (0, 0)
    solution = make_agent("greedy").solve(game, Budget(refits=0))
    assert solution.mesh == START and solution.sequence.start == START and not solution.sequence.steps


@pytest.mark.parametrize("name", PLAYERS)
def test_sequence__is_gone_on_from_and_replays_from_its_own_start(name: str) -> None:
    first = solve("greedy", Simulator(painted(L_SHAPE), resolution=32, operators="paper"), refits=20).sequence
    assert first.steps
    game = Simulator(painted(L_SHAPE), resolution=32, start=first)
    solution = solve(name, game)
    whole = ConstructionSequence.from_json(solution.sequence.to_json())
    n = len(first.steps)
    assert whole.start == first.start and whole.meshes()[n] == first.final()
    assert [step.element for step in whole.steps[:n]] == [step.element for step in first.steps]
    assert whole.final() == solution.mesh and whole.settings["earlier_steps"] == n
    totals = [whole.start_score["total"], *(step.score["total"] for step in whole.steps)]
    assert totals == [game.final_score(mesh).total for mesh in whole.meshes()]
    assert solution.score.total >= game.final_score(first.final()).total


def test_symmetry__finds_the_frame_and_both_squares() -> None:
    framed = Simulator(painted(FRAME), resolution=64, symmetry=True)
    holed = max(framed.transition_all(framed.initial()), key=lambda child: child.score.total)
    assert holed.mesh.topology.n_holes == 1 and holed.halfway is None and holed.score.iou > 0.97
    two = painted(FRAME.difference(shapely.box(0.45, 0.0, 0.55, 1.0)) | shapely.box(0.45, 0.2, 0.55, 0.8))
    assert solve("greedy", Simulator(two, resolution=64, symmetry=True), 300).score.iou > 0.9


@pytest.mark.parametrize("name", PLAYERS)
def test_symmetric_solutions__record_both_halves_of_every_step(name: str) -> None:
    solution = solve(name, Simulator(painted(BOTTLE), resolution=32, symmetry=True), refits=100)
    sequence = ConstructionSequence.from_json(solution.sequence.to_json())
    assert sequence.final() == solution.mesh and sequence.settings["symmetry"] == 0.5
    assert all(is_valid(mesh) for mesh in sequence.meshes())
    assert_symmetric(solution.mesh, 0.5)


def test_finish__records_half_way_states() -> None:
    game = Simulator(painted(BOTTLE), resolution=32, symmetry=0.5)
    states = [game.initial()]
    states.append(game.transition(states[0], Action("edge_subdivide", states[0].mesh.edge_index(0, 3))))
    steps = finish(game, states, Meter.unlimited()).sequence.steps
    assert [step.operator for step in steps] == ["edge_subdivide", "edge_subdivide"]
    assert [sorted(step.element["edge"]) for step in steps] == [[0, 3], [1, 2]]  # type: ignore[arg-type]


@pytest.mark.parametrize("name", PLAYERS)
def test_players__heed_all_guidance_at_once(name: str) -> None:
    game = Simulator(
        painted(HOUSE), resolution=32, start=START, locked=(2, 3), symmetry=0.5,
        importance=np.linspace(0.2, 1.0, 16).reshape(16, 1) @ np.ones((1, 16)),
    )  # fmt: skip
    solution = solve(name, game)
    assert_symmetric(solution.mesh, 0.5)
    for vertex in (2, 3):
        assert (solution.mesh.vertices[solution.mesh.vertex_index(vertex)] == START.vertices[vertex]).all()
    said = solution.sequence.settings
    assert (said["locked"], said["symmetry"]) == ([2, 3], 0.5) and len(said["importance"]) == len(said["start"]) == 32
    assert solution.score.total >= game.final_score(START).total


@pytest.mark.parametrize("name", WHOLE)
def test_agents_that_find_wholes__take_importance_and_nothing_else(name: str) -> None:
    rules = RULES.get(name, {})
    game = Simulator(painted(L_SHAPE), resolution=32, importance=np.where(LEFT, 1.0, 0.3), **rules)
    assert solve(name, game, refits=10).sequence.settings["importance"]
    symmetric = () if name == "quads" else ({"symmetry": True},)
    for guidance in ({"start": START}, {"start": START, "locked": (0,)}, *symmetric):
        with pytest.raises(ConfigError, match=f"{name} .* cannot heed '(start|symmetry)'.* greedy"):
            solve(name, Simulator(painted(L_SHAPE), resolution=32, **guidance, **rules))


def test_every_agent__says_whether_it_takes_guidance() -> None:
    for name in set(AGENTS) & {*PLAYERS, *WHOLE}:
        assert make_agent(name).takes_guidance == (name in PLAYERS)


def test_help_and_docs__name_the_agents_that_take_no_guidance_and_no_other() -> None:
    """The policies have no weights here, or no torch; they play step by step, too."""
    made = [make_agent(name) for name in set(AGENTS) - {"ppo", "a2c", "dqn"}]
    whole = {agent.name for agent in made if not agent.takes_guidance}
    docs = (DOCS / "guidance.md").read_text(encoding="utf-8")
    players, _, others = docs.partition(" play step by step, and every step")
    assert set(re.findall(r"`([\w-]+)`", others.partition(" find outlines as a whole")[0])) == whole
    assert set(re.findall(r"`([\w-]+)`", players.rpartition("\n\n")[2])) == set(AGENTS) - whole
    named = " ".join(HELP.split()).partition("all but ")[2].partition(".")[0]
    assert set(re.split(", | and ", named)) == whole


# --- the command


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    monkeypatch.chdir(tmp_path)
    Image.fromarray(painted(BOTTLE, 64).mask).save("bottle.png")
    Path("box.obj").write_text(to_obj(START))
    return lambda *words: main(["bottle.png", "--resolution", "32", "--refits", "40", "--quiet", *map(str, words)])


def test_command__takes_all_guidance(command: Callable[..., int]) -> None:
    Image.fromarray((255 * LEFT).astype(np.uint8) // 2 + 100).save("left.png")
    guided = ("--importance", "left.png", "--start", "box.obj", "--lock", "2,3", "--symmetry", "auto")
    assert command("--agent", "greedy", *guided) == 0
    sequence = ConstructionSequence.load("out/bottle/sequence.json")
    assert sequence.settings["locked"] == [2, 3] and sequence.settings["symmetry"] == 0.5
    assert sequence.settings["guided_by"] == {"importance": "left.png", "start": "box.obj"}
    assert (sequence.final().vertices[[2, 3]] == from_obj(to_obj(START)).vertices[[2, 3]]).all()


def test_command__goes_on_from_a_sequence(command: Callable[..., int]) -> None:
    assert command("--agent", "greedy", "--refits", "5") == 0
    Path("out/bottle/sequence.json").rename("first.json")
    assert command("--agent", "greedy", "--start", "first.json") == 0
    whole, first = (ConstructionSequence.load(path) for path in ("out/bottle/sequence.json", "first.json"))
    assert whole.start == first.start and whole.meshes()[len(first.steps)] == first.final()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--agent", "climb", "--symmetry", "auto"), "climb finds outlines as a whole and cannot heed 'symmetry'"),
        (("--agent", "greedy", "--lock", "1"), "no start mesh"),
        (("--agent", "greedy", "--start", "box.obj", "--lock", "one"), "--lock one: expected ids"),
        (("--agent", "greedy", "--start", "box.obj", "--lock", "9"), "locked vertex 9"),
        (("--agent", "greedy", "--start", "bottle.png"), "expected a mesh"),
        (("--agent", "greedy", "--start", "nothere.obj"), "cannot read nothere.obj"),
        (("--agent", "greedy", "--start", "nothere.json"), "cannot read nothere.json"),
        (("--agent", "greedy", "--symmetry", "left"), "--symmetry left: expected auto"),
        (("--importance", "box.obj"), "not an image"),
    ],
)
def test_command__refuses_wrong_guidance_in_one_line(
    command: Callable[..., int], capsys: pytest.CaptureFixture[str], words: tuple[str, ...], complaint: str
) -> None:
    assert command(*words) == 2
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and complaint in err
