"""The command `python -m training.evaluate`: records and tables, and runs that are cut off, shared out or merged."""

import csv
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image

from autopoly_env.errors import OutputError
from tests.helpers.commands import Run, Said, runner, without_pulses
from tests.helpers.drawings import HOUSE, L_SHAPE, SQUARE, painted
from tests.helpers.paths import ROOT
from tests.helpers.shapes import shapely_coverage
from training.evaluate import main
from training.evaluation import run as evaluate_run
from training.parallel import Done
from training.records import Record, RecordWriter, read_info, read_records

SUITE = """
targets: {kind: construction, n: 3, difficulty: [1, 2], resolution: 64}
weights: {w_sc: 1}
resolution: 64
max_steps: 4
budget: {refits: 50}
baseline: trace
agents:
  - {agent: trace}
  - {agent: random, options: {n_steps: 2}}
  - {agent: dr-simple, printed: {r_sm: 0.732, r_sc: 9, r_si: 0, r_all: 62.2}}
  - {agent: trace, label: thrifty, weights: {w_sc: 30}}
  - {agent: soothsayer, missing: no weights yet}
"""
LABELS = ["ground truth", "trace", "random", "dr-simple", "thrifty"]
TIMES = ("seconds", "seconds_low", "seconds_high")


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("tiny.yaml").write_text(SUITE)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs the command in this process, on the serial engine unless told otherwise; gives `code`, `out` and `err`."""

    def run_it(*arguments: object) -> Said:
        given = [str(argument) for argument in arguments]
        if "--engine" not in given and "--merge" not in given:
            given += ["--engine", "serial"]
        return runner(main, capsys)(*given, "--quiet")

    return run_it


def results(folder: str) -> dict[Any, Any]:
    """What a run found out, times aside."""
    found = {}
    for record in read_records(Path(folder)):
        outcome = dict(vars(record.outcome)) if record.outcome else {}
        outcome.pop("seconds", None)
        outcome["curve"] = [(refits, best) for refits, _, best in outcome.get("curve", [])]
        found[record.key] = (outcome, record.error)
    return found


def table(folder: str) -> list[dict[str, str]]:
    """The rows of table.csv, times aside."""
    with (Path(folder) / "table.csv").open(newline="") as stream:
        return [{key: value for key, value in row.items() if key not in TIMES} for row in csv.DictReader(stream)]


def lines(folder: str) -> list[Any]:
    return [json.loads(line) for line in (Path(folder) / "records.jsonl").read_text().splitlines()]


def images(*names: str) -> None:
    Path("pictures").mkdir(exist_ok=True)
    for name, shape in zip(names, (SQUARE, L_SHAPE, HOUSE), strict=False):
        Image.fromarray(painted(shape).mask).save(f"pictures/{name}.png")


# Records and tables


def test_records__agree_with_shapely_and_the_suites_weights(run: Run) -> None:
    assert run("tiny.yaml", "--out", "out").code == 0
    records = read_records(Path("out"))
    assert [record.agent for record in records] == LABELS * 3
    for record in records:
        outcome = record.outcome
        assert outcome is not None
        mesh = outcome.mesh
        pairs = {frozenset((face[k - 1], v)) for face in mesh.faces for k, v in enumerate(face)}
        assert (outcome.V, outcome.E, outcome.F) == (len(mesh.vertices), len(pairs), len(mesh.faces))
        assert outcome.r_sc == outcome.V + outcome.E + outcome.F
        shape = shapely.union_all([shapely.Polygon([mesh.vertices[v] for v in face]) for face in mesh.faces])
        wanted = np.asarray(Image.open(f"out/targets/{record.target}.png"))
        covered = shapely_coverage(shape, 64) >= 0.5
        assert outcome.r_sm == pytest.approx((covered & wanted).sum() / (covered | wanted).sum(), abs=1e-3)
        assert outcome.r_all == pytest.approx(100 * outcome.r_sm - outcome.r_sc - 5 * outcome.r_si)
        assert outcome.seconds >= 0.0
        assert outcome.flipped_faces == 0


def test_run_folder__has_the_suite_the_targets_and_whole_lines(run: Run) -> None:
    run("tiny.yaml", "--out", "out")
    info = json.loads(Path("out/run.json").read_text())
    names = [f"construction_{2**31 + i}" for i in range(3)]
    assert (info["format"], info["version"], info["targets"]) == ("autopoly-run", 1, names)
    assert info["suite"]["budget"]["refits"] == 50
    assert sorted(os.listdir("out/targets")) == [f"{name}.png" for name in names]
    assert list(lines("out")[0]) == [
        *("agent", "target", "seed", "r_sm", "r_sc", "r_si", "r_all", "V", "E", "F", "flipped_faces"),
        *("n_actions", "n_refits", "seconds", "stopped_by", "curve", "mesh", "valid", "blocking_in", "moved"),
        *("quads", "ngons", "concave", "effort", "returns", "error"),
    ]
    assert all(line["curve"] for line in lines("out") if line["agent"] == "trace")
    assert not any(line["curve"] for line in lines("out") if line["agent"] == "thrifty")  # on another scale


def test_columns__show_how_the_constructions_read(run: Run) -> None:
    done = run("tiny.yaml", "--out", "out", "--columns", "r_all,quads,effort")
    heads = next(words for line in done.out.splitlines() if (words := line.split()))
    assert heads == ["agent", "shapes", "r_all", "quads", "effort", "won–tied–lost"]
    rows = {row["agent"]: row for row in table("out")}
    for label in LABELS:
        told = [line for line in lines("out") if line["agent"] == label]
        for name in ("quads", "effort", "returns", "concave"):
            assert float(rows[label][name]) == pytest.approx(np.mean([line[name] for line in told]))
    text = Path("out/table.md").read_text()
    assert "| agent | shapes | r_sm |" in text and "| agent | actions | valid | blocking_in | moved | quads |" in text
    refused = run("tiny.yaml", "--out", "other", "--columns", "beauty")
    assert refused.code == 2 and "--columns beauty: 'beauty' is none; give some of all, lesson, r_sm" in refused.err
    assert not Path("other").exists()


def test_table__has_the_means_the_duel_and_what_is_missing_or_printed(run: Run) -> None:
    done = run("tiny.yaml", "--out", "out")
    rows = {row["agent"]: row for row in table("out")}
    assert list(rows) == [*LABELS, "soothsayer"]
    totals = {label: [line["r_all"] for line in lines("out") if line["agent"] == label] for label in LABELS}
    for label in LABELS:
        assert float(rows[label]["r_all"]) == pytest.approx(np.mean(totals[label]))
        assert float(rows[label]["r_all_low"]) <= np.mean(totals[label]) <= float(rows[label]["r_all_high"])
        wins = sum(a > b for a, b in zip(totals[label], totals["trace"], strict=True))
        losses = sum(a < b for a, b in zip(totals[label], totals["trace"], strict=True))
        assert (int(rows[label]["wins"]), int(rows[label]["losses"])) == (wins, losses)
    assert (rows["soothsayer"]["note"], rows["soothsayer"]["r_all"]) == ("no weights yet", "")
    assert rows["dr-simple"]["printed_r_all"] == "62.2"
    for text in (done.out, Path("out/table.md").read_text()):
        assert "(no weights yet)" in text
        assert "62.2†" in text
        assert "not add up to the printed r_all, but to: dr-simple 64.2" in text
    assert done.out.splitlines()[-1] == "Open out/table.md"
    assert all(len(line) <= 132 for line in done.out.splitlines())


def test_row_with_other_weights__searches_with_them(run: Run) -> None:
    run("tiny.yaml", "--out", "out")
    complexity = {label: [line["r_sc"] for line in lines("out") if line["agent"] == label] for label in LABELS}
    assert max(complexity["trace"]) > 9 >= max(complexity["thrifty"])  # not more than a rectangle has


def test_json__prints_the_rows_and_nothing_else(run: Run) -> None:
    done = run("tiny.yaml", "--out", "out", "--json", "--baseline", "random", "--agents", "random,trace")
    rows = [json.loads(line) for line in done.out.splitlines()]
    assert [row["agent"] for row in rows] == ["trace", "random"]  # and not the one that is missing
    assert rows[1]["wins"] == rows[1]["losses"] == 0
    assert rows[0]["shapes"] == 3


@pytest.mark.slow
def test_results__do_not_depend_on_the_engine_or_on_who_takes_part(run: Run) -> None:
    run("tiny.yaml", "--out", "serial", "--set", "seeds=[0, 1]")
    run("tiny.yaml", "--out", "process", "--set", "seeds=[0, 1]", "--engine", "process", "--workers", 2)
    run("tiny.yaml", "--out", "few", "--set", "seeds=[0, 1]", "--agents", "random")
    assert results("serial") == results("process")
    assert table("serial") == table("process")
    few = results("few")
    assert len(few) == 6  # of both seeds; those who do not draw have one
    assert few == {key: value for key, value in results("serial").items() if key[0] == "random"}
    assert len(results("serial")) == 3 * 6


def test_folder__is_measured_with_agents_by_name(run: Run) -> None:
    images("box", "ell")
    done = run("pictures", "--agents", "dr-simple,decimate", "--budget", "refits=20")
    assert done.code == 0
    assert {key[:2] for key in results("out/evaluate/pictures")} == {
        (agent, target) for agent in ("dr-simple", "decimate") for target in ("box", "ell")
    }
    assert sorted(os.listdir("out/evaluate/pictures/targets")) == ["box.png", "ell.png"]


def test_names_of_all_kinds__are_measured_and_shown_tame(run: Run) -> None:
    images("d" * 251, "b\nc\x1b[2J")
    done = run("pictures", "--agents", "dr-simple", "--out", "out")
    assert (done.code, done.err) == (0, "")
    assert {key[1] for key in results("out")} == {"d" * 200, "b\nc\x1b[2J"}
    assert all(line.isprintable() for line in done.out.splitlines())


def test_picture_that_cannot_be_written__is_a_failed_task(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    images("box", "ell")

    def refuse(path: Path, _: bytes) -> None:
        raise OutputError(f"cannot write {path} (File name too long); give a writable path")

    monkeypatch.setattr("training.evaluation.run.write_atomically", refuse)
    done = run("pictures", "--agents", "dr-simple", "--out", "out")
    assert done.code == 1
    assert [line["error"] for line in lines("out")] == [
        f"cannot write out/targets/{name}.png (File name too long); give a writable path" for name in ("box", "ell")
    ]


def test_table__shows_the_rows_that_were_asked_for(run: Run) -> None:
    assert run("tiny.yaml", "--agents", "dr-simple,trace", "--out", "out").code == 0
    shown = run("tiny.yaml", "--agents", "trace", "--out", "out", "--resume", "--json").out
    assert [json.loads(line)["agent"] for line in shown.splitlines()] == ["trace"]
    assert [row["agent"] for row in table("out") if row["shapes"] != "0"] == ["trace", "dr-simple"]


def test_unreadable_image__fails_alone(run: Run) -> None:
    images("a", "b")
    Path("pictures/broken.png").write_bytes(b"\x89PNG\r\n")
    done = run("pictures", "--agents", "dr-simple", "--out", "out")
    assert done.code == 1
    assert done.err.splitlines()[-1] == "1 of 3 tasks failed: out/records.jsonl says why"
    (failed,) = [line for line in lines("out") if line["error"]]
    assert failed["target"] == "broken"
    assert "broken.png" in failed["error"]
    assert failed["r_all"] is None
    assert [row["failed"] for row in table("out") if row["agent"] == "dr-simple"] == ["1"]
    images("broken")  # repaired: what failed is tried again
    assert run("pictures", "--agents", "dr-simple", "--out", "out", "--resume").code == 0
    assert [record.error for record in read_records(Path("out"))] == [None] * 3


def test_dead_worker__is_a_failed_task(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def dying(_: Any, tasks: Iterator[Any], **__: Any) -> Iterator[Done[Any, Any]]:
        yield from (Done(task, None, "its worker died 2 times (signal SIGKILL)") for task in tasks)

    monkeypatch.setattr(evaluate_run, "map_tasks", dying)
    done = run("tiny.yaml", "--agents", "trace", "--out", "out")
    assert (done.code, len(done.err.splitlines())) == (1, 4)
    assert {line["error"] for line in lines("out")} == {"its worker died 2 times (signal SIGKILL)"}


# Runs that are cut off


@pytest.mark.slow
def test_resume__does_what_has_no_record_and_drops_half_a_line(run: Run) -> None:
    run("tiny.yaml", "--out", "whole")
    run("tiny.yaml", "--out", "cut")
    written = Path("cut/records.jsonl").read_bytes()
    kept = b"".join(written.splitlines(keepends=True)[:4])
    Path("cut/records.jsonl").write_bytes(kept + written[len(kept) : len(kept) + 77])
    Path("cut/table.csv").unlink()
    assert len(read_records(Path("cut"))) == 4
    assert run("tiny.yaml", "--out", "cut", "--resume").code == 0
    assert Path("cut/records.jsonl").read_bytes().startswith(kept)
    assert len(lines("cut")) == 15
    assert results("cut") == results("whole")
    assert table("cut") == table("whole")
    assert run("tiny.yaml", "--out", "new", "--resume", "--agents", "trace").code == 0  # nothing there to go on with


@pytest.mark.slow
def test_kill__at_any_moment_loses_and_repeats_nothing(run: Run) -> None:
    Path("tiny.yaml").write_text(SUITE.replace("n: 3", "n: 8"))
    assert run("tiny.yaml", "--out", "whole").code == 0
    command = [sys.executable, "-m", "training.evaluate", "tiny.yaml", "--out", "killed", "--resume", "--quiet"]
    records, before = Path("killed/records.jsonl"), 0
    for n_records in (1, 14, 27):  # the process is killed when it has written that many
        with subprocess.Popen(
            [*command, "--workers", "2"],
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
        ) as process:
            while process.poll() is None and (not records.exists() or len(read_records(records.parent)) < n_records):
                time.sleep(0.002)
            assert process.poll() is None
            process.kill()
        n_records = len(read_records(records.parent))
        assert before < n_records < 40
        before = n_records
    assert run("tiny.yaml", "--out", "killed", "--resume").code == 0
    keys = [(line["agent"], line["target"], line["seed"]) for line in lines("killed")]
    assert len(keys) == len(set(keys)) == 40
    assert results("killed") == results("whole")
    assert table("killed") == table("whole")


def test_run__goes_on_when_a_row_says_something_else_of_what_is_missing(run: Run) -> None:
    assert run("tiny.yaml", "--out", "out", "--set", "targets.n=1").code == 0
    text = Path("tiny.yaml").read_text()
    Path("tiny.yaml").write_text(text.replace("no weights yet", "gone to Delphi"))
    done = run("tiny.yaml", "--out", "out", "--set", "targets.n=1", "--resume")
    assert done.code == 0 and "gone to Delphi" in done.out


def test_rule_of_faces__is_a_key_of_the_suite_that_runs_of_before_have_not(run: Run) -> None:
    assert run("tiny.yaml", "--out", "out", "--agents", "dr-simple").code == 0
    info = json.loads(Path("out/run.json").read_text())
    assert info["suite"].pop("faces") == "any"
    Path("out/run.json").write_text(json.dumps(info))
    assert run("tiny.yaml", "--out", "out", "--agents", "dr-simple", "--resume").code == 0
    done = run("tiny.yaml", "--out", "out", "--agents", "dr-simple", "--faces", "quads", "--resume")
    assert done.code == 1 and '(faces: "any" there, "quads" here)' in done.err
    assert run("tiny.yaml", "--out", "ruled", "--agents", "dr-simple", "--faces", "quads").code == 0


@pytest.mark.slow
def test_ctrl_c__leaves_a_run_to_go_on_with() -> None:
    Path("tiny.yaml").write_text(SUITE.replace("n: 3", "n: 2000"))
    command = [sys.executable, "-m", "training.evaluate", "tiny.yaml", "--out", "out"]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=env, start_new_session=True) as process:
        while process.poll() is None and not Path("out/records.jsonl").exists():
            time.sleep(0.01)
        time.sleep(1.0)
        os.killpg(process.pid, signal.SIGINT)  # to all processes, as a terminal does
        assert process.stderr is not None
        messages = process.stderr.read()
    assert process.returncode == 130
    assert without_pulses(messages) == ["stopped by Ctrl-C; what was done is in out: go on with --resume"]
    assert all(record.error is None for record in read_records(Path("out")))


def test_full_disk__is_one_line_and_keeps_what_was_written(run: Run) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000, before[1]))  # no file may grow larger
    try:
        done = run("tiny.yaml", "--out", "out")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert (done.code, done.out) == (1, "")
    assert done.err == "error: cannot write out/records.jsonl (File too large); make room and go on with --resume\n"
    assert 2 <= len(lines("out")) < 15  # whole ones
    assert Path("out/records.jsonl").read_bytes().endswith(b"\n")
    assert run("tiny.yaml", "--out", "out", "--resume").code == 0
    assert len(lines("out")) == 15


# Runs that are shared out


def test_shards__merge_into_the_whole_run(run: Run) -> None:
    run("tiny.yaml", "--out", "whole")
    for k in (1, 2):
        assert run("tiny.yaml", "--shard", f"{k}/2").code == 0
    parts = ["out/evaluate/tiny-1of2", "out/evaluate/tiny-2of2"]
    assert [len(results(part)) for part in parts] == [10, 5]
    done = run("--merge", *parts, "--out", "merged")
    assert done.code == 0
    assert results("merged") == results("whole")
    assert table("merged") == table("whole")
    assert sorted(os.listdir("merged")) == sorted(os.listdir("whole"))
    assert sorted(os.listdir("merged/targets")) == sorted(os.listdir("whole/targets"))
    assert "2 of 3" in run("--merge", parts[0], "--out", "half").out
    assert run("--merge", *parts, "--out", "half").code == 1  # holds another run
    assert run("--merge", "half", parts[1], "--out", "half").code == 0
    assert results("half") == results("whole")


def test_merge__takes_outcomes_before_failures_and_refuses_other_suites(run: Run) -> None:
    run("tiny.yaml", "--out", "a", "--agents", "trace")
    shutil.copytree("a", "b")
    with RecordWriter(Path("b")) as writer:
        writer.append(Record("trace", read_info(Path("b")).targets[0], 0, None, "broken"))
    for order in (("a", "b"), ("b", "a")):
        assert run("--merge", *order, "--out", "-".join(order)).code == 0
    run("tiny.yaml", "--out", "c", "--budget", "refits=20", "--agents", "trace")
    done = run("--merge", "a", "c", "--out", "x")
    assert (done.code, len(done.err.splitlines())) == (1, 1)
    assert "c holds another suite (budget.refits: 20 there, 50 here)" in done.err
    assert not Path("x").exists()


def test_two_processes__cannot_write_one_run(run: Run) -> None:
    with RecordWriter(Path("out")):
        done = run("tiny.yaml", "--out", "out", "--resume", "--agents", "trace", "--fresh")
        assert done.code == 2
        Path("out/records.jsonl").unlink()
        Path("out/records.jsonl").touch()
    with RecordWriter(Path("out")):
        done = run("tiny.yaml", "--out", "out", "--agents", "trace", "--fresh")
    assert done.err == "error: another process is writing to out; wait for it or give another folder\n"


# What can be wrong


def test_folder_of_another_run__is_refused_in_one_line(run: Run) -> None:
    run("tiny.yaml", "--out", "out", "--agents", "dr-simple")
    before = Path("out/records.jsonl").read_bytes()
    problems = {
        (): "out holds 3 records of this suite already; go on with --resume, begin anew with --fresh",
        ("--set", "targets.n=2", "--resume"): "out holds another suite (targets.n: 3 there, 2 here)",
        ("--set", "weights.w_si=4", "--resume"): "out holds another suite (weights.w_si: 5.0 there, 4.0 here)",
    }
    for options, message in problems.items():
        done = run("tiny.yaml", "--out", "out", "--agents", "dr-simple", *options)
        assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1)
        assert message in done.err
    for version, said in ((2, "has version 2, this program reads 1"), (None, "has version None")):
        info = json.loads(Path("out/run.json").read_text())
        Path("out/run.json").write_text(json.dumps({**info, "version": version}))
        assert said in run("tiny.yaml", "--out", "out", "--resume").err
    info = {"format": "autopoly-run", "version": 1, "suite": info["suite"], "targets": info["targets"]}
    for bad in ("", "{", {"suite": {}}, {"suite": {"agents": [1]}}, {"targets": ["../../up"]}, {"targets": None}):
        text = bad if isinstance(bad, str) else json.dumps({**info, **bad})
        Path("out/run.json").write_text(text)
        done = run("tiny.yaml", "--out", "out", "--resume")
        assert (done.code, len(done.err.splitlines())) == (1, 1)
        assert "out/run.json is damaged" in done.err
    assert Path("out/records.jsonl").read_bytes() == before
    assert run("tiny.yaml", "--out", "out", "--agents", "trace", "--fresh").code == 0
    assert {line["agent"] for line in lines("out")} == {"trace"}


def test_resume__takes_in_further_agents(run: Run) -> None:
    run("tiny.yaml", "--out", "out", "--agents", "trace")
    assert run("tiny.yaml", "--out", "out", "--agents", "decimate", "--resume").code == 0
    assert run("tiny.yaml", "--out", "out", "--agents", "dr-simple", "--resume").code == 0
    assert [row["agent"] for row in table("out") if row["r_all"]] == ["trace", "dr-simple", "decimate"]


def test_broken_record__is_named_by_its_line(run: Run) -> None:
    run("tiny.yaml", "--out", "out", "--agents", "trace")
    good = Path("out/records.jsonl").read_text().splitlines()
    for bad in (
        "{}",
        "x",
        good[0].replace('"r_si": 0', '"r_si": "none"'),
        good[0].replace('"r_all": ', '"r_all": NaN'),
    ):
        Path("out/records.jsonl").write_text("\n".join([good[0], bad, good[1]]) + "\n")
        done = run("tiny.yaml", "--out", "out", "--resume")
        assert (done.code, len(done.err.splitlines())) == (1, 1)
        assert done.err.startswith("error: out/records.jsonl, line 2: no record (")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "Missing argument"),
        (["nobody"], "suite 'nobody' is unknown; give one of folder, modeller, objects, paper, shapenet"),
        (["none.yaml"], "cannot read none.yaml (No such file or directory)"),
        (["tiny.yaml", "--agents", "nobody"], "agent 'nobody' is unknown; give some of trace, random"),
        (["tiny.yaml", "--engine", "dask"], "engine 'dask' is unknown; give one of serial, process, ray"),
        (["tiny.yaml", "--workers", "0"], "0 workers: expected at least 1"),
        (["tiny.yaml", "--ray-address", "auto"], "a Ray address is of no use to the engine 'serial'"),
        (["tiny.yaml", "--budget", "hours=1"], "--budget hours=1: expected refits=N or seconds=N"),
        (["tiny.yaml", "--shard", "0/2"], "--shard '0/2': expected k/n with 1 <= k <= n"),
        (["tiny.yaml", "--set", "targets.n=0"], "suite tiny has no targets"),
        (["tiny.yaml", "--baseline", "nobody"], "baseline 'nobody' is no label of the suite"),
        (["tiny.yaml", "--resume", "--fresh"], "--resume and --fresh: give one of them"),
        (["tiny.yaml", "paper"], "2 suites (tiny.yaml, paper): give one, or --merge to join runs"),
        (["folder"], "this suite needs a folder of images"),
        (["empty"], "directory 'PATH/empty' holds no images"),
    ],
)
def test_wrong_usage__is_one_line_and_writes_nothing(run: Run, arguments: list[str], message: str) -> None:
    Path("empty").mkdir()
    done = run(*arguments)
    assert (done.code, done.out, len(done.err.splitlines())) == (2, "", 1)
    assert message.replace("PATH", os.getcwd()) in done.err
    assert not Path("out").exists()


def test_out__that_cannot_be_written_is_one_line(run: Run) -> None:
    Path("file").touch()
    done = run("tiny.yaml", "--out", "file/out")
    assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1)
    assert done.err.startswith("error: cannot write file/out")


def test_help__shows_examples_and_loads_nothing_heavy() -> None:
    heavy = {"numba", "skimage", "shapely", "ray", "torch"}
    code = f"import sys, training.evaluate as e; e.main(['--help']); assert not {heavy} & set(sys.modules)"
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    shown = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout
    assert "python -m training.evaluate paper --resume" in shown
