"""The command `python -m agents.solve`: what it writes, prints and returns, and what Ctrl-C leaves behind."""

import io
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image
from rich.console import Console

from agents.base import Decision
from agents.baselines.beam import BeamAgent, BeamConfig
from agents.commands.columns import LESSON
from agents.commands.report import FORMATS, WORDS, _tables
from agents.commands.results import RESULTS
from agents.entry import entry_of
from agents.registry import AGENTS
from agents.solve import main
from autopoly_env.mesh import images_of
from autopoly_env.score import ScoreWeights, score
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator, State
from tests.helpers.commands import Run, runner
from tests.helpers.paths import EXAMPLES, ROOT
from tests.helpers.shapes import shapely_coverage

QUICK = ("--resolution", "64")
COLUMNS = ["name", "score", "IoU", "elements", "steps", "big", "first", "refits", "seconds"]  # without what is as usual
RECORD_KEYS = [
    *("image", "name", "agent", "settings", "seed", "r_sm", "r_sc", "r_si", "r_all", "V", "E", "F"),
    *("actions", "valid", "blocking_in", "moved", "quads", "ngons", "concave", "effort", "returns"),
    *("refits", "seconds", "stopped_by", "kept", "notes", "files"),
]


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs the command in this process; gives `code`, `out` and `err`."""
    return runner(main, capsys)


def small_image(path: str, *, box: tuple[int, int, int, int] = (8, 8, 40, 56)) -> Path:
    """A white rectangle on 64 x 64 black pixels."""
    picture = Image.new("L", (64, 64))
    picture.paste(255, box)
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    picture.save(path)
    return Path(path)


def read_obj(path: str) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices (V, 2) with y down, and the faces, read as any other program would."""
    rows = [line.split() for line in Path(path).read_text().splitlines()]
    vertices = np.array([[float(row[1]), 1.0 - float(row[2])] for row in rows if row[0] == "v"])
    return vertices, [[int(v) - 1 for v in row[1:]] for row in rows if row[0] == "f"]


# What is written and printed


@pytest.mark.slow
@pytest.mark.parametrize(("agent", "name"), [("trace", "mug"), ("greedy", "table")])
def test_solve__writes_results_that_agree_with_its_record_and_with_shapely(run: Run, agent: str, name: str) -> None:
    image = EXAMPLES / f"{name}.png"
    done = run(image, "--agent", agent, "--json", "--w-sc", "0.5", *QUICK)
    assert done.code == 0
    (record,) = map(json.loads, done.out.splitlines())
    assert list(record) == RECORD_KEYS
    assert (record["image"], record["name"], record["agent"]) == (str(image), name, agent)
    assert record["files"] == {file: f"out/{name}/{file}" for file in RESULTS}

    vertices, faces = read_obj(record["files"]["mesh.obj"])
    pairs = {frozenset((face[k - 1], v)) for face in faces for k, v in enumerate(face)}
    assert (record["V"], record["E"], record["F"]) == (len(vertices), len(pairs), len(faces))
    assert record["r_sc"] == len(vertices) + len(pairs) + len(faces)
    shape = shapely.union_all([shapely.Polygon(vertices[face]) for face in faces])
    wanted = np.asarray(Image.open(image).convert("L")) > 127
    covered = shapely_coverage(shape, len(wanted)) >= 0.5
    iou = (covered & wanted).sum() / (covered | wanted).sum()
    assert record["r_sm"] == pytest.approx(iou, abs=1e-5)
    assert record["r_all"] == pytest.approx(100 * record["r_sm"] - 0.5 * record["r_sc"] - 5 * record["r_si"])


@pytest.mark.slow
def test_solve__records_a_sequence_that_replays_to_the_mesh(run: Run) -> None:
    done = run(EXAMPLES / "mug.png", "--json", "--seed", 7, *QUICK)
    record = json.loads(done.out)
    sequence = ConstructionSequence.load(record["files"]["sequence.json"])
    mesh = sequence.final()
    assert len(sequence.steps) == record["actions"] > 0
    assert sequence.settings == record["settings"]
    assert (sequence.settings["agent"], sequence.settings["seed"]) == ("quads", 7)
    assert np.allclose(read_obj(record["files"]["mesh.obj"])[0], mesh.vertices)
    target = load_silhouette(EXAMPLES / "mug.png").target(512)
    assert score(mesh, target, ScoreWeights()).total == record["r_all"] == sequence.steps[-1].score["total"]
    assert Path(record["files"]["mesh.svg"]).read_text().startswith("<svg")
    assert min(Image.open(record["files"]["steps.png"]).size) > 200


