"""An operator from outside, `examples/edge_collapse.py`, in every command: it is one file, named where it is used."""

import json
import os
import pickle
import subprocess
import sys
from pathlib import Path

import gymnasium
import pytest
from gymnasium.vector import AsyncVectorEnv
from PIL import Image

from agents import export, retarget, solve, vary
from autopoly_env.conformance import check_operator
from autopoly_env.errors import ConfigError
from autopoly_env.export import to_obj
from autopoly_env.export.blender import Job, find_blender, mismatches, run_in_blender, save_blender_script
from autopoly_env.export.formats import LISTED, formats
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action, operator_named, preset
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator
from examples.edge_collapse import edge_collapse
from tests.helpers.commands import runner
from tests.helpers.drawings import BOTTLE, L_SHAPE, painted
from tests.helpers.environments import SMALL
from tests.helpers.paths import ROOT
from tests.helpers.sequences import SCORE
from training import evaluate

COLLAPSE = "examples.edge_collapse:edge_collapse"
WITH_COLLAPSE = f"full,{COLLAPSE}"
RESULTS = {"sequence.json", "mesh.obj", "mesh.svg", "steps.png", "player.html", "lesson.json"}

try:
    find_blender()
    WHY_NOT = ""
except ConfigError as error:
    WHY_NOT = str(error)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Image.fromarray(painted(L_SHAPE, 64).mask).save("l.png")
    Image.fromarray(painted(BOTTLE, 64).mask).save("bottle.png")


def collapsed() -> ConstructionSequence:
    """A square with a gable and a wing, of which an edge is collapsed: a step by every kind of change of vertices."""
    preset(COLLAPSE)
    mesh = start = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    steps = []
    for name, ends in (("edge_subdivide", (0, 1)), ("edge_extrude", (1, 2)), ("edge_collapse", (5, 6))):
        action = Action(name, mesh.edge_index(*ends))
        mesh = operator_named(name).apply(mesh, action.element)
        if name == "edge_subdivide":
            mesh = mesh.with_vertices([*mesh.vertices[:-1], (0.5, 0.125)])
        steps.append((action, None, mesh, SCORE))
    settings = {"target": "blank", "operators": "full,edge_collapse", "resolution": 32}
    return ConstructionSequence.record(settings, start, SCORE, steps)


@pytest.fixture
def saved() -> Path:
    """A file with that sequence, in a process that has not heard of the operator."""
    collapsed().save("blank.json")
    del OPERATORS["edge_collapse"]
    return Path("blank.json")


def test_operator__conforms() -> None:
    check_operator(edge_collapse)


def test_solve__plays_with_it_and_writes_every_result(capsys: pytest.CaptureFixture[str]) -> None:
    corners = [(0.25, 0.25), (0.5, 0.25), (0.5, 0.5), (0.75, 0.5), (0.7, 0.6), (0.75, 0.75), (0.25, 0.75)]
    mesh = PolyMesh.from_faces(corners, [tuple(range(7))])  # an L with a dent
    Path("start.obj").write_text(to_obj(mesh))
    options = ("--agent", "beam", "--start", "start.obj", "--resolution", 32, "--refits", 60, "--json", "--quiet")
    done = runner(solve.main, capsys)("l.png", *options, "--operators", COLLAPSE)
    assert done.code == 0, done.err
    files = {name: Path(path) for name, path in json.loads(done.out)["files"].items()}
    assert files.keys() == RESULTS and all(path.stat().st_size for path in files.values())
    steps = ConstructionSequence.load(files["sequence.json"]).steps
    assert "edge_collapse" in {step.operator for step in steps}
    assert "Collapse an edge" in files["player.html"].read_text()


@pytest.mark.parametrize("name", [name for name, _, _ in LISTED])
def test_export__writes_every_format_of_it(name: str, saved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run, goal = runner(export.main, capsys), f"house{formats()[name].suffix}"
    done = run(saved, "--to", name, "--out", goal)
    assert done.code == 1 and "operator 'edge_collapse' is unknown" in done.err
    assert run(saved, "--to", name, "--out", goal, "--operators", COLLAPSE).code == 0
    assert Path(goal).stat().st_size


def test_vary_and_retarget__follow_it(saved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    done = runner(vary.main, capsys)(saved, "--n", 2, "--operators", COLLAPSE, "--out", "variants", "--quiet")
    assert done.code == 0, done.err
    done = runner(retarget.main, capsys)(saved, "l.png", "--refits", 20, "--operators", COLLAPSE, "--json", "--quiet")
    assert done.code == 0, done.err
    assert {path.parent.name for path in Path().glob("*/*/player.html")} == {"variant-1", "variant-2", "l"}


@pytest.mark.slow
@pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT or "Blender is here")
def test_blender__has_the_same_mesh_after_every_step_of_it() -> None:
    sequence, report = collapsed(), Path("report.json").absolute()
    script = save_blender_script(sequence, Path("blank.py").absolute())
    run_in_blender([Job(Path(script), ("--report", str(report)))], seconds=120.0)
    assert mismatches(sequence, json.loads(report.read_text())) == []


@pytest.mark.slow
def test_spawned_workers__find_it(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    suite = "targets: {kind: construction, n: 2, resolution: 32}\nresolution: 32\nbudget: {refits: 10}\n"
    Path("mine.yaml").write_text(
        f"{suite}operators: '{WITH_COLLAPSE}'\nagents: [{{agent: greedy}}, {{agent: random}}]\n"
    )
    run = runner(evaluate.main, capsys)
    done = run("mine.yaml", "--engine", "process", "--workers", 1, "--quiet", "--json", "--out", "run")
    assert done.code == 0 and not any(json.loads(line)["failed"] for line in done.out.splitlines()), done.err
    vector_kwargs = {"context": "spawn"}
    envs = gymnasium.make_vec("autopoly_env:AutoPoly-v0", 2, "async", vector_kwargs, operators=WITH_COLLAPSE, **SMALL)
    assert isinstance(envs, AsyncVectorEnv)
    try:
        envs.reset(seed=0)
        envs.step(envs.action_space.sample())
    finally:
        envs.close()


@pytest.mark.slow
def test_simulator_with_it__goes_to_a_process_that_has_not_heard_of_it() -> None:
    code = (
        "import pickle, sys; s = pickle.load(sys.stdin.buffer); print(len(s.transition_all(s.initial())), *s.operators)"
    )
    given = pickle.dumps(Simulator(painted(L_SHAPE), operators=WITH_COLLAPSE, resolution=32))
    done = subprocess.run(
        [sys.executable, "-c", code], input=given, capture_output=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    n, *names = done.stdout.decode().split()
    assert int(n) > 3 and names[-1] == "edge_collapse", done.stderr.decode()
