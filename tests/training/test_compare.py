"""The command `python -m training.compare`: its numbers, what it does with bad runs, and the page in a real browser."""

import csv
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from autopoly_env.mesh import PolyMesh
from tests.helpers.browser import Browser, Page, needs_browser
from tests.helpers.commands import Run, runner
from training.compare import main
from training.records import MeshData, Outcome, Record, RunInfo, target_path
from training.report.axes import x_axis, y_axis
from training.report.comparison import read_runs, rows_of
from training.report.gallery import worst_cards
from training.report.lessons import is_told, lessons_markdown
from training.report.statistics import bootstrap_mean

NASTY = '</script><b>"it\'s" & `${1}`\n|x|'


def outcome(r_all: float, *, r_sm: float = 0.9, r_sc: int = 9, r_si: int = 0, refits: int = 10) -> Outcome:
    """A square over the middle of the picture, found after some refits; half of its score was there after one."""
    mesh = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    curve = [(1, 0.01, r_all / 2), (refits, 0.1, r_all)]
    return Outcome(r_sm, r_sc, r_si, r_all, 4, 4, 1, 0, 0, refits, 0.1, "finished", curve, MeshData.of(mesh))


def write_run(folder: Path, records: list[Record], suite: dict[str, Any] | None = None) -> Path:
    """A run as training.evaluate writes it; every target is the lower half of the picture."""
    folder.mkdir(parents=True)
    targets = tuple(dict.fromkeys(record.target for record in records if not set(record.target) & set("/\0")))
    RunInfo({"agents": []} | (suite or {}), targets).write(folder)
    (folder / "records.jsonl").write_text("".join(record.to_json() + "\n" for record in records))
    (folder / "targets").mkdir()
    for target in targets:
        Image.fromarray(np.arange(32)[:, None].repeat(32, axis=1) >= 16).save(target_path(folder, target))
    return folder


def records_of(agent: str, totals: dict[str, float], **more: Any) -> list[Record]:
    return [Record(agent, target, 0, outcome(total, **more)) for target, total in totals.items()]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs the command in this process, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return runner(main, capsys)


# --- numbers


def test_rows__count_wins_ties_and_losses_on_the_targets_of_both(tmp_path: Path) -> None:
    base = records_of("base", {"a": 10.0, "b": 20.0, "c": 30.0, "only here": 99.0})
    other = records_of("other", {"a": 12.0, "b": 20.0, "c": 25.0, "only there": 1.0})
    comparison = read_runs([write_run(tmp_path / "run", base + other)], "base")
    first, second = rows_of(comparison)
    assert first.is_baseline and first.lead is None
    assert (second.wins, second.ties, second.losses) == (1, 1, 1)
    assert second.lead is not None and second.lead.mean == pytest.approx(-1.0)  # (2 + 0 - 5) / 3
    assert second.n_targets == 4
    assert second.means["r_all"].mean == pytest.approx(14.5)
    assert sum("1 of 5 targets are missing" in note for note in comparison.notes) == 2


def test_rows__take_several_seeds_of_a_target_as_one(tmp_path: Path) -> None:
    records = [replace(record, seed=seed) for seed in range(3) for record in records_of("a", {"x": 10.0 * seed})]
    (row,) = rows_of(read_runs([write_run(tmp_path / "run", records)]))
    assert row.n_targets == 1
    assert row.means["r_all"] == pytest.approx((10.0, 10.0, 10.0))  # one target has no spread


def test_rows__let_a_failure_lose_and_leave_it_out_of_the_means(tmp_path: Path) -> None:
    records = records_of("base", {"x": 1.0, "y": 2.0})
    records += [Record("weak", "x", 0, None, "out of memory"), *records_of("weak", {"y": 5.0})]
    comparison = read_runs([write_run(tmp_path / "run", records)])
    row = rows_of(comparison)[1]
    assert (row.wins, row.ties, row.losses, row.n_failed) == (1, 0, 1, 1)
    assert row.means["r_all"].mean == 5.0
    assert any(note.startswith("weak: 1 failed") for note in comparison.notes)