@pytest.mark.slow
def test_solve__shows_a_table_with_means_and_names_the_overview_last(run: Run) -> None:
    done = run(EXAMPLES / "bottle.png", EXAMPLES / "mug.png", "--out", "deep/results", *QUICK)
    lines = done.out.splitlines()
    assert (done.code, done.err) == (0, "")
    assert COLUMNS in [line.split() for line in lines]
    rows = {line.split()[0]: line.split()[1:] for line in lines if line.strip()}
    totals = [float(rows[name][0]) for name in ("bottle", "mug")]
    assert float(rows["mean"][2]) == pytest.approx(np.mean(totals), abs=0.011)  # after "of 2"
    assert "note: object has 1 hole: mug" in lines
    assert lines[-1] == "Open deep/results/overview.png"
    assert Image.open("deep/results/overview.png").width == 2 * (256 + 64)


def test_solve__takes_the_object_that_the_options_name_and_shows_it(run: Run, tmp_path: Path) -> None:
    picture = Image.new("RGB", (64, 64), "white")
    picture.paste("red", (8, 8, 40, 40))
    picture.paste("blue", (30, 30, 50, 50))
    picture.save(tmp_path / "two.png")
    done = run(tmp_path / "two.png", "--json", "--agent", "trace", "--object", "blue", "--show-mask")
    record = json.loads(done.out)
    assert record["settings"]["picture"] == {"object": "blue"}
    assert (np.asarray(Image.open(record["files"]["mask.png"])) == 0).sum() == 400
    assert load_silhouette(record["files"]["mask.png"]).mask.sum() == 400


def test_solve__counts_what_it_skips_in_a_folder(run: Run, tmp_path: Path) -> None:
    folder = tmp_path / "mixed"
    folder.mkdir()
    Image.new("L", (32, 32), 255).save(folder / "blank.pbm")
    for name in ("a.txt", "b.md", "c.csv", "d.py"):
        (folder / name).touch()
    done = run(folder, "--agent", "trace")
    assert done.code == 1 and "note: 4 files are no pictures and were skipped: a.txt, b.md, c.csv, …" in done.err
    assert "blank.pbm" in done.err


@pytest.mark.parametrize(
    ("options", "finding"),
    [
        (("--object", "reddish"), "object 'reddish' is not known"),
        (("--threshold", 2), "threshold is 2; expected a number between 0 and 1"),
        (("--object", "alpha", "--background", "red"), "leave one of them out"),
        (("--keep-specks", "--min-speck", 3), "contradict each other"),
    ],
)
def test_solve__refuses_options_of_pictures_before_any_work(run: Run, options: tuple[Any, ...], finding: str) -> None:
    done = run(EXAMPLES / "mug.png", *options)
    assert done.code == 2 and finding in done.err and done.err.count("\n") == 1


def test_columns__are_those_that_are_asked_for(run: Run) -> None:
    small_image("box.png")
    small_image("tall.png", box=(20, 4, 40, 60))
    done = run("box.png", "tall.png", "--agent", "trace", "--columns", "r_all,lesson,F", "--quiet")
    heads, *_ = (words for line in done.out.splitlines() if (words := line.split()))
    lesson = ["actions", "valid", "blocking_in", "moved", "quads", "ngons", "concave", "effort", "returns"]
    assert heads == ["name", "r_all", *lesson, "F"]
    rows = {words[0]: words for line in done.out.splitlines() if (words := line.split())}
    assert rows["box"][2:] == ["0", "1.00", rows["box"][4], "0.000", "1.00", "0", "0", "0.0", "0", "1"]
    assert rows["mean"][4:] == ["0.0", "1.00", rows["mean"][6], "0.000", "1.00", "0.0", "0.0", "0.0", "0.00", "1.0"]


NUMBERS = {name: 1234.5 for name in FORMATS}


