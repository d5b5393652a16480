"""Retargeting: a construction told again for another silhouette, and the command `python -m agents.retarget`."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from agents.budget import Budget, Meter, Progress
from agents.retarget import _words, main
from agents.retell.retargeting import align, retarget
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from tests.helpers.commands import Run, runner
from tests.helpers.paths import ROOT

SCORE = {"iou": 0.5, "complexity": 9, "self_intersections": 0, "total": 50.0}


def ell() -> ConstructionSequence:
    """An L: a quad, a vertex in its right side pulled to the inner corner, one in the new edge to the outer one."""
    start = mesh = PolyMesh.from_faces([(0.2, 0.2), (0.4, 0.2), (0.8, 0.8), (0.2, 0.8)], [(0, 1, 2, 3)])
    transitions = []
    for ends, place in (((1, 2), (0.4, 0.6)), ((2, 4), (0.8, 0.6))):
        edge = mesh.edge_index(*map(mesh.vertex_index, ends))
        made = OPERATORS["edge_subdivide"].apply(mesh, edge)
        mesh = made.with_vertices([*made.vertices[:-1], place])
        transitions.append((Action("edge_subdivide", edge), None, mesh, SCORE))
    return ConstructionSequence.record({"target": "ell", "w_sc": 0.3}, start, SCORE, transitions)


def picture(*boxes: tuple[int, int, int, int], size: int = 64) -> Silhouette:
    """Boxes of pixels (x0, y0, x1, y1) as one silhouette."""
    mask = np.zeros((size, size), np.bool_)
    for x0, y0, x1, y1 in boxes:
        mask[y0:y1, x0:x1] = True
    return Silhouette(mask, "boxes")


TALL = picture((8, 4, 16, 60), (8, 52, 56, 60))  # an L with thinner limbs
TURNED = picture((48, 4, 56, 60), (8, 52, 56, 60))  # its mirror image
BOX = picture((10, 12, 50, 44))


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs the command in a folder with ell.json and box.png; gives `code`, `out` and `err`."""
    monkeypatch.chdir(tmp_path)
    ell().save("ell.json")
    Image.fromarray(BOX.mask).convert("L").save("box.png")
    return runner(main, capsys)


@pytest.mark.parametrize("target", [TALL, TURNED], ids=["upright", "mirrored"])
def test_the_same_shape__is_met_exactly_with_all_steps_kept(target: Silhouette) -> None:
    done = retarget(Simulator(target), ell(), Budget(refits=60))
    assert (done.n_kept, done.n_dropped, done.n_added) == (2, 0, 0)
    assert done.solution.score.iou > 0.99
    assert [step.operator for step in done.solution.sequence.steps] == ["edge_subdivide"] * 2
    assert done.before.total < done.solution.score.total


def test_start_on_a_detail__is_called_what_it_is() -> None:
    done = retarget(Simulator(TALL), ell(), Budget(refits=60))
    assert not done.begins_elsewhere and done.start_iou == done.solution.sequence.start_score["iou"]
    elsewhere = replace(done, start_iou=0.049, least_start_iou=0.36)
    assert "kept in name only: the start is a detail here (IoU 0.049)" in _words(elsewhere, 2)
    assert "in name only" not in _words(done, 2)


def test_steps_that_are_not_needed__are_dropped() -> None:
    done = retarget(Simulator(BOX), ell(), Budget(refits=60))
    assert done.n_dropped > 0
    assert done.solution.mesh.counts == (4, 4, 1)
    assert done.solution.score.iou > 0.99


def test_what_is_missing__is_added() -> None:
    stairs = picture((8, 8, 24, 56), (24, 24, 40, 56), (40, 40, 56, 56))
    done = retarget(Simulator(stairs), ell(), Budget(refits=150))
    assert done.n_added > 0
    assert done.solution.score.total > done.refitted.total
    assert done.n_kept + done.n_added == len(done.solution.sequence.steps)