def test_interval__holds_the_mean_of_what_the_values_were_drawn_from() -> None:
    """95 % of such intervals hold it: of 60, fewer than 50 would be strange (1 in 3000)."""
    rng = np.random.default_rng(3)
    intervals = [bootstrap_mean(rng.normal(50.0, 10.0, 40)) for _ in range(60)]
    assert 50 <= sum(low <= 50.0 <= high for _, low, high in intervals) < 60


def test_labels__of_agents_that_several_runs_have_name_the_run(tmp_path: Path) -> None:
    folders = [
        write_run(tmp_path / "x" / "run", records_of("climb", {"a": 1.0}) + records_of("beam", {"a": 1.0})),
        write_run(tmp_path / "y" / "run", records_of("climb", {"a": 2.0})),
    ]
    labels = [series.label for series in read_runs([*folders, folders[0]]).series]
    assert labels == ["climb (x/run)", "beam", "climb (y/run)"]


def test_suites__that_differ_are_told_but_not_in_their_agents(tmp_path: Path) -> None:
    a, b = records_of("a", {"x": 1.0}), records_of("b", {"x": 1.0})
    one = write_run(tmp_path / "one", a, {"resolution": 64, "agents": [{"label": "a"}]})
    same = write_run(tmp_path / "same", b, {"resolution": 64, "agents": [{"label": "b"}]})
    other = write_run(tmp_path / "other", b, {"resolution": 128})
    assert read_runs([one, same]).notes == ()
    (note,) = read_runs([one, other]).notes
    assert note.startswith("other was run with another suite than one (differs in resolution)")


def test_baseline__is_that_of_the_suite_unless_another_is_wanted(tmp_path: Path) -> None:
    records = records_of("a", {"x": 1.0}) + records_of("b", {"x": 1.0})
    folder = write_run(tmp_path / "run", records, {"baseline": "b"})
    assert read_runs([folder]).baseline == 1
    assert read_runs([folder], "a").baseline == 0


def test_series__come_as_the_suite_has_them_in_whatever_order_they_were_done(tmp_path: Path) -> None:
    records = records_of("b", {"x": 1.0}) + records_of("new", {"x": 1.0}) + records_of("a", {"x": 1.0})
    suite = {"agents": [{"label": "a"}, {"label": "not run"}, {"label": "b"}]}
    series = read_runs([write_run(tmp_path / "run", records, suite)]).series
    assert [one.label for one in series] == ["a", "b", "new"]


@pytest.mark.slow
def test_gallery__takes_the_worst_of_each_agent_in_turn(tmp_path: Path) -> None:
    good = {f"t{k}": 90.0 for k in range(50)}
    first = records_of("first", good | {"t7": 10.0, "t8": 11.0})
    second = records_of("second", good | {"t30": 50.0})
    cards = worst_cards(read_runs([write_run(tmp_path / "run", first + second)]), 3)
    assert [card.target for card in cards] == ["t7", "t8", "t30"]


def test_axis__places_by_the_logarithm_and_keeps_what_is_beyond_at_its_end() -> None:
    x = x_axis(1.0, 100.0, is_log=True)
    assert x.place(10.0) == pytest.approx((x.start + x.end) / 2)
    assert x.place(1e6) == x.end
    assert set(x.ticks()) >= {1.0, 10.0, 100.0}
    assert y_axis(0.0, 1.0).ticks() == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    assert x_axis(-0.5, 1.5, is_whole=True).ticks() == [0.0, 1.0]
    assert len(x_axis(3.0, 3.0).ticks()) > 1


