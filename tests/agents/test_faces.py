"""Agents and commands under a rule of faces: those that play keep it, those that find outlines say that they do not."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from agents import retarget as retarget_command
from agents import vary as vary_command
from agents.base import Agent, WholeAgent
from agents.budget import Budget, Meter
from agents.conformance import check_agent, check_solution
from agents.retell.retargeting import retarget
from agents.retell.variants import draw_variants
from agents.search.config import MctsConfig
from agents.search.incumbents import play
from agents.search.mcts import MctsAgent
from agents.solution import Solution
from agents.solve import main
from autopoly_env.errors import ConfigError, ConformanceError, SequenceError
from autopoly_env.mesh import PolyMesh, broken_faces
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator
from tests.helpers.drawings import BOTTLE, L_SHAPE, painted
from tests.helpers.solving import quick

BUILDERS = "edge_extrude,face_delete,edge_subdivide,vertex_dissolve"
OUTLINERS = ("trace", "climb", "decimate")


def game(faces: str = "quads", operators: str = BUILDERS) -> Simulator:
    return Simulator(painted(L_SHAPE), resolution=32, operators=operators, faces=faces)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "name", ["greedy", "beam", "random", "mcts", "mcts_paper", "oracle", "dr-simple", "dr-complex"]
)
@pytest.mark.parametrize("faces", ["convex", "quads"])
def test_agents_that_play__keep_the_rule_in_every_mesh(name: str, faces: str) -> None:
    simulator = game(faces)
    solution = quick(name).solve(simulator, Budget(refits=60))
    check_solution(solution, simulator)
    assert solution.sequence.settings["faces"] == faces
    assert not any(broken_faces(mesh, simulator.faces) for mesh in solution.sequence.meshes())
    assert solution.score.total >= simulator.final_score(simulator.initial().mesh).total or name in (
        "random",
        "dr-complex",
    )


@pytest.mark.parametrize("name", OUTLINERS)
def test_agents_that_find_outlines__say_that_they_keep_no_rule(name: str) -> None:
    assert not quick(name).takes_faces
    with pytest.raises(ConfigError, match=f"^{name} finds outlines, .* cannot keep faces=quads: choose .* greedy"):
        quick(name).solve(game())


def test_mcts__leaves_out_seeds_that_keep_no_rule_and_never_hops() -> None:
    seeds = [quick(name) for name in ("trace", "greedy")]
    assert len(list(play(seeds, game(), Meter(Budget(refits=200))))) == 1
    assert len(list(play(seeds, game("any"), Meter(Budget(refits=200))))) == 2
    solution = MctsAgent(MctsConfig(n_simulations=4, patience=1), seeds).solve(game(), Budget(refits=100))
    check_solution(solution, game())


class _Careless(WholeAgent):
    """Says that it keeps the rule, and returns a dart."""

    name = "careless"
    takes_faces = True

    def _find(self, simulator: Simulator, meter: Meter) -> Solution:
        dart = PolyMesh.from_faces([(0.2, 0.2), (0.5, 0.4), (0.8, 0.2), (0.5, 0.8)], [(0, 1, 2, 3)])
        score = simulator.final_score(dart)
        told = {**simulator.settings(), "scored_at": simulator.silhouette.resolution}
        sequence = ConstructionSequence.record({**told, "faces": "any"}, dart, score.as_dict(), [])
        meter.count(1, score.total)
        return Solution(replace(sequence, settings=told), dart, score, meter.stats())


def test_check_solution__finds_a_mesh_that_breaks_the_rule() -> None:
    agent: Agent = _Careless()
    with pytest.raises((ConformanceError, SequenceError), match=r"face 0 .* reflex"):
        check_solution(agent.solve(game()), game())


@pytest.mark.slow  # a whole check
def test_agents__conform_under_a_rule() -> None:
    check_agent(quick("beam"), faces="quads", operators=BUILDERS)


# --- told again


def built() -> ConstructionSequence:
    return quick("beam").solve(game(), Budget(refits=120)).sequence


def test_retargeting_and_variants__keep_the_rule() -> None:
    sequence = built()
    assert len(sequence.steps) > 0
    simulator = Simulator(painted(BOTTLE), resolution=32, operators=BUILDERS, faces=sequence.faces)
    told = retarget(simulator, sequence, Budget(refits=60)).solution
    assert not any(broken_faces(mesh, "quads") for mesh in told.sequence.meshes())
    for variant in draw_variants(sequence, 3, 0.08, 0):
        assert variant is None or not any(broken_faces(mesh, "quads") for mesh in variant.sequence.meshes())


# --- commands


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Image.fromarray(painted(L_SHAPE, 64).mask).save("ell.png")
    return tmp_path


@pytest.mark.slow
def test_commands__take_the_rule_and_carry_it_on(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    quick_ones = ("--resolution", "32", "--refits", "60", "--quiet")
    assert main(["ell.png", "--agent", "greedy", "--operators", BUILDERS, "--faces", "quads", *quick_ones]) == 0
    sequence = ConstructionSequence.load("out/ell/sequence.json")
    assert sequence.faces == "quads"
    assert (
        retarget_command.main(["out/ell/sequence.json", "ell.png", "--refits", "20", "--out", "again", "--quiet"]) == 0
    )
    assert ConstructionSequence.load("again/ell/sequence.json").faces == "quads"
    assert vary_command.main(["out/ell/sequence.json", "--n", "1", "--amount", "0.05", "--quiet"]) in (0, 1)


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("--faces", "round"), "faces 'round': expected one of any, convex, quads"),
        (("--faces", "quads", "--agent", "trace"), "trace finds outlines, .* cannot keep faces=quads"),
        (
            ("--faces", "quads", "--agent", "greedy", "--start", "dart.obj"),
            "face 0 of the start mesh has a reflex corner",
        ),
    ],
    ids=["unknown", "agent", "start"],
)
def test_command__refuses_in_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], error: str
) -> None:
    Path("dart.obj").write_text("v 0.2 0.2 0\nv 0.5 0.4 0\nv 0.8 0.2 0\nv 0.5 0.8 0\nf 1 2 3 4\n")
    assert main(["ell.png", *words]) == 2
    said = capsys.readouterr().err.strip()
    assert re.search(error, said) and "\n" not in said
    assert not np.any([path.is_dir() for path in folder.iterdir()])