@pytest.mark.parametrize("columns", [(), tuple(FORMATS), LESSON])
@pytest.mark.parametrize("name", ["mug", "a-name-that-goes-on-and-on-until-it-fills-a-line-of-its-own"])
def test_tables__cut_nothing_at_80_columns(columns: tuple[str, ...], name: str) -> None:
    console = Console(width=80, file=io.StringIO())
    for table in _tables({name: NUMBERS, "b": NUMBERS}, columns, 80):
        console.print(table)
    printed = console.file.getvalue()  # type: ignore[attr-defined]
    assert "…" not in printed and max(map(len, printed.splitlines())) <= 80
    shown = columns or WORDS.values()
    heads = [line for line in printed.splitlines() if line.strip().startswith("name")]
    assert " ".join(" ".join(heads).split()).replace("name ", "") == " ".join(shown)
    texts = [format(1234.5, FORMATS[column][0]) for column in columns or WORDS]
    rows = [line.split()[1:] for line in printed.splitlines() if line.strip().startswith("b ")]
    assert [text for row in rows for text in row] == texts


def test_table__leaves_out_what_is_as_usual() -> None:
    usual = {**NUMBERS, "r_si": 0.0, "valid": 1.0, "moved": 0.0}
    (table,) = _tables({"a": usual, "b": usual}, (), 100)
    assert [str(column.header) for column in table.columns][1:] == [
        word for name, word in WORDS.items() if name not in ("r_si", "valid", "moved")
    ]
    tables = _tables({"a": usual, "b": {**usual, "moved": 0.1}}, (), 120)
    assert "moved" in [str(column.header) for table in tables for column in table.columns]


@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_help__fits_a_screen_and_names_six_options_and_the_rest_is_under_headings(run: Run, flag: str) -> None:
    lines = run(flag).out.splitlines()
    assert len(lines) <= 40 and max(map(len, lines)) <= 80
    options = [line.split()[0] for line in lines if line.startswith("  --")]
    assert options == ["--style", "--w-sc", "--agent", "--seconds", "--object", "--out"]
    whole = run("--help-all").out
    assert all(option in whole for option in (*options, "--refits", "--symmetry", "--threshold", "--columns"))
    for heading in ("What is built", "Weights and limits", "Guidance", "What in a picture is the object", "Output"):
        assert heading in whole


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ("r_all,beauty", "--columns r_all,beauty: 'beauty' is none; give some of all, lesson, r_sm, r_sc"),
        ("moved,lesson", "--columns moved,lesson: moved stands there twice; name it once"),
    ],
)
def test_columns__that_are_none_are_refused_before_the_work(run: Run, columns: str, reason: str) -> None:
    small_image("box.png")
    done = run("box.png", "--columns", columns)
    assert done.code == 2 and reason in done.err
    assert not Path("out").exists()


@pytest.mark.slow
def test_solve__of_one_image_names_its_sheet_and_writes_no_overview(run: Run) -> None:
    small_image("box.png")
    done = run("box.png")
    assert done.out.splitlines()[-1] == "Open out/box/steps.png"
    assert "mean" not in done.out
    assert sorted(os.listdir("out")) == ["box"]
    assert sorted(os.listdir("out/box")) == sorted(RESULTS)


@pytest.mark.slow
def test_quiet__leaves_the_table_and_the_warnings(run: Run) -> None:
    small_image("box.png")
    Image.radial_gradient("L").save("photo.png")
    done = run("box.png", "photo.png", "--quiet")
    assert done.err == ""
    assert "note:" not in done.out
    assert "warning: photo.png: the light is uneven" in done.out


@pytest.mark.slow
def test_json__prints_nothing_else_on_stdout(run: Run) -> None:
    small_image("pictures/b.png")
    small_image("pictures/a.png")
    done = run("pictures", "missing.png", "--json")
    records = [json.loads(line) for line in done.out.splitlines()]
    assert [record["image"] for record in records] == ["missing.png", "pictures/a.png", "pictures/b.png"]
    assert "matches no image" in records[0]["error"]
    assert done.err.splitlines() == [f"error: {records[0]['error']}", "Open out/overview.png"]