def test_lessons__are_means_over_the_targets_of_which_they_are_known(tmp_path: Path) -> None:
    told = [replace(outcome(50.0), effort=seconds, returns=0, quads=1.0) for seconds in (10.0, 20.0)]
    records = [Record("a", name, 0, one) for name, one in zip("xy", told, strict=True)]
    records += records_of("a", {"z": 50.0}) + records_of("older", {"x": 1.0, "y": 2.0})
    first, older = rows_of(read_runs([write_run(tmp_path / "run", records)]))
    assert first.means["effort"].mean == 15.0 and first.means["quads"] == pytest.approx((1.0, 1.0, 1.0))
    assert np.isnan(first.means["moved"].mean) and np.isnan(older.means["effort"].mean)
    assert first.means["actions"].mean == 0.0
    assert [is_told(row) for row in (older, first)] == [False, True]
    assert lessons_markdown([older]) == ""
    heads, _, line = lessons_markdown([older, first]).splitlines()[-3:]
    cells = dict(zip(heads.split(" | "), line.split(" | "), strict=True))
    assert (cells["| agent"], cells["effort"], cells["moved"], cells["quads"]) == ("| a", "15.0", "–", "1.00")


# --- the command


def test_compare__writes_page_markdown_and_csv_that_agree(run: Run, tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", records_of("a", {"x": 10.0, "y": 30.0}) + records_of("b|c", {"x": 1.0}))
    said = run(folder, "--out", "deep/report.html", "--baseline", "b|c")
    assert said.code == 0
    assert said.out.splitlines()[-1] == "Open deep/report.html"
    with open("deep/report.csv", newline="") as stream:
        first, second = csv.DictReader(stream)
    assert (first["agent"], float(first["r_all"]), first["wins"], first["lead"]) == ("a", 20.0, "1", "9.0")
    assert (second["agent"], second["targets"], second["lead"]) == ("b|c", "1", "")
    text = Path("deep/report.md").read_text()
    assert "| a | 2 | 0 |" in text and "| b\\|c | 1 | 0 |" in text and "20.00 [10.00, 30.00]" in text
    page = Path("deep/report.html").read_text()
    assert "20.00" in page and "b|c" in page and "http" not in page.replace("http-equiv", "")


def test_report__tells_how_constructions_read_where_records_do(run: Run, tmp_path: Path) -> None:
    write_run(tmp_path / "older", records_of("a", {"x": 10.0}))
    assert run("older", "--out", "older.html").code == 0
    assert "How the constructions read" not in Path("older.html").read_text() + Path("older.md").read_text()
    told = [Record("a", "x", 0, replace(outcome(10.0), effort=46.07, returns=3, quads=0.5))]
    write_run(tmp_path / "newer", told)
    assert run("newer", "--out", "newer.html").code == 0
    assert "46.1<small>46.1 … 46.1</small>" in Path("newer.html").read_text()
    assert "| 46.1 | 3.00 |" in Path("newer.md").read_text()
    record = json.loads(run("newer", "--json").out)
    assert (record["effort"], record["returns"], record["concave"]) == (46.07, 3.0, None)


def test_json__prints_a_record_an_agent(run: Run, tmp_path: Path) -> None:
    write_run(tmp_path / "run", records_of("a", {"x": 10.0}) + [Record("b", "x", 0, None, "no")])
    said = run("run", "--json")
    first, second = map(json.loads, said.out.splitlines())
    assert (first["agent"], first["r_all"], first["r_all_low"]) == ("a", 10.0, 10.0)
    assert (second["agent"], second["r_all"], second["failed"]) == ("b", None, 1)
    assert "warning: b: 1 failed" in said.err


def test_half_line_at_the_end__is_left_out(run: Run, tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", records_of("a", {"x": 10.0, "y": 20.0}))
    lines = (folder / "records.jsonl").read_text()
    (folder / "records.jsonl").write_text(lines[:-40])
    said = run("run", "--json")
    assert said.code == 0
    assert json.loads(said.out)["r_all"] == 10.0


def spoil(folder: Path, name: str, text: str) -> None:
    (folder / name).write_text(text)


@pytest.mark.parametrize(
    ("harm", "code", "message"),
    [
        (lambda run: (run / "run.json").unlink(), 1, "run.json"),
        (lambda run: spoil(run, "run.json", '{"format": "autopoly-run", "version": 99}'), 1, "version 99"),
        (lambda run: spoil(run, "run.json", "{"), 1, "run.json"),
        (lambda run: spoil(run, "records.jsonl", ""), 1, "no records"),
        (lambda run: (run / "records.jsonl").unlink(), 1, "no records"),
        (lambda run: spoil(run, "records.jsonl", "half a\n"), 1, "line 1"),
    ],
)
def test_bad_run__is_one_line_and_nothing_written(
    run: Run, tmp_path: Path, harm: Callable[[Path], object], code: int, message: str
) -> None:
    harm(write_run(tmp_path / "run", records_of("a", {"x": 1.0})))
    said = run("run")
    assert (said.code, said.out, len(said.err.splitlines())) == (code, "", 1)
    assert said.err.startswith("error: ")
    assert message in said.err
    assert not Path("report.html").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["nowhere"], 1, "nowhere"),
        ([], 2, "Missing argument"),
        (["run", "--baseline", "b"], 2, "baseline 'b' is not among what is compared; give one of a"),
        (["run", "--out", "report.txt"], 2, "ends in .html"),
        (["run", "--gallery", "-1"], 2, "--gallery -1"),
        (["run", "--out", "run/run.json/x.html"], 1, "cannot write"),
    ],
)
def test_wrong_usage__is_one_line(run: Run, tmp_path: Path, arguments: list[str], code: int, message: str) -> None:
    write_run(tmp_path / "run", records_of("a", {"x": 1.0}))
    said = run(*arguments)
    assert (said.code, len(said.err.splitlines())) == (code, 1)
    assert message in said.err


