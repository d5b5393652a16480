"""Retargeting: a construction told again for another silhouette, and the command `python -m agents.retarget`."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from agents.budget import Budget, Meter, Progress
from agents.retarget import _words, main
from agents.retell import retargeting
from agents.retell.retargeting import align, retarget
from agents.retell.versions import Version
from autopoly_env.mesh import PolyMesh, is_sane
from autopoly_env.mesh.symmetry import axis_of
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from tests.helpers.commands import Run, runner
from tests.helpers.paths import ROOT
from tests.helpers.tables import table

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


def test_result__is_no_worse_than_the_steps_refitted(monkeypatch: pytest.MonkeyPatch) -> None:
    def worse(_simulator: Simulator, version: Version, _meter: Meter) -> Iterator[Version]:
        """Better where it is searched, but not at the image's own resolution."""
        small = 0.5 + 0.2 * (version.mesh.vertices - 0.5)
        yield replace(version, mesh=version.mesh.with_vertices(small), score=replace(version.score, total=1000.0))

    monkeypatch.setattr(retargeting, "improve", worse)
    monkeypatch.setattr(Simulator, "polish", lambda _simulator, mesh: mesh)
    done = retarget(Simulator(TALL), ell(), Budget(refits=60))
    assert done.solution.score.total >= done.refitted.total > 50.0


def test_result_that_is_less__says_what_for() -> None:
    done = retarget(Simulator(TALL), ell(), Budget(refits=60))
    less = replace(done, refitted=replace(done.refitted, total=99.0))
    assert _words(done, 2).endswith(" now")
    assert _words(less, 2).endswith(" now, without hairlines")
    assert " now, level and plumb\n" in _words(less, 2, keep_level=True)


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


def slanted(degrees: float) -> Silhouette:
    """A box of 36 by 20 pixels, turned."""
    y, x = np.mgrid[:64, :64] - 31.5
    turn = np.radians(degrees)
    u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    return Silhouette((np.abs(u) < 18) & (np.abs(v) < 10), "slanted")


def off_axis(mesh: PolyMesh) -> float:
    """How far the edge that is furthest from level or plumb is off."""
    return float(np.abs(mesh.vertices[mesh.edges[:, 0]] - mesh.vertices[mesh.edges[:, 1]]).min(axis=1).max())


def test_level_and_plumb_edges__stay_so_if_asked_to() -> None:
    box = ConstructionSequence.record({"target": "box"}, PolyMesh.rectangle(0.2, 0.3, 0.8, 0.7), SCORE, [])
    free = retarget(Simulator(slanted(10.0)), box, Budget(refits=30))
    kept = retarget(Simulator(slanted(10.0)), box, Budget(refits=30), keep_level=True)
    assert free.solution.score.iou > 0.98 and off_axis(free.solution.mesh) > 0.05
    assert (free.n_level, free.n_tilted) == (0, 4)
    assert 0.7 < kept.solution.score.iou < 0.95 and off_axis(kept.solution.mesh) < 1e-9
    assert (kept.n_level, kept.n_tilted) == (4, 0)


def test_level_edges__of_steps_that_are_kept_stay_so_among_others() -> None:
    done = retarget(Simulator(TURNED), ell(), Budget(refits=60), keep_level=True)
    assert done.n_kept == 2 and done.n_tilted == 0 and done.n_level == 6
    assert done.solution.score.iou > 0.99
    told = ConstructionSequence.from_json(done.solution.sequence.to_json())
    assert told.final() == done.solution.mesh and off_axis(done.solution.mesh) < 1e-9


def test_symmetric_construction__stays_symmetric_about_the_axis_of_the_simulator() -> None:
    odd = picture((4, 12, 60, 20), (10, 20, 16, 58), (48, 20, 54, 57))  # one leg is a pixel shorter
    free = retarget(Simulator(odd), table(), Budget(refits=60))
    kept = retarget(Simulator(odd, symmetry=0.5), table(), Budget(refits=60))
    assert axis_of(free.solution.mesh) is None
    assert axis_of(kept.solution.mesh) == pytest.approx(0.5, abs=1e-9)
    assert kept.solution.score.iou > 0.97 and kept.n_kept == 4


@pytest.mark.parametrize(
    ("box", "n_kept"), [((10, 20, 54, 28), 0), ((8, 16, 56, 40), 0), ((8, 20, 56, 30), 2)], ids=str
)
def test_symmetric_construction__loses_a_step_and_its_mirror_image_together(
    box: tuple[int, int, int, int], n_kept: int
) -> None:
    """Of a slab; from where the legs would begin to the finish, which takes the two vertices away again, is as good."""
    done = retarget(Simulator(picture(box), symmetry=0.5), table(), Budget(refits=100))
    assert (done.n_kept, done.n_dropped) == (n_kept, 4 - n_kept)
    assert done.solution.mesh.counts == (4, 4, 1) and axis_of(done.solution.mesh) is not None


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


def test_command__says_how_many_edges_stay_level_and_plumb(run: Run) -> None:
    done = run("ell.json", "box.png", "--refits", 40, "--out", "made", "--keep-level")
    assert (done.code, done.err) == (0, "")
    assert "level and plumb: 3 of 3 edges stay so" in done.out


def test_command__keeps_left_and_right_alike_unless_told_otherwise(run: Run) -> None:
    table().save("table.json")
    kept = run("table.json", "box.png", "--refits", 40, "--out", "kept")
    free = run("table.json", "box.png", "--refits", 40, "--out", "free", "--no-symmetry")
    assert (kept.code, free.code) == (0, 0)
    assert "left and right stay alike (about x = 0.46875)" in kept.out
    assert "alike" not in free.out
    assert ConstructionSequence.load("kept/box/sequence.json").settings["symmetry"] == 0.46875


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