@pytest.mark.slow
def test_images__of_the_same_name_get_folders_of_their_own(run: Run) -> None:
    images = [small_image("a/box.png"), small_image("b/box.png", box=(4, 4, 20, 20)), small_image("box-2.png")]
    done = run(*images)
    assert sorted(os.listdir("out")) == ["box", "box-2", "box-2-2", "overview.png"]
    assert "warning: b/box.png: called box-2 here, for a/box.png has its name, too" in done.out
    areas = [shapely.Polygon(read_obj(f"out/{name}/mesh.obj")[0]).area for name in ("box", "box-2", "box-2-2")]
    assert areas == pytest.approx([32 * 48 / 64**2, (16 / 64) ** 2, 32 * 48 / 64**2], rel=0.1)


@pytest.mark.slow
def test_image__named_twice_is_solved_once(run: Run) -> None:
    small_image("a/box.png")
    assert len(run("a", "a/box.png", "a/*.png", "--json").out.splitlines()) == 1


@pytest.mark.slow
def test_results__do_not_depend_on_threads_or_on_the_images_before(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    images = [EXAMPLES / "table.png", EXAMPLES / "bottle.png"]
    options = ("--resolution", "64", "--refits", "150", "--seed", "3")
    for agent in ("random", "beam"):
        monkeypatch.setenv("AUTOPOLY_THREADS", "1")
        assert run(*images, "--agent", agent, *options, "--out", "one").code == 0
        monkeypatch.setenv("AUTOPOLY_THREADS", "2")
        assert run(*reversed(images), "--agent", agent, *options, "--out", "two").code == 0
        for name in ("table", "bottle"):
            assert Path(f"one/{name}/sequence.json").read_bytes() == Path(f"two/{name}/sequence.json").read_bytes()


def test_option__reaches_the_agent_and_wins_over_the_seed(run: Run) -> None:
    small_image("box.png")
    done = run("box.png", "--agent", "random", "--option", "n_steps=2", "--option", "seed=5", "--json", *QUICK)
    settings = json.loads(done.out)["settings"]
    assert settings["options"] == {"n_steps": 2, "seed": 5}
    assert settings["seed"] == 5


@pytest.mark.slow
def test_option__may_be_a_list_without_quotes_inside(run: Run) -> None:
    small_image("box.png")
    done = run("box.png", "--option", "seeds=[trace]", "--option", "hop_patience=0", "--json", *QUICK)
    assert json.loads(done.out)["settings"]["options"] == {"seeds": ["trace"], "hop_patience": 0}


def test_max_steps_and_refits__limit_the_work(run: Run) -> None:
    done = run(EXAMPLES / "chair.png", "--agent", "greedy", "--max-steps", 1, "--json", *QUICK)
    assert json.loads(done.out)["actions"] == 1
    done = run(EXAMPLES / "chair.png", "--agent", "greedy", "--refits", 1, "--json", *QUICK)
    assert json.loads(done.out)["stopped_by"] == "refits"


# What can be wrong


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "Missing argument"),
        (["box.png", "--agnet", "trace"], "No such option: --agnet"),
        (["box.png", "--agent", "nobody"], "agent 'nobody' is unknown; give one of random, greedy"),
        (["box.png", "--operators", "paper,edge_melt"], "edge_melt"),
        (["box.png", "--resolution", "four"], "--resolution"),
        (["box.png", "--resolution", "4"], "expected 8 to 1024"),
        (["box.png", "--w-sc", "-1"], "w_sc = -1.0"),
        (["box.png", "--refits", "-1"], "a budget of -1 refits"),
        (["box.png", "--max-steps", "-1"], "max_steps=-1"),
        (["box.png", "--option", "width"], "--option width: expected key=value, such as width=4"),
        (["box.png", "--option", "width=[4"], "--option width=[4: the value is not YAML"),
        (["box.png", "--option", "name=3"], "agent 'mcts' has no option 'name'"),
        (["box.png", "--option", "width=3"], "agent 'mcts' has no option 'width'"),
        (["box.png", "--agent", "beam", "--option", "width=wide"], "option width"),
        (["box.png", "--agent", "beam", "--option", "width=0"], "width"),
        (["box/steps.png", "box.png", "--out", "."], "would overwrite the image box/steps.png"),
        (["overview.png", "--out", "."], "would overwrite the image overview.png"),
    ],
)
def test_wrong_usage__is_one_line_and_exit_code_2(run: Run, arguments: list[str], message: str) -> None:
    for image in ("box.png", "overview.png", "box/steps.png"):
        small_image(image)
    done = run(*arguments)
    assert (done.code, done.out, len(done.err.splitlines())) == (2, "", 1)
    assert done.err.startswith("error: ")
    assert message in done.err
    assert not Path("out").exists()