def test_picture__outside_the_run_is_not_read(run: Run, tmp_path: Path) -> None:
    write_run(tmp_path / "run", records_of("a", {"../../secret": 1.0, "fine": 1.0}))
    Image.new("1", (32, 32), 1).save(tmp_path / "secret.png")
    assert run("run").code == 0
    page = Path("report.html").read_text()
    assert page.count("data:image/png") == 1
    assert page.count("the picture of this target is missing") == 1


# --- the page, in a browser


def names(page: Page, selector: str) -> list[str]:
    """The texts of all shown elements."""
    shown = f"[...document.querySelectorAll({json.dumps(selector)})].filter(e => e.getClientRects().length)"
    found: list[str] = page.evaluate(f"{shown}.map(e => e.textContent.trim())")
    return found


@pytest.fixture
def page(browser: Browser, run: Run, tmp_path: Path) -> Iterator[Page]:
    """Three agents, one of which fails once; `b` is worst on x and `a` on y."""
    records = records_of("a", {"x": 50.0, "y": 10.0, "z": 80.0}, refits=100)
    records += records_of("b", {"x": 20.0, "y": 60.0, "z": 81.0}, r_si=2, r_sc=30)
    records += [*records_of("c", {"x": 40.0, "y": 70.0}), Record("c", "z", 0, None, "no <memory>")]
    write_run(tmp_path / "run", records)
    assert run("run").code == 0
    opened = browser.open("report.html")
    yield opened
    opened.close()


@needs_browser
def test_page__asks_for_nothing_and_has_nothing_on_the_console(page: Page) -> None:
    assert page.problems() == []
    assert [url for url in page.requests if not url.startswith(("data:", "file:"))] == []
    assert page.evaluate("document.querySelectorAll('.scatter .point').length") == 2 * 8


@needs_browser
def test_page__sorts_the_table_by_a_head_and_back(page: Page) -> None:
    rows = "#headline tbody th"
    assert names(page, rows) == ["c", "b", "a"]  # r_all 55, 53.7, 46.7
    page.click('#headline th[data-key="r_sc"] button')
    assert names(page, rows)[-1] == "b"  # the only one with another mesh
    page.click('#headline th[data-key="r_sc"] button')
    assert names(page, rows)[0] == "b"
    assert page.evaluate("document.querySelector('[data-key=r_sc]').getAttribute('aria-sort')") == "descending"


