"""The search benchmarks: what is kept, what the tables say of results known beforehand, and the table in the docs."""

import json
import re
from collections.abc import Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from agents.budget import Budget
from agents.search.config import PAPER, MctsConfig
from autopoly_env.errors import OutputError
from autopoly_env.refit import refit_kernels
from benchmarks import search, search_cases, search_rows
from benchmarks.curve_picture import draw_curves
from benchmarks.search_cases import Case, Found, Records, Results, best_of_plays, made, target_of
from tests.agents_helpers import simulator
from training.report.statistics import Interval

DOCS = Path(__file__).parent.parent / "docs" / "search.md"
FOUND = Found(80.0, 0.9, 10, 0, 50, 1.5, "finished")


def found(total: float, stopped_by: str = "finished") -> Found:
    return replace(FOUND, total=total, stopped_by=stopped_by)


class Known:
    """Stands in for measuring: r_all by agent and target."""

    def __init__(self, totals: dict[tuple[str, str], float], finished: Iterable[str] = ()) -> None:
        self.totals, self.finished = totals, tuple(finished)
        self.asked: list[Case] = []

    def __call__(self, cases: Iterable[Case]) -> Results:
        cases = list(cases)
        self.asked += cases
        return {
            case: found(self.totals[case.agent, case.target], "finished" if case.agent in self.finished else "refits")
            for case in cases
            if (case.agent, case.target) in self.totals
        }


# --- what is kept ---


def test_records__measure_only_what_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    measured: list[Case] = []

    def measure(case: Case) -> Found:
        measured.append(case)
        return FOUND

    monkeypatch.setattr(search_cases, "measure", measure)
    first, second = (Case(name, "mcts", 0.3, refits=5) for name in ("a.png", "b.png"))
    assert Records(tmp_path / "new" / "r.jsonl").complete([first, first], 1) == {first: FOUND}
    again = Records(tmp_path / "new" / "r.jsonl")
    assert again.complete([second, first], 1) == {second: FOUND, first: FOUND}
    assert measured == [first, second]
    again.forget()
    assert Records(tmp_path / "new" / "r.jsonl").results == {}


def test_records__leave_out_a_line_that_was_cut_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search_cases, "measure", lambda case: FOUND)
    path = tmp_path / "r.jsonl"
    cases = [Case(name, "mcts", 0.3) for name in ("a", "b", "c")]
    Records(path).complete(cases[:2], 1)
    path.write_text(path.read_text()[:-20])
    records = Records(path)
    assert list(records.results) == cases[:1]
    records.complete(cases[2:], 1)
    assert list(Records(path).results) == [cases[0], cases[2]]


def test_records__tell_of_a_case_that_fails_and_go_on(tmp_path: Path) -> None:
    errors: list[str] = []
    records = Records(tmp_path / "r.jsonl")
    assert records.complete([Case("none.png", "mcts", 0.3, refits=1)], 1, lambda _, error: errors.append(error)) == {}
    assert len(errors) == 1 and "none.png" in errors[0] and not (tmp_path / "r.jsonl").exists()
    with pytest.raises(OutputError, match="give another --records"):
        Records(tmp_path)


def test_made__are_the_test_targets() -> None:
    assert made("construction", 2) == ["construction:0", "construction:1"]
    assert target_of("construction:1").name == f"construction_{2**31 + 1}"


def test_best_of_plays__spends_the_budget_and_keeps_the_best() -> None:
    game = simulator("blobs")
    one, n_one = best_of_plays(game, Budget(refits=4), {"n_steps": 3})
    best, n_refits = best_of_plays(game, Budget(refits=60), {"n_steps": 3})
    assert n_one <= 4 + 8 and 60 <= n_refits < 80  # the last step of a play may overrun
    assert best.score.total >= one.score.total


# --- what the tables say ---


def test_gap_rows__are_of_the_shapes_that_both_have_solved() -> None:
    ours = Known({("mcts", "construction:0"): 80.0, ("mcts", "construction:1"): 90.0})
    oracle = Known({("oracle", "construction:0"): 83.0, ("oracle", "construction:1"): 89.0, ("oracle", "x"): 1.0})
    rows = list(search_rows.gap_rows(ours, oracle, limit=3, refits=400, width=64))
    assert [(row.ours, row.against) for row in rows] == [(85.0, 86.0), (1.0, None), (3.0, None), (0.5, None)]
    assert rows[2].note == "construction:0" and "2 shapes" in rows[1].note
    assert {(case.refits, case.w_sc) for case in ours.asked} == {(400, 1.0)}
    assert {case.options for case in oracle.asked} == {'{"width": 64}'}


