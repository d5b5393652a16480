"""The player in a real browser: what a reader sees and presses."""

import numpy as np
import pytest

from autopoly_env import viewer
from autopoly_env.sequence import ConstructionSequence
from tests.helpers.browser import Page, needs_browser
from tests.helpers.constructions import BEST, STEPS, TOTALS, house, score
from tests.helpers.player import HOSTILE, LAST, Open, names, step_of, text, wanted
from tests.helpers.strategies import random_walk
from tests.helpers.tables import table

# Time that stands still unless a test says otherwise.
CLOCK = "window.clock = 0; performance.now = () => window.clock;"
# Time that runs thirty times as fast.
HURRY = """{
  const [now, later] = [performance.now.bind(performance), setTimeout];
  performance.now = () => 30 * now();
  window.setTimeout = (task, delay) => later(task, delay / 30);
}"""


@needs_browser
def test_player__opens_from_a_file_at_the_last_step_without_a_complaint(play: Open) -> None:
    page = play(target=wanted())
    assert step_of(page) == LAST
    assert text(page, "#total") == "75.25" and text(page, "h1") == "house"
    assert [text(page, f"#n-{kind}") for kind in ("vertices", "edges", "faces")] == list(
        map(str, house().final().counts)
    )
    assert page.problems() == []
    assert all(url.startswith(("file:", "data:")) for url in page.requests)
    assert len([url for url in page.requests if url.startswith("file:")]) == 1


@needs_browser
def test_player__opens_at_the_step_in_its_address(play: Open) -> None:
    assert step_of(play(at="#step-3")) == 3
    assert step_of(play(at="#step-99")) == LAST


@needs_browser
def test_player__runs_no_code_from_a_name(play: Open) -> None:
    page = play(house(settings={"target": HOSTILE}))
    assert text(page, "h1") == HOSTILE.replace("\r\n", "\n")
    assert page.evaluate("typeof hacked") == "undefined"
    assert page.evaluate("document.images.length + document.scripts.length") == 2
    assert page.problems() == []


@needs_browser
def test_buttons_and_list__go_through_the_steps(play: Open) -> None:
    page = play()
    page.click("#previous")
    assert step_of(page) == LAST - 1
    page.click("#next")
    page.click("#next")  # there is no further one
    assert step_of(page) == LAST
    page.click("#steps li:nth-child(3) button")
    assert step_of(page) == 2
    assert "Split a face" in text(page, "#what") and "vertex 4" in text(page, "#done")
    assert page.evaluate("[...document.querySelectorAll('#keys kbd')].map(key => key.textContent)") == [
        "1",
        "Shift",
        "J",
    ]


@needs_browser
def test_slider__goes_where_it_is_clicked_and_steps_with_its_keys(play: Open) -> None:
    page = play(house(4))
    page.click("#step")  # its middle
    assert step_of(page) == 2
    page.press("ArrowRight")
    assert step_of(page) == 3
    page.press("Home")
    assert step_of(page) == 0
    assert "Before step 1" in text(page, "#which")


@needs_browser
def test_keys__step_jump_and_play_from_anywhere(play: Open) -> None:
    page = play()
    for key, step in (("ArrowLeft", 6), ("ArrowLeft", 5), ("ArrowRight", 6), ("Home", 0), ("ArrowLeft", 0), ("End", 7)):
        page.press(key)
        assert step_of(page) == step
    page.press(" ")
    assert page.evaluate("document.getElementById('play').ariaLabel") == "Pause"
    page.press(" ")
    assert page.evaluate("document.getElementById('play').ariaLabel") == "Play"


@needs_browser
def test_space_on_a_button__presses_that_button_only(play: Open) -> None:
    page = play()
    page.evaluate("document.getElementById('previous').focus()")
    page.press(" ")
    assert step_of(page) == LAST - 1
    assert page.evaluate("document.getElementById('play').ariaLabel") == "Play"


@needs_browser
def test_parts__head_their_steps_in_the_list_and_stand_on_the_card(play: Open) -> None:
    page = play(table())
    heads = "[...document.querySelectorAll('#steps li')].map(item => item.querySelector('.part')?.textContent ?? '')"
    assert page.evaluate(heads) == ["body", "", "", "lower right, 1 of 2", "lower left, 2 of 2"]
    assert text(page, "#part") == "lower left, 2 of 2"
    assert text(page, "#seconds") == ", about 4 s"
    page.press("Home")
    assert (text(page, "#part"), text(page, "#seconds")) == ("", "")
    assert page.problems() == []


@needs_browser
def test_parts__are_not_spoken_of_where_there_is_one_and_are_text(play: Open) -> None:
    assert play(house(2)).evaluate("document.querySelectorAll('.part').length") == 0
    label = "<img src=x onerror='hacked = 1'>"
    page = play(table().with_parts([None, None, label, label]))
    assert text(page, "#part") == label
    assert page.evaluate("typeof hacked") == "undefined" and page.problems() == []