def choose(page: Page, control: str, value: str) -> None:
    """Give a control of the gallery a value, as its user does."""
    element = f"document.getElementById('{control}')"
    page.evaluate(f"(e => {{ e.value = '{value}'; e.dispatchEvent(new Event('input')); }})({element})")


@needs_browser
def test_page__puts_the_worst_target_of_the_chosen_agent_first(page: Page) -> None:
    assert names(page, ".card h3") == ["x", "y", "z"]  # means 36.7, 46.7, 80.5
    choose(page, "whose", "0")
    assert names(page, ".card h3") == ["y", "x", "z"]
    choose(page, "whose", "2")
    assert names(page, ".card h3") == ["z", "x", "y"]  # a failure is worse than any score
    choose(page, "whose", "1")
    choose(page, "measure", "lag")
    assert names(page, ".card h3") == ["x", "z", "y"]  # -30, 1, 50 against a
    choose(page, "measure", "name")
    choose(page, "find", "Y")
    assert names(page, ".card h3") == ["y"]
    assert page.evaluate("document.getElementById('count').textContent") == "1 of 3"


@needs_browser
def test_page__hides_an_agent_everywhere_and_sorts_by_those_that_are_left(page: Page) -> None:
    page.click('#chips button[data-chip="1"]')
    assert names(page, "#headline tbody th") == ["c", "a"]
    assert names(page, ".card:first-child figcaption b") == ["a", "c"]
    assert names(page, ".card h3") == ["y", "x", "z"]  # means of a and c: 40, 45, 80
    assert page.evaluate("[...document.querySelectorAll('.point.s1')].some(e => e.getClientRects().length)") is False
    page.click('#chips button[data-chip="1"]')
    assert names(page, ".card h3") == ["x", "y", "z"]


@needs_browser
def test_page__names_target_and_agent_under_the_pointer(page: Page) -> None:
    page.move_to('.scatter .point[data-s="1"][data-t="2"]')
    assert page.evaluate("document.getElementById('tip').innerText") == "z\nb\nr_sm 0.9000, r_sc 30"


@needs_browser
def test_page__tells_the_scores_at_the_work_under_the_pointer(page: Page) -> None:
    """Half of the score is there from one refit on, all of it after ten (b, c) or a hundred (a)."""
    page.move_to('.anytime[data-work="refits"] .grid')
    head, *lines = page.evaluate("document.getElementById('tip').innerText").splitlines()
    assert 8.0 < float(head.removesuffix(" refits")) < 12.0  # the middle between 1 and 100
    values = {line.split()[1]: float(line.split()[0]) for line in lines}
    assert values["a"] == pytest.approx((50 + 10 + 80) / 3 / 2, abs=0.06)
    assert page.evaluate("document.querySelector('[data-work=refits] .cursor').getAttribute('d')") is not None


@needs_browser
def test_page__shows_what_is_missing_and_what_is_too_much_in_their_colours(page: Page, tmp_path: Path) -> None:
    """The target is the lower half, the mesh the middle: excess above the middle line, missing at the bottom."""
    picture = ".card:first-child figure .pair svg:last-child"
    page.evaluate(f"document.querySelector('{picture}').scrollIntoView({{block: 'center', behavior: 'instant'}})")
    box = page.evaluate(f"(b => [b.x, b.y, b.width])(document.querySelector('{picture}').getBoundingClientRect())")
    page.screenshot(tmp_path / "page.png")
    pixels = np.asarray(Image.open(tmp_path / "page.png").convert("RGB")).astype(int)

    def at(x: float, y: float) -> tuple[int, ...]:
        column, row = (round(o + (5 + 100 * v) / 110 * box[2]) for o, v in ((box[0], x), (box[1], y)))
        return tuple(pixels[row, column])

    excess, missing, match, nothing = at(0.5, 0.4), at(0.5, 0.9), at(0.5, 0.6), at(0.5, 0.1)
    assert excess == (0xE0, 0x82, 0x14)
    assert missing == (0x1F, 0x78, 0xB4)
    assert match == (0xC6, 0xCC, 0xD5)
    assert nothing == (0xF7, 0xF8, 0xF9)


