"""Expert iteration: what is played and taught, what is refused, and a run that is killed goes on where it was."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from agents.choice.config import ChoiceConfig
from agents.choice.weights import load_choice
from agents.search.tree import Node
from agents.solution import Track
from autopoly_env.errors import ConfigError, RunError
from autopoly_env.targets import HELD_OUT, LEARNING
from tests.helpers.choosing import SMALL, evaluator
from tests.helpers.paths import ROOT
from tests.helpers.searches import Game
from training import improve
from training.improvement import learning
from training.improvement.comparing import CompareConfig, Totals, held_out_total
from training.improvement.learning import LearnConfig, learn, loss_of, split
from training.improvement.lessons import LabelConfig, Lesson, lessons_of, mirrored
from training.improvement.network import ChoiceModule
from training.improvement.playing import PlayConfig, _best_below, _way_to_best, made_target, play
from training.improvement.plays import Play
from training.improvement.rounds import RoundsConfig

QUICK = PlayConfig(refits=25, n_runs=1)
SETTINGS = [
    *("play.n_first=2", "play.refits=25", "play.n_runs=1", "net.width=6", "net.side=2", "run.n_rounds=1"),
    *("learn.n_steps=4", "learn.measured=0.4", "compare.n_targets=2", "compare.refits=8"),
]


@pytest.fixture(scope="module")
def plays() -> list[Play]:
    """Three quick plays, of both styles."""
    return [play(replace(QUICK, modeller=share), 0, 1, k) for k, share in enumerate((1.0, 0.0, 1.0))]


@pytest.fixture(scope="module")
def lessons(plays: list[Play]) -> list[Lesson]:
    return [lesson for one in plays for lesson in lessons_of(one, SMALL, LabelConfig(least_gain=0.0, n_least=1))]


# --- playing ---


def test_way__leads_to_the_best_state_whatever_lies_between() -> None:
    game = Game({"r": 10.0, "a": 5.0, "b": 12.0, "c": 20.0}, {"r": "ab", "a": "c"})
    root = Node(Track(game.states["r"]))
    a, b = (Node(Track(game.states[name]), root) for name in "ab")
    c = Node(Track(game.states["c"]), a)
    root.children, a.children = [a, b], [c]
    best = _best_below(root)
    assert [best[node] for node in (root, a, b, c)] == [20.0, 20.0, 12.0, 20.0]
    assert list(_way_to_best(root, best.__getitem__)) == [root, a, c]


def test_play__says_what_was_found_behind_each_action(plays: list[Play]) -> None:
    for one in plays:
        one.check()
        first = one.states[0]
        assert max(state.best for state in one.states) == pytest.approx(one.best)
        for state in one.states:
            tried = [value for value in state.found if value is not None]
            assert tried and state.best == pytest.approx(max(state.total, *tried))
            assert sum(map(bool, state.visits)) == len(tried)
        simulator = one.simulator()
        assert simulator.score(first.mesh()).total == pytest.approx(first.total)
    assert {one.style for one in plays} == {"modeller", "paper"}


def test_play__depends_on_its_numbers_and_the_evaluator_alone(plays: list[Play]) -> None:
    assert play(replace(QUICK, modeller=1.0), 0, 1, 0) == plays[0]
    assert play(replace(QUICK, modeller=1.0), 0, 2, 0).target != plays[0].target
    few = replace(QUICK, modeller=1.0, refits=10)
    ours, other = play(few, 0, 1, 0), play(few, 0, 1, 0, evaluator())
    assert ours.target == other.target == plays[0].target and ours.states != other.states


def test_targets__to_learn_from_and_to_measure_with_are_others() -> None:
    rng = np.random.default_rng(0)
    for number in range(20):
        for held_out, seeds in ((False, LEARNING), (True, HELD_OUT)):
            assert int(made_target(number, rng, held_out).partition(":")[2]) in seeds


def test_play__comes_back_from_its_file_as_it_was(plays: list[Play], tmp_path: Path) -> None:
    for number, one in enumerate(plays):
        assert Play.load(one.save(tmp_path / f"{number}.json")) == one


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda text, _: text[: len(text) // 2], "torn"),
        (lambda _, values: json.dumps(values | {"version": 9}), "version 9"),
        (lambda _, values: json.dumps(values | {"style": "baroque"}), "style"),
        (lambda _, values: _with(values, "actions", [["edge_fill", 99], *values["states"][0]["actions"][1:]]), "legal"),
        (lambda _, values: _with(values, "actions", [["fly", 0], *values["states"][0]["actions"][1:]]), "fly"),
        (lambda _, values: _with(values, "total", float("nan")), "not a number"),
        (lambda _, values: _with(values, "visits", [1]), "as many labels"),
        (lambda _, values: _with(values, "faces", [[0, 0, 7]]), "delete it"),
    ],
    ids=["torn", "version", "style", "illegal", "unknown", "nan", "labels", "mesh"],
)
def test_damaged_play__is_refused_in_a_line_with_its_name(
    plays: list[Play],
    tmp_path: Path,
    change,  # type: ignore[no-untyped-def]
    complaint: str,
) -> None:
    path = plays[0].save(tmp_path / "play.json")
    text = path.read_text()
    path.write_text(change(text, json.loads(text)))
    with pytest.raises(RunError, match=complaint) as caught:
        Play.load(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def _with(values: dict, key: str, value: object) -> str:  # type: ignore[type-arg]
    """The play with something else in its first state."""
    return json.dumps(values | {"states": [values["states"][0] | {key: value}, *values["states"][1:]]})


# --- lessons ---


def test_lesson__likes_best_what_led_to_most_and_where_nothing_did_teaches_nothing(
    lessons: list[Lesson],
) -> None:
    teaching = [one for one in lessons if one.policy.any()]
    assert teaching and all(one.policy.sum() == pytest.approx(1.0, abs=1e-5) for one in teaching)
    for one in teaching:
        assert one.found[one.policy.argmax()] == one.found.max() > one.total
    assert all(one.found.max() <= one.total for one in lessons if not one.policy.any())


def test_mirror__twice_is_the_same(lessons: list[Lesson]) -> None:
    seen = lessons[0].seen
    twice = mirrored(mirrored(seen))
    assert np.allclose(twice.numbers, seen.numbers, atol=1e-6) and (twice.patches == seen.patches).all()
    assert (mirrored(seen).patches != seen.patches).any()


# --- learning ---


def test_learning__lowers_the_loss_and_is_the_same_again(lessons: list[Lesson]) -> None:
    config = LearnConfig(n_steps=60, batch_size=8, measured=0.4)
    tensors, metrics = learn(lessons, SMALL, config, 0)
    again, _ = learn(lessons, SMALL, config, 0)
    assert all((tensors[name] == again[name]).all() for name in tensors)
    net = ChoiceModule(SMALL)
    _, learnt = split(lessons, 0.4)
    torch.manual_seed(0)
    before = float(loss_of(ChoiceModule(SMALL).eval(), learnt, 0.3).detach())
    net.fill(tensors)
    assert float(loss_of(net.eval(), learnt, 0.3).detach()) < before
    assert {"best_first", "gain_top3_residual", "loss"} <= metrics.keys()


def test_split__keeps_a_target_on_one_side(lessons: list[Lesson]) -> None:
    kept, learnt = split(lessons, 0.4)
    assert {one.group for one in kept}.isdisjoint(one.group for one in learnt) and len(kept) + len(learnt) == len(
        lessons
    )
    with pytest.raises(RunError, match="too few"):
        learn(lessons[:1], SMALL, LearnConfig(n_steps=1), 0)


def test_loss__that_is_no_number_ends_the_training(lessons: list[Lesson], monkeypatch: pytest.MonkeyPatch) -> None:
    whole = loss_of
    monkeypatch.setattr(learning, "loss_of", lambda *given: whole(*given) * float("nan"))
    with pytest.raises(RunError, match=r"the loss is nan at step 0: give a lower learn\.lr"):
        learn(lessons, SMALL, LearnConfig(n_steps=5, measured=0.4), 0)


# --- comparing ---


def test_lead__is_target_by_target_and_half_a_line_counts_as_none(tmp_path: Path) -> None:
    path = tmp_path / "compared.jsonl"
    totals = Totals(path)
    for number, (plain, ours) in enumerate([(70.0, 71.0), (80.0, 83.0)]):
        totals.add(0, number, plain)
        totals.add(1, number, ours)
    assert totals.lead(1, 2).mean == pytest.approx(2.0) and totals.mean(1) == 77.0
    path.write_text(path.read_text()[:-9])
    again = Totals(path)
    assert again.lead(1, 2).mean == pytest.approx(1.0)
    again.add(1, 1, 84.0)
    assert Totals(path).lead(1, 2).mean == pytest.approx(2.5)


def test_held_out_total__is_of_the_tree_alone_at_its_refits() -> None:
    config = CompareConfig(n_targets=1, refits=6)
    assert held_out_total(config, "", 0, 0) == held_out_total(config, "", 0, 0) < 100.0


# --- the command ---


def test_command__improves_and_exports(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    arguments = [*SETTINGS, "--out", str(out), "--engine", "serial"]
    code = improve.main(arguments)
    said = capsys.readouterr()
    assert {path.name for path in (out / "plays" / "round_1").iterdir()} == {"00000.json", "00001.json"}
    assert load_choice(str(out / "round_1.safetensors")).config == ChoiceConfig(width=6, side=2)
    if code == 0:
        assert json.loads((out / "report.json").read_text())["best"] == 1 and "round 1: mean r_all" in said.out
        assert load_choice(str(out / "choice.safetensors")).config.width == 6
    else:
        assert "the first round gained nothing" in said.err
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*.json")}
    assert improve.main(arguments) == code
    unchanged = [path for path in before if path.stat().st_mtime_ns == before[path]]
    assert set(unchanged) >= set((out / "plays").rglob("*.json")) | {out / "round_1.json"}


def test_command__refuses_a_folder_of_other_settings_and_a_torn_play(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    arguments = [*SETTINGS, "--out", str(out), "--engine", "serial"]
    improve.main(arguments)
    (out / "round_1.json").unlink()
    torn = out / "plays" / "round_1" / "00001.json"
    whole = torn.read_text()
    torn.write_text(whole[:100])
    capsys.readouterr()
    assert improve.main(arguments) == 1
    assert "00001.json: torn" in capsys.readouterr().err
    assert improve.main([*arguments, "play.refits=26"]) == 1
    assert "belongs to a run with another play.refits" in capsys.readouterr().err
    assert improve.main(["play.n_first=0"]) == 2
    assert "play.n_first=0: expected a number of at least 1" in capsys.readouterr().err


@pytest.mark.slow
def test_run__that_is_killed_goes_on_and_ends_as_one_that_was_not(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "training.improve", *SETTINGS, "play.n_first=6", "--engine", "serial", "--out"]
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    for pause in (1, 3):  # plays that are there when it is killed
        process = subprocess.Popen(
            [*command, str(killed)], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        while process.poll() is None and len(list(killed.glob("plays/*/*.json"))) < pause:
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    codes = [subprocess.run([*command, str(out)], cwd=ROOT, capture_output=True, check=False).returncode
             for out in (killed, whole)]  # fmt: skip
    assert codes[0] == codes[1]
    for name in ("round_1.safetensors", *(f"plays/round_1/{k:05d}.json" for k in range(6))):
        assert (killed / name).read_bytes() == (whole / name).read_bytes()
    lines = [sorted((out / "compared.jsonl").read_text().splitlines()) for out in (killed, whole)]
    assert lines[0] == lines[1]


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        (PlayConfig, {"modeller": 2.0}),
        (PlayConfig, {"w_sc": (0.0, 1.0)}),
        (LabelConfig, {"temperature": 0.0}),
        (LearnConfig, {"measured": 1.0}),
        (LearnConfig, {"n_steps": 0}),
        (RoundsConfig, {"n_rounds": 0}),
        (CompareConfig, {"refits": 0}),
        (ChoiceConfig, {"classes": ("edge_cap", "edge_cap")}),
        (ChoiceConfig, {"w_sc": (2.0, 1.0)}),
    ],
)
def test_settings__out_of_range_are_refused(kind: type, settings: dict[str, object]) -> None:
    (name,) = settings
    with pytest.raises(ConfigError, match=f"^{name}.*: expected "):
        kind(**settings)
