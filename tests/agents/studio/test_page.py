"""The studio as a person uses it, in real Chromium."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from autopoly_env.sequence import ConstructionSequence
from autopoly_env.targets import ObjectTargets
from tests.helpers.axe import needs_axe, violations
from tests.helpers.browser import Browser, Page, needs_browser
from tests.helpers.paths import EXAMPLES
from tests.helpers.studio import DONE, Running, example, middle, serving, solved, vertex

pytestmark = pytest.mark.slow  # a server, its workers and a browser are started

FACES = "document.querySelectorAll('#faces g').length"
TABS = ("picture", "search", "hand", "take")


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with serving(out=tmp_path_factory.mktemp("studio") / "out") as running:
        yield running


Open = Callable[..., Page]


@pytest.fixture
def open_studio(studio: Running, browser: Browser) -> Iterator[Open]:
    """Opens the studio in a tab, without a picture in it."""
    pages: list[Page] = []

    def open_it(**view: object) -> Page:
        page = browser.open(studio.address, **view)  # type: ignore[arg-type]
        pages.append(page)
        page.wait_for("document.querySelectorAll('#examples button').length > 0")
        page.wait_for("document.body.classList.contains('empty')")
        return page

    yield open_it
    for page in pages:
        page.evaluate(
            """Promise.all([...document.querySelectorAll("#list li")]
            .map(line => fetch(`pictures/${line.dataset.id}`, { method: "DELETE" })))"""
        )
        assert page.problems() == []
        page.close()


def tool(page: Page, name: str) -> None:
    page.click("#tab-hand")
    page.click(f'input[name="tool"][value="{name}"]')


def choose(page: Page, selector: str, value: str, event: str = "change") -> None:
    """Choose an entry of a list, or a place of a slider, as a person does."""
    found = f"document.querySelector({selector!r})"
    page.evaluate(f"{found}.value = {value!r}; {found}.dispatchEvent(new Event({event!r}))")


def held(page: Page) -> ConstructionSequence:
    """The construction that is looked at, as it is taken along."""
    number = page.evaluate("Number(location.hash.slice(1))")
    return ConstructionSequence.from_json(
        page.evaluate(f"fetch('pictures/{number}/take/sequence').then(one => one.text())")
    )


@needs_browser
def test_dropped_picture__is_shown_with_its_mask_and_searched(open_studio: Open) -> None:
    page = open_studio()
    page.drop(EXAMPLES / "mug.png")
    page.wait_for("document.getElementById('name').textContent === 'mug'")
    solved(page)
    assert float(page.text("#total")) > 80 and page.evaluate(FACES) == int(page.text("#n-faces"))
    page.click("#tab-picture")
    assert page.evaluate("document.querySelector('#photo image').getAttribute('href').startsWith('pictures/')")
    assert page.evaluate("document.querySelector('#target image').getAttribute('href').startsWith('data:image/png')")
    assert "1 hole" in page.text("#notes")


@needs_browser
def test_nothing__is_loaded_from_elsewhere(open_studio: Open, studio: Running) -> None:
    page = open_studio()
    example(page, "mug")
    solved(page)
    for tab in TABS:
        page.click(f"#tab-{tab}")
    assert all(url.startswith((studio.address, "data:", "blob:")) for url in page.requests)


@needs_browser
def test_mask_controls__take_effect_while_they_move(open_studio: Open, tmp_path: Path) -> None:
    picture = Image.new("L", (100, 100), 255)
    picture.paste(60, (20, 20, 60, 60))
    picture.paste(150, (60, 20, 90, 60))
    picture.save(tmp_path / "two.png")
    page = open_studio()
    page.drop(tmp_path / "two.png")
    page.wait_for("document.getElementById('name').textContent === 'two'")
    page.click("#tab-picture")
    mask = "document.querySelector('#target image').getAttribute('href').length"
    both = page.evaluate(mask)
    choose(page, "#object", "dark")
    page.click("#has-threshold")
    for level in range(50, 34, -1):
        choose(page, "#threshold", str(level), "input")
    page.wait_for(f"{mask} !== {both}")
    page.wait_for("document.getElementById('notes').textContent.includes('threshold 0.35')")
    solved(page)
    assert "--object dark --threshold 0.35" in page.text("#command")


@needs_browser
def test_name_with_markup__is_text(open_studio: Open, tmp_path: Path) -> None:
    name = "<img src=x onerror=hacked=1>&amp;'\""
    (tmp_path / f"{name}.png").write_bytes((EXAMPLES / "mug.png").read_bytes())
    page = open_studio()
    page.drop(tmp_path / f"{name}.png")
    page.wait_for("document.querySelector('#list .called') !== null")
    solved(page)
    assert page.text("#name") == page.text("#list .called") == name
    assert page.evaluate("typeof hacked") == "undefined"


@needs_browser
def test_examples__are_there_beside_open_pictures(open_studio: Open) -> None:
    page = open_studio()
    example(page, "mug")
    page.click("#more-examples summary")
    page.evaluate("document.querySelector('#more-examples li:nth-child(6) button').id = 'second'")
    page.click("#second")
    page.wait_for("document.getElementById('name').textContent === 'chair'")


@needs_browser
def test_file_that_is_no_picture__is_told_and_the_page_goes_on(open_studio: Open, tmp_path: Path) -> None:
    (tmp_path / "notes.png").write_text("hello")
    with (tmp_path / "huge.png").open("wb") as stream:
        stream.truncate(500_000_000)
    page = open_studio()
    page.drop(tmp_path / "notes.png")
    page.wait_for("document.getElementById('message').textContent.includes('is not an image')")
    page.drop(tmp_path / "huge.png")
    page.wait_for("document.getElementById('message').textContent.includes('500 MB')")
    example(page, "bottle")
    solved(page)
    page.console.clear()  # where Chromium notes that an answer was a refusal


@needs_browser
def test_files_that_are_no_pictures__are_all_told(open_studio: Open, tmp_path: Path) -> None:
    paths = [tmp_path / f"note {k}.png" for k in range(5)]
    for path in paths:
        path.write_text("hello")
    page = open_studio()
    page.drop(*paths)
    page.wait_for("document.getElementById('message').textContent.includes('and 2 more')")
    assert page.text("#message").count("is not an image") == 3
    page.console.clear()  # as above


@needs_browser
def test_pause__stands_still_and_going_on_goes_on(open_studio: Open) -> None:
    page = open_studio()
    example(page, "bicycle")
    choose(page, "#seconds", "60")
    page.wait_for("/searching: \\d+ refits/.test(document.getElementById('count').textContent)")
    page.click("#play")
    page.wait_for("document.getElementById('count').textContent.startsWith('paused')")
    page.evaluate("new Promise(done => setTimeout(done, 400))")  # what was on its way has come
    stood = page.text("#count")
    page.evaluate("new Promise(done => setTimeout(done, 500))")
    assert page.text("#count") == stood
    page.click("#play")
    count = "document.getElementById('count').textContent"
    page.wait_for(f"{count}.startsWith('searching') && {count}.slice(9) !== {json.dumps(stood[6:])}")
    page.click("#stop")
    solved(page)
    assert page.text("#count").startswith("stopped after") and page.evaluate(FACES) > 0


@needs_browser
def test_stroke_of_the_brush__is_minded_and_stays_when_the_page_is_opened_again(open_studio: Open) -> None:
    page = open_studio()
    example(page, "mug")
    solved(page)
    tool(page, "paint")
    x, y = middle(page, "#mesh")
    page.drag((x - 60, y), (x - 20, y + 30))
    page.wait_for("document.getElementById('command').textContent.includes('--importance mug.importance.png')")
    solved(page)
    address = page.evaluate("location.href")
    page.go("about:blank")
    page.go(address)
    page.wait_for("document.querySelector('#painted image') !== null")
    tool(page, "paint")
    page.click("#unpaint")
    page.wait_for("!document.getElementById('command').textContent.includes('importance')")


@needs_browser
def test_two_tabs_on_one_picture__show_the_same_as_soon_as_they_are_looked_at(
    open_studio: Open, browser: Browser
) -> None:
    page = open_studio()
    example(page, "mug")
    solved(page)
    other = browser.open(page.evaluate("location.href"))
    other.wait_for("document.getElementById('name').textContent === 'mug'")
    page.send("Page.bringToFront")
    tool(page, "paint")
    x, y = middle(page, "#mesh")
    page.drag((x - 60, y), (x - 20, y + 30))
    page.wait_for("document.getElementById('command').textContent.includes('--importance')")
    other.send("Page.bringToFront")
    other.wait_for("document.querySelector('#painted image') !== null")
    other.wait_for("document.getElementById('command').textContent.includes('--importance')")
    assert page.text("#total") == other.text("#total")
    other.click("#undo")
    page.send("Page.bringToFront")
    page.wait_for("document.getElementById('redo').ariaDisabled === 'false'")
    other.close()


@needs_browser
def test_vertex__is_pulled_with_the_mouse_locked_and_kept_when_the_search_goes_on(open_studio: Open) -> None:
    page = open_studio()
    example(page, "mug")
    solved(page)
    tool(page, "pull")
    x, y = vertex(page, 3)
    page.drag((x, y), (x + 8, y - 20))
    page.wait_for("document.getElementById('locks').textContent === 'Locked: 3.'")
    pulled = held(page).final()
    place = pulled.vertices[pulled.vertex_index(3)].tolist()
    page.click("#on")
    page.wait_for("document.getElementById('command').textContent.includes('--lock 3')")
    after = held(page).final()
    assert after.vertices[after.vertex_index(3)].tolist() == place
    page.click("#undo")
    page.click("#undo")
    page.wait_for("document.getElementById('redo').ariaDisabled === 'false'")
    page.wait_for("document.getElementById('locks').textContent === ''")


@needs_browser
def test_vertices_that_are_clicked_quickly__are_all_locked(open_studio: Open) -> None:
    page = open_studio()
    example(page, "mug")
    solved(page)
    tool(page, "lock")
    page.evaluate(
        """[...document.querySelectorAll("#vertices g")].slice(0, 3)
        .forEach(one => one.dispatchEvent(new MouseEvent("click", { bubbles: true })))"""
    )
    page.wait_for("(document.getElementById('locks').textContent.match(/\\d+/g) || []).length === 3")


@needs_browser
def test_server_that_was_ended__is_told_to_those_who_see_the_page(browser: Browser, tmp_path: Path) -> None:
    with serving(out=tmp_path / "out") as running:
        page = browser.open(running.address)
        page.wait_for("document.querySelectorAll('#examples button').length > 0")
        running.stop()
    page.wait_for("document.getElementById('message').checkVisibility()")
    assert "has it been ended?" in page.text("#message")
    page.close()


@needs_browser
def test_faces_and_edges__are_deleted_split_and_cut_and_everything_is_undone(open_studio: Open) -> None:
    page = open_studio()
    example(page, "mug")
    solved(page)
    n = page.evaluate(FACES)
    tool(page, "delete")
    page.click("#faces g:nth-child(2)")
    page.wait_for(f"{FACES} === {n - 1}")
    page.click("#undo")
    page.wait_for(f"{FACES} === {n}")
    quad = next(face for face in held(page).final().faces if len(face) == 4)
    ids = held(page).final().vertex_ids
    tool(page, "split")
    for k in (quad[0], quad[2]):
        page.click(f'#vertices [aria-label^="vertex {ids[k]}"]')
    page.wait_for(f"{FACES} === {n + 1}")
    tool(page, "add")
    page.click("#edges g:nth-child(1)")
    page.wait_for(f"Number(document.getElementById('n-vertices').textContent) === {len(ids) + 1}")
    assert [step.operator for step in held(page).steps[-2:]] == ["face_split", "edge_subdivide"]
    assert ConstructionSequence.from_json(held(page).to_json()).final() == held(page).final()
    page.click("#on")  # a face has five corners now: it goes on in the other style
    page.wait_for("document.getElementById('command').textContent.includes('--style paper --agent mcts')")


@needs_browser
def test_axis__is_dragged_and_left_and_right_become_alike(open_studio: Open) -> None:
    page = open_studio()
    example(page, "bottle")
    solved(page)
    tool(page, "axis")
    x, y = middle(page, "#axis .grip")
    page.drag((x, y), (x + 4, y))
    page.wait_for("document.getElementById('command').textContent.includes('--symmetry 0.5')")
    assert isinstance(held(page).settings["symmetry"], float)


@needs_browser
def test_everything_by_hand__works_with_keys_alone(open_studio: Open) -> None:
    page = open_studio()
    example(page, "mug")
    solved(page)
    tool(page, "pull")
    page.evaluate("document.querySelector('#vertices [aria-label=\"vertex 3\"]').focus()")
    for key in ("Enter", "ArrowUp", "ArrowUp", "Enter"):
        page.press(key)
    page.wait_for("document.getElementById('locks').textContent === 'Locked: 3.'")
    tool(page, "lock")
    page.evaluate("document.querySelector('#vertices [aria-label^=\"vertex 3\"]').focus()")
    page.press("Enter")
    page.wait_for("document.getElementById('locks').textContent === ''")
    tool(page, "paint")
    page.evaluate("document.querySelector('#brush g').focus()")
    for key in ("ArrowLeft", "ArrowLeft", " "):
        page.press(key)
    page.wait_for("document.querySelector('#painted image') !== null")
    page.wait_for("/^(searching|waits)/.test(document.getElementById('count').textContent)")
    solved(page)
    tool(page, "axis")
    page.evaluate("document.querySelector('#axis g').focus()")
    before = page.evaluate("document.querySelector('#axis g').ariaValueNow")
    page.press("ArrowRight")
    assert page.evaluate("document.querySelector('#axis g').ariaValueNow") != before
    page.evaluate("document.getElementById('tab-hand').focus()")
    page.press("ArrowRight")
    assert page.evaluate("document.activeElement.id") == "tab-take"


@needs_browser
def test_player_opens_in_a_tab_of_its_own__and_cannot_ask_the_server(open_studio: Open, browser: Browser) -> None:
    page = open_studio()
    example(page, "bottle")
    solved(page)
    player = browser.open(page.evaluate("document.getElementById('player').href"))
    assert player.text("h1") == "bottle" and player.problems() == []
    assert player.evaluate("self.origin") == "null"
    player.close()


@needs_browser
def test_folder_at_once__is_worked_off_while_the_tab_is_closed_and_sorted_worst_first(
    open_studio: Open, studio: Running, browser: Browser
) -> None:
    page = open_studio()
    page.drop(*(EXAMPLES / f"{name}.png" for name in ("bottle", "table", "mug", "bicycle", "bed")))
    page.wait_for("document.querySelectorAll('#list li').length === 5")
    page.wait_for("document.querySelectorAll('#list li.done').length >= 1")
    page.go("about:blank")
    page.go(studio.address)
    page.wait_for("document.querySelectorAll('#list li.done').length === 5")
    worth = page.evaluate("[...document.querySelectorAll('#list .worth')].map(one => Number(one.textContent))")
    assert worth == sorted(worth) and len(worth) == 5
    assert page.text("#pictures-title") == "Pictures: 5 of 5 done, the worst first"


@needs_axe
@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [1280, 390])
def test_axe__finds_nothing(open_studio: Open, dark: bool, width: int) -> None:
    page = open_studio(dark=dark, width=width, height=800)
    assert violations(page) == []
    example(page, "mug")
    solved(page)
    for tab in TABS:
        page.click(f"#tab-{tab}")
        assert violations(page) == [], tab
    for name in ("paint", "axis", "lock"):
        tool(page, name)
        assert violations(page) == [], name
    page.drop(*(EXAMPLES / f"{name}.png" for name in ("bottle", "table")), x=100)
    page.wait_for("document.querySelectorAll('#list li.done').length === 3")
    assert violations(page) == []


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
def test_phone__shows_everything_without_scrolling_sideways(open_studio: Open, dark: bool) -> None:
    page = open_studio(width=360, height=740, dark=dark)
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    example(page, "mug")
    page.wait_for(DONE)
    for tab in TABS:
        page.click(f"#tab-{tab}")
        assert page.evaluate("document.documentElement.scrollWidth") == 360, tab
        small = page.evaluate(
            """[...document.querySelectorAll("button, input, select")].filter(one => one.checkVisibility())
            .map(one => [one.id || one.textContent, (one.closest("label") || one).getBoundingClientRect().height])
            .filter(([, height]) => height < 24)"""
        )
        assert small == [], tab


# --- the three tasks of docs/studio.md, with the page alone ---


@needs_browser
def test_task__a_mug_with_its_handle_kept(open_studio: Open) -> None:
    page = open_studio()
    example(page, "mug")
    choose(page, "#price", "0", "input")  # so simple that the handle is lost
    page.wait_for("document.getElementById('command').textContent.includes('--w-sc 3')")
    solved(page)
    assert not n_holes(held(page)) and "the mesh none: “Keep: all holes” keeps them" in page.text("#said")
    choose(page, "#keep", "holes")
    page.wait_for("document.getElementById('command').textContent.includes('--keep holes')")
    assert n_holes(held(page)) == 1


@needs_browser
def test_task__a_chair_with_equal_legs_and_then_a_stool(open_studio: Open, tmp_path: Path) -> None:
    page = open_studio()
    example(page, "chair")
    choose(page, "#align", "yes")
    page.wait_for("document.getElementById('command').textContent.includes('--align')")
    feet = sorted(held(page).final().vertices[:, 1].tolist())[-4:]
    assert feet[0] == pytest.approx(feet[3], abs=1e-9)
    stool = ObjectTargets("stool").sample(5).target(300).mask
    Image.fromarray(np.where(stool, np.uint8(30), np.uint8(255))).save(tmp_path / "stool.png")
    page.drop(tmp_path / "stool.png")
    page.wait_for("document.getElementById('name').textContent === 'stool'")
    solved(page)
    page.click("#tab-search")
    page.click("#retell")
    page.wait_for("document.getElementById('command').textContent.includes('agents.retarget')")
    assert "steps:" in page.text("#said") and held(page).settings["kept"] > 0


def n_holes(sequence: ConstructionSequence) -> int:
    """By Euler's formula, for a mesh in one piece."""
    n_vertices, n_edges, n_faces = sequence.final().counts
    return 1 - (n_vertices - n_edges + n_faces)