@needs_browser
def test_play__runs_from_the_start_to_the_end_and_stops(play: Open) -> None:
    page = play(house(3), still=False, before=HURRY)
    page.evaluate(
        """window.seen = [];
        new MutationObserver(() => seen.push(document.getElementById("which").textContent))
          .observe(document.getElementById("which"), {childList: true})"""
    )
    page.click("#play")
    assert page.evaluate("document.getElementById('play').ariaLabel") == "Pause"
    page.wait_for("document.getElementById('play').ariaLabel === 'Play'")
    seen = page.evaluate("seen")
    assert seen == ["Before step 1 of 3", "Step 1 of 3", "Step 2 of 3", "Step 3 of 3"]


TOLD = "[...document.querySelectorAll('#names text')].map(text => text.textContent)"


@needs_browser
def test_before__shows_what_to_click_and_where_to_aim_and_after_names_what_is_new(play: Open) -> None:
    page = play(at="#step-1")
    assert page.evaluate(TOLD) == ["4"]
    page.click("#before")
    picked = "[...document.querySelectorAll('#mesh .pick')].map(element => element.getAttribute('aria-label'))"
    assert page.evaluate(picked) == ["edge 0–1"]
    assert page.evaluate(TOLD) == ["0–1"]
    ring = "['cx', 'cy'].map(name => Number(document.querySelector('#aims circle').getAttribute(name)))"
    assert page.evaluate(ring) == [500, 125]
    assert page.evaluate("document.querySelectorAll('#vertices > g').length") == 4
    assert text(page, "#count") == "1 / 7"
    page.press("b")
    assert page.evaluate("document.querySelectorAll('#vertices > g').length") == 5
    assert page.evaluate("document.querySelectorAll('#aims *').length") == 0


@needs_browser
def test_guess__hides_the_step_until_it_is_asked_for(play: Open) -> None:
    page = play(at="#step-2")
    page.click("#guess")
    page.click("#next")
    hidden = (
        "['#what', '#keys', '#why'].map(id => document.querySelector(id).checkVisibility({visibilityProperty: true}))"
    )
    assert page.evaluate(hidden) == [False] * 3
    assert page.evaluate("document.querySelectorAll('#vertices > g').length") == 5 and page.evaluate(TOLD) == []
    page.click("#reveal")
    assert page.evaluate(hidden) == [True] * 3
    assert page.evaluate("document.querySelectorAll('#vertices > g').length") == 7
    assert page.problems() == []


@needs_browser
def test_print__has_a_card_for_each_step_with_the_mesh_before_and_after(play: Open) -> None:
    page = play(target=wanted())
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    count = "[...document.querySelectorAll('#printed article')].map(card => card.querySelectorAll('svg').length)"
    assert page.evaluate(count) == [1, *[2] * LAST]
    assert page.evaluate("new Set([...document.querySelectorAll('mask')].map(mask => mask.id)).size") == 2 * LAST + 2
    assert step_of(page) == LAST
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.evaluate("document.getElementById('printed').children.length") == 0
    assert page.problems() == []


@needs_browser
def test_motion__grows_an_extrusion_out_of_its_edge_and_then_moves_it(play: Open) -> None:
    page = play(still=False, before=CLOCK, at="#step-2")
    frames = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"

    def corner(clock: float) -> list[float]:
        page.evaluate(f"clock = {clock}; {frames}")
        (index,) = np.flatnonzero([name.startswith("vertex 6") for name in listed(page)])
        circle = f"document.querySelectorAll('#vertices .seen')[{index}]"
        return [float(value) for value in page.evaluate(f"['cx', 'cy'].map(name => {circle}.getAttribute(name))")]

    page.press("ArrowRight")
    assert corner(1300 * 0.301) == pytest.approx((750, 750), abs=1)  # on vertex 2, from which it comes
    assert corner(1300 * 0.55) == pytest.approx((875, 750), abs=1)  # where the operator puts it
    halfway = corner(1300 * 0.775)
    assert halfway == pytest.approx((887.5, 725), abs=1)  # half of the refit
    assert corner(1300) == pytest.approx((900, 700), abs=0.1)


@needs_browser
@pytest.mark.parametrize("seed", [3, 11])
def test_motion__goes_through_any_construction_and_back(play: Open, seed: int) -> None:
    walk = random_walk(seed, n_steps=25, shake=0.01)
    taken = [(step.action, step.choice, step.after, score(50.0)) for step in walk]
    page = play(ConstructionSequence.record({}, walk[0].before, score(50.0), taken), still=False, before=HURRY)
    for key, counts in (("Home", walk[0].before.counts), ("End", walk[-1].after.counts)):
        page.press(key)
        drawn = "['vertices', 'edges', 'faces'].map(id => document.getElementById(id).children.length)"
        page.wait_for(f"String({drawn}) === '{','.join(map(str, counts))}'")
    assert page.evaluate("document.getElementById('mesh').innerHTML.search('NaN|undefined')") == -1
    assert page.problems() == []