def test_anytime__does_not_ask_again_who_has_ended() -> None:
    known = Known({(agent, "a"): 70.0 for agent in search_rows.RACERS}, finished=["greedy", "mcts"])
    totals = search_rows.anytime_results(known, ["a"], [100, 50])
    assert len(totals) == 2 * 2 * len(search_rows.RACERS)
    assert {interval.mean for interval in totals.values()} == {70.0}
    assert {case.agent for case in known.asked if case.refits == 100} == {*search_rows.RACERS} - {"greedy"}


def test_ablation__changes_one_option_at_a_time() -> None:
    known = Known({("mcts", "a"): 70.0, ("mcts", "b"): 60.0})
    rows = list(search_rows.ablation_rows(known, ["a", "b"], refits=1500))
    given = [json.loads(case.options) for case in known.asked]
    assert max(map(len, given)) == 1
    n_variants = sum(map(len, search_rows.VARIANTS.values())) - len(search_rows.VARIANTS)
    assert len(rows) == 2 * (1 + n_variants)
    assert {row.ours for row in rows} == {65.0} and rows[1].note == "+0.00, 95 %: +0.00 to +0.00"
    assert {*search_rows.VARIANTS} <= {field.name for field in fields(MctsConfig)}


def test_dominance__lists_every_shape_that_is_clearly_lower() -> None:
    totals = {(agent, target): 70.0 for agent in (*search_rows.RIVALS, "mcts") for target in "ab"}
    totals["beam", "b"], totals["trace", "a"] = 70.2, 70.05
    rows = list(search_rows.dominance_rows(Known(totals), ["a", "b"], seconds=5.0))
    assert [row.name for row in rows if "lower on" in row.name] == ["  lower on b"] * 2
    assert rows[-1].ours == 2.0 and rows[-1].holds is False


def test_clock__counts_the_calls_and_takes_itself_off() -> None:
    before = refit_kernels.refit
    with search_rows._clock(refit_kernels, "refit") as seconds:
        simulator("house").initial()
    assert len(seconds) == simulator("house").initial().n_refits and min(seconds) > 0.0
    assert refit_kernels.refit is before


def test_draw_curves__is_a_picture_with_a_line_for_each_agent_and_weight() -> None:
    curves = {
        (agent, w_sc, refits): Interval(70.0, 60.0, 80.0)
        for agent in ("mcts", "a & b")
        for w_sc in (0.3, 1.0)
        for refits in (50, 5000)
    }
    curves["mcts", 1.0, 5000] = Interval(float("nan"), float("nan"), float("nan"))
    picture = ElementTree.fromstring(draw_curves(curves))
    lines = [path for path in picture.findall(".//{*}path") if path.get("class") == "line"]
    assert len(lines) == 4 and "nan" not in draw_curves(curves)
    assert {"mcts", "a & b", "50", "5000"} <= {text.text for text in picture.findall(".//{*}text")}


# --- the command and the docs ---


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["anytime", "nowhere"], "nowhere"),
        (["anytime", "--budgets", "50,many"], "--budgets 50,many: expected numbers of refits"),
        (["gap", "--limit", "0"], "limit"),
        (["everything"], "everything"),
    ],
)
def test_command__says_in_one_line_what_is_wrong(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert search.main(arguments) == 2
    err = capsys.readouterr().err
    assert complaint in err and len(err.strip().splitlines()) == 1


def test_docs__say_every_option_and_its_defaults() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (.*?) \| (.*?) \| .+ \|$", DOCS.read_text(encoding="utf-8"), re.MULTILINE)
    expected = [
        (field.name, *(_shown(getattr(config, field.name)) for config in (MctsConfig(), PAPER)))
        for field in fields(MctsConfig)
    ]
    assert rows == expected


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return (
        (", ".join(value) or "none")
        if isinstance(value, tuple)
        else f"{value:g}"
        if isinstance(value, float)
        else str(value)
    )