@pytest.mark.slow
def test_bad_images__are_reported_one_by_one_and_stop_nothing(run: Run) -> None:
    small_image("good.png")
    Path("cut.png").write_bytes((EXAMPLES / "chair.png").read_bytes()[:700])
    Path("text.png").write_text("no image")
    Image.new("L", (64, 64)).save("black.png")
    Path("empty").mkdir()
    done = run("missing.png", "none*.png", "empty", "cut.png", "text.png", "black.png", "good.png", *QUICK)
    problems = done.err.splitlines()
    assert done.code == 1
    for problem, bad in zip(problems, ["missing", "none*", "empty", "cut", "text", "black"], strict=True):
        assert problem.startswith("error: ")
        assert bad in problem
    assert os.listdir("out") == ["good"]
    assert "Traceback" not in done.out + done.err


def test_out__that_cannot_be_written_is_found_out_before_the_work(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    small_image("box.png")
    monkeypatch.setattr("agents.commands.solving.load_silhouette", lambda *_, **__: pytest.fail("the work has begun"))
    Path("file").write_text("")
    done = run("box.png", "--out", "file/out")
    assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1)
    assert done.err.startswith("error: cannot write to the folder file/out")


@pytest.mark.slow
def test_failed_write__leaves_nothing_behind(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    small_image("box.png")
    small_image("other.png")
    assert run("box.png").code == 0
    before = {file: Path(f"out/box/{file}").read_bytes() for file in RESULTS}

    def full_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("agents.commands.results.save_png", full_disk)
        done = run("box.png", "other.png", "--w-sc", "3")
    assert done.code == 1
    for line, name in zip(done.err.splitlines(), ("box", "other"), strict=True):
        assert line.startswith(f"error: {name}.png: cannot write the results to out/{name} (No space left on device)")
    assert {file: Path(f"out/box/{file}").read_bytes() for file in RESULTS} == before
    assert os.listdir("out") == ["box"]


@pytest.mark.slow
def test_stdout__that_takes_nothing_more_is_one_line(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    small_image("box.png")

    class Full:
        encoding = "utf-8"

        def write(self, _: str) -> None:
            raise OSError(28, "No space left on device")

        def flush(self) -> None: ...

        def isatty(self) -> bool:
            return False

    for arguments in (["box.png"], ["box.png", "--json"]):
        monkeypatch.setattr(sys, "stdout", Full())
        done = run(*arguments)
        assert done.code == 1
        assert done.err == "error: cannot print the results (No space left on device); give them another place to go\n"


# Agents that misbehave on purpose, and Ctrl-C


@pytest.fixture
def agent_that(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[Callable[[State], Any]], None]]:
    """Registers `probe`: a greedy agent that calls a function of the state before every step."""

    def register(does: Callable[[State], Any]) -> None:
        class Probe(BeamAgent):
            def _search(self, simulator: Simulator, track: Any, meter: Any) -> Any:
                return super(BeamAgent, self)._search(simulator, track, meter)  # step by step

            def act(self, simulator: Simulator, state: State) -> Decision:
                does(state)
                return super().act(simulator, state)

        monkeypatch.setitem(AGENTS, "probe", entry_of(lambda: Probe(BeamConfig(width=1)), "probe"))

    yield register


def press_ctrl_c() -> None:
    os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize("error", [MemoryError("Unable to allocate 3 GiB"), ValueError("two\nlines"), RecursionError()])
def test_unexpected_error__is_one_line_with_its_type(run: Run, agent_that: Any, error: Exception) -> None:
    def fail(_: State) -> None:
        raise error

    agent_that(fail)
    small_image("box.png")  # is matched by the initial rectangle: the agent is not asked
    done = run(EXAMPLES / "chair.png", "box.png", "--agent", "probe", *QUICK)
    assert (done.code, len(done.err.splitlines())) == (1, 1)
    assert done.err.startswith(f"error: {EXAMPLES / 'chair.png'}: {type(error).__name__}: ")
    assert os.listdir("out") == ["box"]


def test_ctrl_c_in_a_search__writes_the_best_so_far_and_stops(run: Run, agent_that: Any) -> None:
    agent_that(lambda state: press_ctrl_c() if state.step == 2 else None)
    shutil.copy(EXAMPLES / "chair.png", "chair.png")
    small_image("later.png")
    done = run("chair.png", "later.png", "--agent", "probe", "--json", *QUICK)
    (record,) = map(json.loads, done.out.splitlines())
    assert done.code == 130
    assert (record["stopped_by"], record["actions"]) == ("interrupted", 2)
    assert len(ConstructionSequence.load("out/chair/sequence.json").steps) == 2
    assert sorted(os.listdir("out/chair")) == sorted(RESULTS)
    assert "stopped by Ctrl-C: 1 of 2 images left" in done.err


@pytest.mark.slow
def test_ctrl_c_outside_a_search__waits_until_the_image_is_written(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted_sheet(*_: object) -> Image.Image:
        press_ctrl_c()
        return Image.new("RGB", (300, 300))

    monkeypatch.setattr("agents.commands.results.contact_sheet", interrupted_sheet)
    done = run(small_image("a.png"), small_image("b.png"), small_image("c.png"))
    assert done.code == 130
    assert sorted(os.listdir("out/a")) == sorted(RESULTS)
    assert sorted(os.listdir("out")) == ["a"]
    assert "stopped by Ctrl-C: 2 of 3 images left" in done.err
    assert done.out.splitlines()[-1] == "Open out/a/steps.png"


@pytest.mark.slow
def test_ctrl_c_while_an_image_loads__leaves_that_image(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted_load(path: Path, **options: Any) -> Any:
        press_ctrl_c()
        return load_silhouette(path, **options)

    monkeypatch.setattr("agents.commands.solving.load_silhouette", interrupted_load)
    done = run(small_image("a.png"), small_image("b.png"))
    assert (done.code, done.out, os.listdir("out")) == (130, "", [])
    assert "stopped by Ctrl-C: 2 of 2 images left" in done.err


@pytest.mark.slow
def test_second_ctrl_c__aborts_and_leaves_nothing_half_written(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def impatient_sheet(*_: object) -> Image.Image:
        press_ctrl_c()
        press_ctrl_c()
        pytest.fail("the second Ctrl-C was not heard")

    handler = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr("agents.commands.results.contact_sheet", impatient_sheet)
    done = run(small_image("a.png"), small_image("b.png"))
    assert (done.code, done.out, os.listdir("out")) == (130, "", [])
    assert "aborted" in done.err
    assert signal.getsignal(signal.SIGINT) is handler


@pytest.mark.slow
def test_second_ctrl_c__waits_while_files_are_moved_into_place(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def impatient_replace(source: Path, goal: Path) -> None:
        press_ctrl_c()
        real_replace(source, goal)

    real_replace = os.replace
    monkeypatch.setattr("agents.commands.results.os", SimpleNamespace(**{**vars(os), "replace": impatient_replace}))
    done = run(small_image("a.png"), small_image("b.png"))
    assert done.code == 130
    assert (os.listdir("out"), sorted(os.listdir("out/a"))) == (["a"], sorted(RESULTS))


@pytest.mark.slow
def test_ctrl_c_in_the_shell__leaves_finished_images_whole() -> None:
    for k in range(40):
        small_image(f"pictures/{k:02}.png", box=(8, 8, 20 + k, 56))
    command = [sys.executable, "-m", "agents.solve", "pictures", "--json", *QUICK]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        first = [process.stdout.readline() for _ in range(2)]
        process.send_signal(signal.SIGINT)
        records = [json.loads(line) for line in (*first, *process.stdout.read().splitlines())]
        messages = process.stderr.read()
    assert process.returncode == 130
    assert 2 <= len(records) < 40
    assert f"stopped by Ctrl-C: {40 - len(records)} of 40 images left" in messages
    assert sorted(os.listdir("out")) == sorted([*(record["name"] for record in records), "overview.png"])
    for record in records:
        assert sorted(os.listdir(f"out/{record['name']}")) == sorted(RESULTS)
        assert ConstructionSequence.load(record["files"]["sequence.json"]).final().counts == (
            record["V"],
            record["E"],
            record["F"],
        )
    assert not list(Path("out").rglob("*.tmp"))


def test_simulations__limit_a_tree_search_and_are_refused_by_others(run: Run) -> None:
    image = EXAMPLES / "chair.png"
    done = run(image, "--agent", "mcts", "--option", "seeds=[]", "--simulations", 0, "--json", *QUICK)
    assert json.loads(done.out)["stopped_by"] == "simulations"
    refused = run(image, "--agent", "trace", "--simulations", 3)
    assert refused.code == 2 and "trace runs no simulations" in refused.err


# Styles


@pytest.mark.slow
def test_style__brings_agent_operators_and_rule_unless_they_are_given(run: Run) -> None:
    image = EXAMPLES / "key.png"
    quick = ("--refits", 60, "--json", "--quiet")
    told = json.loads(run(image, "--style", "modeller", *quick).out)
    assert told["agent"] == "quads" and told["settings"]["faces"] == "quads"
    sequence = ConstructionSequence.load(Path(told["files"]["sequence.json"]))
    assert {len(face) for face in sequence.final().faces} <= {3, 4}
    assert "edge_extrude" in {step.operator for step in sequence.steps}
    other = json.loads(run(image, "--style", "modeller", "--agent", "greedy", "--faces", "convex", *quick).out)
    assert other["agent"] == "greedy" and other["settings"]["faces"] == "convex"
    assert json.loads(run(image, "--agent", "trace", *quick).out)["settings"].get("faces", "any") == "any"


@pytest.mark.slow
def test_style__is_the_modellers_unless_another_way_is_named(run: Run) -> None:
    image, quick = EXAMPLES / "bottle.png", ("--refits", 60, "--json", "--quiet")
    alone = json.loads(run(image, *quick).out)["settings"]
    assert (alone["agent"], alone["faces"], alone["align"]) == ("quads", "quads", True)
    named = json.loads(run(image, "--operators", "full", *quick).out)["settings"]
    assert (named["agent"], named.get("faces", "any"), "align" in named) == ("mcts", "any", False)
    chosen = json.loads(run(image, "--style", "modeller", "--agent", "greedy", "--no-align", *quick).out)["settings"]
    assert (chosen["agent"], chosen["faces"], "align" in chosen, "symmetry" in chosen) == (
        "greedy", "quads", False, False,
    )  # fmt: skip


@pytest.mark.slow
def test_symmetric_picture__is_built_so_and_said_to_be(run: Run) -> None:
    mask = np.zeros((64, 64), np.bool_)
    mask[10:20, 8:56] = mask[20:50, 12:18] = mask[20:50, 46:52] = True
    Image.fromarray(mask).save("table.png")
    said = " ".join(run("table.png", "--refits", 60).out.split())
    assert "left and right are alike (0.0% differ): built so about x = 0.5 (--symmetry off)" in said
    sequence = ConstructionSequence.load(Path("out/table/sequence.json"))
    assert sequence.settings["symmetry"] == 0.5 and images_of(sequence.final(), 0.5) is not None
    run("table.png", "--refits", 60, "--symmetry", "off")
    assert "symmetry" not in ConstructionSequence.load(Path("out/table/sequence.json")).settings


def test_style__that_is_none_and_operators_that_are_missing_are_told_before_the_work(run: Run) -> None:
    refused = run(EXAMPLES / "key.png", "--style", "cubist")
    assert refused.code == 2 and "--style cubist: expected one of modeller, paper" in refused.err
    refused = run(EXAMPLES / "key.png", "--style", "modeller", "--operators", "full")
    assert refused.code == 2 and "edge_cap is not among the operators: give the preset modeller" in refused.err


# The help


def test_help__names_every_agent_and_loads_nothing_heavy() -> None:
    heavy = {"numba", "skimage", "shapely", "torch", "pydantic"}
    code = f"import sys, agents.solve; agents.solve.main(['--help-all']); assert not {heavy} & set(sys.modules)"
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    shown = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout
    assert set(AGENTS) <= set(shown.replace(",", " ").replace(".", " ").split())
    assert "python -m agents.solve examples" in shown
    assert "[default: 128]" in shown