@needs_browser
@pytest.mark.parametrize(
    ("k", "fading"), [(5, {"vertex 5"}), (6, {"edge 1–2"}), (7, {"face 3", "edge 0–4", "edge 7–8"})]
)
def test_motion__fades_only_what_an_operator_takes_away(play: Open, k: int, fading: set[str]) -> None:
    page = play(still=False, before=CLOCK, at=f"#step-{k - 1}")
    page.press("ArrowRight")
    page.evaluate("clock = 550; new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    faint = page.evaluate(
        """[...document.querySelectorAll("#mesh g[role]")].filter(element => element.style.opacity < 1)
        .map(element => element.ariaLabel)"""
    )
    assert set(faint) == fading


def listed(page: Page) -> list[str]:
    """The names of the vertices in their order."""
    ids = "[...document.querySelectorAll('#vertices > g')].map((element, i) => i)"
    found = []
    for i in page.evaluate(ids):
        script = f"document.querySelectorAll('#vertices > g')[{i}]"
        page.evaluate(f"{script}.dispatchEvent(new PointerEvent('pointerover', {{bubbles: true}}))")
        found.append(text(page, "#tag"))
    return found


@needs_browser
def test_reduced_motion__shows_the_step_at_once(play: Open) -> None:
    page = play(before=CLOCK, at="#step-2")  # the clock stands: nothing that takes time would arrive
    page.press("ArrowRight")
    place = [name for name in listed(page) if name.startswith("vertex 6")]
    assert place == ["vertex 6 · 0.900, 0.700"]


@needs_browser
@pytest.mark.parametrize("k", range(1, LAST + 1))
def test_highlight__is_what_the_viewer_calls_new_and_what_has_moved(play: Open, k: int) -> None:
    meshes = house().meshes()
    new = viewer.changed(meshes[k - 1], meshes[k])
    page = play(at=f"#step-{k}")
    expected = {f"face {name}" for name in new.faces} | {f"edge {a}–{b}" for a, b in new.edges}
    green = names(page, "#mesh .new")
    assert {name for name in green if not name.startswith("vertex")} == expected
    assert {name.split(" · ")[0] for name in green if name.startswith("vertex")} == {
        f"vertex {v}" for v in new.vertices
    }
    moved = {name.split(" · ")[0] for name in names(page, "#mesh .moved")}
    assert moved == {f"vertex {v}" for v in STEPS[k - 1][3]}


@needs_browser
def test_target__can_be_hidden_and_faded(play: Open) -> None:
    page = play(target=wanted())
    opacity = "Number(getComputedStyle(document.getElementById('target')).opacity)"
    assert page.evaluate(opacity) == 1.0
    assert page.evaluate("document.querySelector('#target rect').getBBox().width") == 1000
    page.click("#opacity")  # its middle
    assert page.evaluate(opacity) == 0.5
    page.press("ArrowLeft")
    assert page.evaluate(opacity) == pytest.approx(0.45)
    assert step_of(page) == LAST  # the arrow was the slider's
    page.click("#show-target")
    assert page.evaluate(opacity) == 0.0
    assert page.evaluate("document.getElementById('opacity').disabled")
    page.press(" ")
    assert page.evaluate(opacity) == pytest.approx(0.45)


@needs_browser
def test_target__controls_are_absent_without_one(play: Open) -> None:
    assert play().evaluate("document.getElementById('overlay').checkVisibility()") is False


@needs_browser
def test_curve__goes_to_the_step_that_is_clicked(play: Open) -> None:
    page = play()
    for k in (0, 3, BEST):
        page.click(f"#dots circle:nth-child({k + 1})")
        assert step_of(page) == k
    assert text(page, "#dots text") == "best 81.50"
    heights = page.evaluate("[...document.querySelectorAll('#dots circle')].map(dot => -dot.getAttribute('cy'))")
    assert np.argsort(heights).tolist() == np.argsort(TOTALS).tolist()


@needs_browser
def test_hover__names_vertices_edges_and_faces(play: Open) -> None:
    page = play(at="#step-1")
    for selector, name in [
        ("#vertices > g:nth-child(5)", "vertex 4 · 0.500, 0.125"),
        ("#edges > g:nth-child(1)", "edge 0–4"),
        ("#faces > g", "face 0"),
    ]:
        page.move_to(selector)
        assert text(page, "#tag") == name and not page.evaluate("document.getElementById('tag').hidden")
    page.move_to("h1")
    assert page.evaluate("document.getElementById('tag').hidden")


@needs_browser
def test_keyboard__walks_through_the_elements_of_the_mesh(play: Open) -> None:
    page = play(at="#step-1")
    page.press("Tab")
    assert text(page, "#tag").startswith("vertex 0")
    page.press("ArrowUp")
    assert text(page, "#tag") == "face 0"
    page.press("ArrowRight")  # the next step, in which face 0 is still there
    assert page.evaluate("document.activeElement.ariaLabel") == "face 0"
    assert step_of(page) == 2