@pytest.mark.parametrize("target", [TALL, TURNED, BOX], ids=["upright", "mirrored", "box"])
def test_result__replays_from_its_start_without_a_defect_on_the_way(target: Silhouette) -> None:
    done = retarget(Simulator(target), ell(), Budget(refits=40))
    told = ConstructionSequence.from_json(done.solution.sequence.to_json())
    assert told.final() == done.solution.mesh
    assert all(map(is_sane, told.meshes()))
    assert told.steps == () or told.steps[-1].score["total"] == pytest.approx(done.solution.score.total)


def test_budget__is_kept_to() -> None:
    done = retarget(Simulator(TALL), ell(), Budget(refits=20))
    assert done.solution.stats.n_refits <= 20


def test_align__loses_no_step() -> None:
    version = align(Simulator(BOX), ell(), Meter.unlimited())[0]
    assert version.origins == (1, 2)
    assert [action.operator for action, _, _ in version.taken] == ["edge_subdivide"] * 2


def test_ctrl_c__in_the_search_returns_the_best_so_far() -> None:
    def press(progress: Progress) -> None:
        if progress.n_steps > 1:
            raise KeyboardInterrupt

    done = retarget(Simulator(BOX), ell(), Budget(refits=200), press)
    assert done.solution.stats.stopped_by == "interrupted"
    assert done.solution.score.total > done.before.total


def test_command__writes_the_results_and_tells_what_was_kept(run: Run) -> None:
    done = run("ell.json", "box.png", "--refits", 40, "--out", "made")
    assert (done.code, done.err) == (0, "")
    told = ConstructionSequence.load("made/box/sequence.json")
    kept, dropped, added = (told.settings[key] for key in ("kept", "dropped", "added"))
    assert f"steps: {kept} of 2 kept, {dropped} dropped, {added} added" in done.out
    assert kept + added == len(told.steps) and kept + dropped == 2
    assert "Open made/box/steps.png" in done.out
    drawn = ["mesh.obj", "mesh.svg", "player.html", "sequence.json", "steps.png"]
    assert sorted(os.listdir("made/box")) == ["lesson.json", *drawn]


def test_command__takes_the_object_that_the_options_name(run: Run) -> None:
    done = run("ell.json", "box.png", "--refits", 20, "--out", "made", "--object", "light", "--show-mask")
    assert (done.code, done.err) == (0, "")
    assert "mask.png" in os.listdir("made/box")


def test_json__is_one_record_of_the_scores_before_and_after(run: Run) -> None:
    done = run("ell.json", "box.png", "--refits", 40, "--json", "--quiet")
    record = json.loads(done.out)
    assert record["after"]["total"] > record["refitted"]["total"] > record["before"]["total"]
    assert record["kept"] + record["dropped"] == 2


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("ell.json", "nothing.png"), 1, "nothing.png"),
        (("nothing.json", "box.png"), 1, "cannot read nothing.json"),
        (("broken.json", "box.png"), 1, "broken.json: not JSON"),
        (("unknown.json", "box.png"), 1, "unknown.json: settings: operators 'melt' are unknown"),
        (("ell.json", "ell.json"), 1, "ell.json"),
        (("ell.json", "box.png", "--refits", -1), 2, "-1 refits"),
        (("ell.json", "box.png", "--refits", "few"), 2, "--refits"),
        (("ell.json",), 2, "NEW_IMAGE"),
        (("box/sequence.json", "box.png", "--out", "."), 2, "overwrite box/sequence.json"),
    ],
)
def test_command__tells_in_one_line_what_is_wrong(
    run: Run, arguments: tuple[Any, ...], code: int, message: str
) -> None:
    Path("broken.json").write_text(ell().to_json()[:200])
    data = json.loads(ell().to_json())
    data["settings"]["operators"] = "melt"
    Path("unknown.json").write_text(json.dumps(data))
    Path("box").mkdir()
    ell().save("box/sequence.json")
    done = run(*arguments)
    assert done.code == code
    assert done.err.startswith("error: ") and done.err.count("\n") == 1
    assert message in done.err
    assert not Path("out").exists()


def test_help__has_examples() -> None:
    shown = subprocess.run(
        [sys.executable, "-m", "agents.retarget", "--help"], cwd=ROOT, capture_output=True, text=True
    )
    assert shown.returncode == 0
    assert "python -m agents.retarget out/chair/sequence.json other_chair.png" in shown.stdout