@needs_browser
@pytest.mark.parametrize("width", [390, 1280])
def test_page__fits_the_screen_and_can_be_read_in_the_dark(page: Page, width: int) -> None:
    page.emulate(width=width, height=844, dark=True)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    ink, paper = (page.evaluate(f"getComputedStyle(document.body).{name}") for name in ("color", "backgroundColor"))
    assert contrast(ink, paper) > 12.0
    soft = page.evaluate("getComputedStyle(document.querySelector('td small')).color")
    card = page.evaluate("getComputedStyle(document.querySelector('.card')).backgroundColor")
    assert contrast(soft, card) > 4.5  # WCAG AA


def contrast(one: str, other: str) -> float:
    """The contrast ratio of two colours `rgb(r, g, b)` (WCAG 2.2)."""
    light = []
    for colour in (one, other):
        channels = np.array([int(v) for v in colour[colour.index("(") + 1 : -1].split(",")][:3]) / 255.0
        linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
        light.append(float(linear @ (0.2126, 0.7152, 0.0722)) + 0.05)
    return max(light) / min(light)


@needs_browser
def test_page__takes_names_as_text_whatever_is_in_them(browser: Browser, run: Run, tmp_path: Path) -> None:
    """No name of an agent, target or setting, no error and no title becomes markup."""
    records = [*records_of(NASTY, {"x": 1.0, "y": 2.0}), Record("b", "x", 0, None, NASTY)]
    records = [replace(record, target=record.target + NASTY.replace("/", "")) for record in records]
    write_run(tmp_path / "run", records, {"name": NASTY})
    assert run("run", "--title", NASTY).code == 0
    page = browser.open("report.html")
    assert page.problems() == []
    assert page.evaluate("document.querySelector('h1').textContent") == NASTY
    assert names(page, "#headline tbody th") == [NASTY, "b"]
    assert NASTY in page.evaluate("document.querySelector('.card .failed').textContent")
    assert page.evaluate("document.querySelectorAll('body > script').length") == 2
    page.close()
    text = Path("report.md").read_text()
    assert all(line.count("|") - line.count("\\|") == 12 for line in text.split("\n\n")[0].splitlines())


def test_page__has_no_name_unescaped(run: Run, tmp_path: Path) -> None:
    """As the test before, for where there is no browser; in the page's data, which is JSON, the angle is \\u003c."""
    records = [*records_of(NASTY, {"x": 1.0}), Record("b", f"y{NASTY.replace('/', '')}", 0, None, NASTY)]
    write_run(tmp_path / "run", records, {"name": NASTY})
    assert run("run", "--title", NASTY).code == 0
    page = Path("report.html").read_text()
    assert '<b>"it' not in page and "&lt;b&gt;&#34;it&#39;s&#34; &amp; `${1}`" in page
    assert page.count("<script") == page.count("</script>") == 2 and "\\u003c/script\\u003e" in page


def test_odd_records__are_compared_like_any_other(run: Run, tmp_path: Path) -> None:
    """Names that are no Unicode, no curve, no elements at all, vertices far out."""
    far = MeshData.of(PolyMesh.rectangle(-1e300, -1e300, 1e300, 1e300))
    records = [Record("a\ud800", "x\ud800\0", 0, replace(outcome(1.0, r_sc=0), curve=[], mesh=far))]
    write_run(tmp_path / "run", records)
    said = run("run")
    assert (said.code, said.err) == (0, "")
    assert "a?" in said.out
    assert "<h3>x?\0</h3>" in Path("report.html").read_text()


@needs_browser
def test_page__is_whole_where_everything_has_failed(browser: Browser, run: Run, tmp_path: Path) -> None:
    write_run(tmp_path / "run", [Record("a", "x", 0, None, "no"), Record("b", "x", 0, None, "no")])
    assert run("run").code == 0
    page = browser.open("report.html")
    assert page.problems() == []
    assert names(page, ".card .failed") == ["no", "no"]
    page.close()
