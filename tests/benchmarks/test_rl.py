"""The benchmark of policies: what is measured, what the table says of results known beforehand, the learning curves."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
import torch

from agents.rl.config import NetConfig, SpaceSpec
from agents.rl.network import MeshNet
from agents.rl.weights import save_policy
from benchmarks import rl
from benchmarks.rl import Case, Found, Records, rows_of
from benchmarks.rl_curves import draw_learning, learning_curves


def found(r_all: float, n_refits: int = 5) -> Found:
    return Found(r_all, 0.9, 12, 0, n_refits, 4)


def test_share_of_the_gap__is_of_means_over_the_targets() -> None:
    totals = {rl.RECTANGLE: (60.0, 70.0), rl.GREEDY: (80.0, 90.0), rl.ONE_PASS: (75.0, 89.0)}
    results = {
        Case(f"construction:{k}", method, weights): found(total + (weights == "b") - (weights == "a"))
        for method, both in totals.items()
        for k, total in enumerate(both)
        for weights in (("a", "b") if method == rl.ONE_PASS else ("",))
    }
    rows = {row.method: row for row in rows_of(results, list(results))}
    policy = rows[rl.ONE_PASS]
    assert policy.gap is not None and policy.gap.mean == pytest.approx(17.0 / 20.0)
    assert policy.gaps == pytest.approx([16.0 / 20.0, 18.0 / 20.0]) and rows[rl.GREEDY].gaps == []
    assert policy.gap.low == pytest.approx(0.75) and policy.gap.high == pytest.approx(0.95)
    assert policy.above_greedy is not None and policy.above_greedy.mean == pytest.approx(-3.0)
    assert rows[rl.GREEDY].gap is None and rows[rl.GREEDY].r_all.mean == 85.0


def test_records__keep_what_was_measured_and_leave_out_half_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rl, "measure", lambda case: found(50.0))
    cases = [Case("construction:0", rl.GREEDY), Case("construction:1", rl.GREEDY)]
    path = tmp_path / "new" / "r.jsonl"
    assert Records(path).complete(cases, 1, print)
    path.write_text(path.read_text()[:-9])
    again = Records(path)
    assert list(again.results) == cases[:1]
    again.complete(cases, 1, print)
    assert list(Records(path).results) == cases


def test_figures__of_an_untrained_policy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    torch.manual_seed(0)
    net = MeshNet(NetConfig((4, 4, 4), 8, 1), SpaceSpec(max_vertices=24, obs_resolution=32, max_steps=3))
    path = save_policy(tmp_path / "p.safetensors", net, "ppo", {}, {})
    methods = (rl.RECTANGLE, rl.ONE_PASS, rl.PARED, rl.EQUAL)
    measured = {m: rl.measure(Case("construction:0", m, str(path), "", 8)) for m in methods}
    assert measured[rl.ONE_PASS].r_all >= measured[rl.RECTANGLE].r_all
    assert measured[rl.PARED].r_all >= measured[rl.ONE_PASS].r_all - 0.1  # what is told anew may lose hundredths
    assert 8 <= measured[rl.EQUAL].n_refits < 16
    assert rl.main(["figures", str(tmp_path / "none.safetensors"), "--records", str(tmp_path / "r.jsonl")]) == 2
    assert "no weights" in capsys.readouterr().err
    assert rl.main(["figures", str(path), "--play", "twice"]) == 2
    assert "'twice': expected one of 'one pass'" in capsys.readouterr().err


@pytest.mark.slow
def test_throughput_and_curves__are_read_from_logs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shares = {"train/share_env": 0.5, "train/share_inference": 0.2, "train/share_update": 0.3}
    lines = [  # the first evaluation is of an older version, which called it an exam
        {"step": 6000, "train/steps_per_second": 500.0, "train/minutes": 0.2, **shares},
        {"step": 6000, "exam/final": 71.0, "exam/minutes": 0.2, "exam/objects_start": 60.0, "exam/objects_final": 71.0},
        {"step": 9000, "eval/final": 75.0, "eval/minutes": 0.3, "eval/objects_start": 60.0, "eval/objects_final": 75.0},
    ]
    (tmp_path / "log.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert rl.main(["throughput", str(tmp_path)]) == 0
    assert "500" in capsys.readouterr().out
    picture = tmp_path / "p.svg"
    assert rl.main(["curves", f"from <nothing>={tmp_path},{tmp_path}", "--picture", str(picture)]) == 0
    texts = {text.text for text in ElementTree.parse(picture).getroot().findall(".//{*}text")}
    assert {"objects", "from <nothing>", "minutes of training"} <= texts
    assert rl.main(["curves", "nothing", "--picture", str(picture)]) == 2
    assert rl.main(["throughput", str(tmp_path / "none")]) == 2


def test_curves__are_medians_and_ranges_over_the_seeds() -> None:
    def run(*values: float) -> list[dict[str, float]]:
        return [
            {"eval/minutes": float(k), "eval/objects_start": 60.0, "eval/objects_final": value}
            for k, value in enumerate(values)
        ]

    curves = learning_curves({"a": [run(1.0, 4.0, 9.0), run(3.0, 5.0), run(2.0, 8.0)]})
    curve = curves["objects"]["a"]
    assert (curve.middle, curve.low, curve.high) == ([2.0, 5.0], [1.0, 4.0], [3.0, 8.0])
    assert "<svg" in draw_learning(curves)
