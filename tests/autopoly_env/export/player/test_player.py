"""The player: what is in its page, and, in a real browser, what a reader sees, presses, hears and is spared."""

import base64
import io
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from autopoly_env import viewer
from autopoly_env.errors import OutputError, SequenceError
from autopoly_env.export import save_html, to_html
from autopoly_env.export.player import describe_start, describe_step
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from tests.helpers.browser import Browser, Page, needs_browser
from tests.helpers.constructions import BEST, STEPS, TOTALS, house, score
from tests.helpers.drawings import HOUSE, painted
from tests.helpers.strategies import random_walk

LAST = len(STEPS)
HOSTILE = (
    """</script><script>hacked = 1</script>"'`${hacked = 1}\n{{data}}<img src=x onerror="hacked = 1">\u2028<!--&lt;"""
)
# Time that stands still unless a test says otherwise.
CLOCK = "window.clock = 0; performance.now = () => window.clock;"
# Time that runs thirty times as fast.
HURRY = """{
  const [now, later] = [performance.now.bind(performance), setTimeout];
  performance.now = () => 30 * now();
  window.setTimeout = (task, delay) => later(task, delay / 30);
}"""


def wanted(name: str = "house") -> Silhouette:
    return replace(painted(HOUSE), name=name)


class Reader(HTMLParser):
    """The tags of a page with their attributes, and the text in each kind of tag."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, list[str]] = {}
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.texts.setdefault(tag, []).append("")

    def handle_data(self, data: str) -> None:
        if self.tags:
            self.texts[self.tags[-1][0]][-1] += data


def data_of(page: str) -> Any:
    """What the page's script reads."""
    return json.loads(Reader(page).texts["script"][0])


# --- the page as a text ---


def test_page__has_every_mesh_and_score_of_the_sequence() -> None:
    sequence = house()
    steps = data_of(to_html(sequence))["steps"]
    assert [step["total"] for step in steps] == list(TOTALS)
    for step, mesh in zip(steps, sequence.meshes(), strict=True):
        assert tuple(step["counts"]) == mesh.counts
        places = np.array([step["vertices"][str(name)] for name in mesh.vertex_ids])
        np.testing.assert_allclose(places, mesh.vertices, atol=6e-6)
        assert {int(name): corners for name, corners in step["faces"].items()} == {
            name: [mesh.vertex_ids[v] for v in face] for name, face in zip(mesh.face_ids, mesh.faces, strict=True)
        }


def test_page__tells_where_new_vertices_grow_from_and_lost_ones_go() -> None:
    steps = data_of(to_html(house()))["steps"]
    assert steps[1]["put"] == {"4": [0.5, 0.25, 0.5, 0.25]}  # the middle of edge 0–1
    assert steps[3]["put"] == {"5": [0.75, 0.25, 0.875, 0.25], "6": [0.75, 0.75, 0.875, 0.75]}  # from the ends of 1–2
    hole = np.array(list(steps[4]["put"].values()))
    np.testing.assert_allclose(hole[:, :2], np.broadcast_to(hole[:, 2:].mean(axis=0), (3, 2)), atol=2e-5)
    # vertex 5 lies at (0.875, 0.25) between 1 (0.75, 0.25) and 6 (0.9, 0.7): its foot on that line by hand
    along, way = np.array((0.15, 0.45)), np.array((0.125, 0.0))
    np.testing.assert_allclose(steps[5]["lost"]["5"], (0.75, 0.25) + along * (way @ along) / (along @ along), atol=1e-5)
    assert [step["moved"] for step in steps[1:4]] == [[4], [], [3, 6]]


def test_page__asks_for_nothing_from_outside() -> None:
    page = to_html(house(), wanted())
    policy = next(a["content"] for tag, a in Reader(page).tags if a.get("http-equiv") == "Content-Security-Policy")
    assert policy is not None and policy.startswith("default-src 'none'")
    assert set(re.findall(r"\w+://[^\s\"'<]+", page)) == {"http://www.w3.org/2000/svg"}
    linked = [a for _, a in Reader(page).tags if {"src", "href", "srcset", "action"} & a.keys()]
    assert linked == [{"rel": "icon", "href": "data:,"}]


def test_page__holds_names_as_text_only() -> None:
    page = to_html(house(settings={"target": HOSTILE}))
    reader = Reader(page)
    assert data_of(page)["title"] == HOSTILE
    assert [title.rstrip() for title in reader.texts["h1"]] == [HOSTILE]
    assert [a.get("type") for tag, a in reader.tags if tag == "script"] == ["application/json", None]
    assert not any(tag == "img" for tag, _ in reader.tags)
    data = page.split('id="data">')[1].split("</script>")[0]
    assert not set("<>&\u2028\u2029") & set(data)


def test_page__survives_a_name_that_is_no_unicode() -> None:
    assert data_of(to_html(house(settings={"target": "a\ud800b"})))["title"] == "a?b"


@pytest.mark.parametrize("settings", [{"other": 1}, {"target": 7}, {"target": " "}])
def test_page__without_a_name_has_a_title(settings: dict[str, Any]) -> None:
    assert data_of(to_html(house(settings=settings)))["title"] == "construction"


def test_target__is_the_mask_as_a_picture_of_its_own_resolution() -> None:
    target = painted(HOUSE, 96)
    kind, encoded = data_of(to_html(house(), target))["target"].split(",")
    assert kind == "data:image/png;base64"
    pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(encoded))).convert("RGBA"))
    np.testing.assert_array_equal(pixels[..., 3] == 255, target.mask)
    assert (pixels[target.mask] == 255).all()


def test_page__of_30_steps_over_a_noisy_target_stays_below_300_kb(tmp_path: Path) -> None:
    mesh, transitions = PolyMesh.rectangle(0.1, 0.1, 0.9, 0.9), []
    for step in range(30):
        action = Action("edge_subdivide", step % mesh.topology.n_edges)
        mesh = OPERATORS[action.operator].apply(mesh, action.element)
        mesh = mesh.with_vertices(mesh.vertices + np.random.default_rng(step).normal(0.0, 0.01, mesh.vertices.shape))
        transitions.append((action, None, mesh, score(50.0 + step)))
    sequence = ConstructionSequence.record({}, PolyMesh.rectangle(0.1, 0.1, 0.9, 0.9), score(50.0), transitions)
    noise = Silhouette(np.random.default_rng(7).random((2048, 2048)) < 0.5)
    assert save_html(sequence, tmp_path / "long.html", noise).stat().st_size < 300_000


def test_page__refuses_a_vertex_that_is_nowhere() -> None:
    sequence = house(1)
    lost = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75).with_vertices(np.full((4, 2), np.nan))
    with pytest.raises(SequenceError, match="not finite"):
        to_html(ConstructionSequence({}, lost, sequence.start_score))


def test_save__is_whole_or_not_there(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OutputError):
        save_html(house(), tmp_path / "file" / "player.html")
    assert save_html(house(), tmp_path / "new" / "player.html").read_text(encoding="utf-8") == to_html(house())


def test_words__name_elements_and_keys_of_every_operator() -> None:
    words = {step.operator: describe_step(step, len(step.moved)) for step in house().steps}
    assert words.keys() == OPERATORS.keys()
    assert (
        words["edge_subdivide"].done == "Edge 0–1 gets vertex 4 in its middle. Then 1 vertex moves to fit the target."
    )
    assert words["face_split"].keys[0].endswith("click vertex 4, `Shift` click vertex 2")
    assert words["edge_extrude"].keys[-1].startswith("`G`")
    assert words["face_delete"].done == "Face 3 is deleted. All vertices stay."
    keys = {"edge_subdivide": "Subdivide", "edge_extrude": "`E`", "face_split": "`J`", "face_delete": "`X` › Faces"}
    keys |= {"face_hole": "`K`", "vertex_dissolve": "`Ctrl` `X`", "edge_dissolve": "`X` › Dissolve Edges"}
    for operator, key in keys.items():
        assert key in " ".join(words[operator].keys)


def test_words__of_a_start_that_is_no_quad_count_its_faces() -> None:
    assert "a quad" in describe_start(PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)).done
    assert describe_start(PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0)).done == "The start has 4 faces."


# --- the page in a browser ---


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as running:
        yield running


Open = Callable[..., Page]


@pytest.fixture
def play(browser: Browser, tmp_path: Path) -> Iterator[Open]:
    """Opens a player; `before` is a script to run first, `still` a reader who wants no motion."""
    pages = []

    def open_it(
        sequence: ConstructionSequence | None = None,
        target: Silhouette | None = None,
        *,
        before: str = "",
        still: bool = True,
        at: str = "",
        **view: Any,
    ) -> Page:
        path = save_html(sequence or house(), tmp_path / "player.html", target)
        (tmp_path / "empty.html").touch()
        page = browser.open(tmp_path / "empty.html")
        pages.append(page)
        page.send("Page.addScriptToEvaluateOnNewDocument", source=before)
        page.emulate(still=still, **view)
        page.requests.clear()
        page.go(path.as_uri() + at)
        return page

    yield open_it
    for page in pages:
        page.close()


def text(page: Page, selector: str) -> str:
    return str(page.evaluate(f"document.querySelector({json.dumps(selector)}).textContent"))


def step_of(page: Page) -> int:
    """The step that slider, list, text and mesh agree on."""
    shown = page.evaluate(
        """[document.getElementById("step").valueAsNumber,
            [...document.querySelectorAll("#steps button")].findIndex(item => item.ariaCurrent === "step"),
            Number(document.getElementById("count").textContent.split(" / ")[0]),
            Number(/Step (\\d+) of/.exec(document.getElementById("which").textContent)?.[1] || 0)]"""
    )
    (step,) = set(shown)
    n_vertices = house(step).final().counts[0]
    assert page.evaluate("document.querySelectorAll('#vertices > g').length") == n_vertices
    return int(step)


def names(page: Page, selector: str) -> set[str]:
    """The names of mesh elements, as a reader hears them."""
    script = """[...document.querySelectorAll(SELECTOR)].map(element => {
      element.dispatchEvent(new PointerEvent("pointerover", {bubbles: true}));
      return document.getElementById("tag").textContent;
    })""".replace("SELECTOR", json.dumps(selector))
    return set(page.evaluate(script))


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
    assert corner(0.01) == pytest.approx((750, 750), abs=1)  # on vertex 2, from which it comes
    assert corner(1300 * 0.45) == pytest.approx((875, 750), abs=1)  # where the operator puts it
    halfway = corner(1300 * 0.725)
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
    page.evaluate("clock = 300; new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
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


# --- who reads it otherwise ---


@needs_browser
def test_every_control__has_a_name_and_a_role(play: Open) -> None:
    page = play(target=wanted())
    page.send("Accessibility.enable")
    nodes = page.send("Accessibility.getFullAXTree")["nodes"]
    found = {
        (node["role"]["value"], node["name"]["value"]) for node in nodes if node.get("name") and not node["ignored"]
    }
    assert {
        ("button", "Previous step"),
        ("button", "Play"),
        ("button", "Next step"),
        ("slider", "Step"),
        ("slider", "Opacity of the target"),
        ("switch", "Target"),
        ("heading", "house"),
    } <= found
    focusable = [
        node
        for node in nodes
        if {"name": "focusable", "value": {"type": "booleanOrUndefined", "value": True}} in node.get("properties", [])
    ]
    nameless = [node for node in focusable if node["role"]["value"] != "RootWebArea" and not node["name"]["value"]]
    assert len(focusable) > 10 and not nameless
    (image,) = (name for role, name in found if role == "image" and name.startswith("Score"))
    assert "best 81.50 at step 6" in image


@needs_browser
def test_step_text__is_announced_whole(play: Open) -> None:
    page = play()
    region = "document.querySelector('[aria-live=polite][aria-atomic=true]').innerText"
    page.press("Home")
    page.press("ArrowRight")
    assert page.evaluate(region).split("\n")[0] == "Step 1 of 7"
    assert "Edge 0–1 gets vertex 4" in page.evaluate(region)
    assert (
        page.evaluate("document.getElementById('step').getAttribute('aria-valuetext')")
        == "Step 1 of 7, Subdivide an edge"
    )


CONTRASTS = """(() => {
  const channels = colour => colour.match(/[\\d.]+/g).map(Number);
  const luminance = colour => channels(colour).slice(0, 3).map(value => value / 255)
    .map(value => value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4)
    .reduce((sum, value, i) => sum + value * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = element => {
    for (; element; element = element.parentElement) {
      const colour = getComputedStyle(element).backgroundColor;
      if ((channels(colour)[3] ?? 1) === 1) return colour;
    }
    return "rgb(255, 255, 255)";
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
  for (let node; (node = walker.nextNode());) {
    const element = node.parentElement;
    if (!node.data.trim() || !element.checkVisibility() || element.closest("script, style, noscript, title")) continue;
    const style = getComputedStyle(element), colour = element.namespaceURI.endsWith("svg") ? style.fill : style.color;
    const [a, b] = [luminance(colour), luminance(behind(element))];
    found.push([node.data.trim(), (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05)]);
  }
  return found;
})()"""


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
def test_contrast__of_every_text_is_at_least_4_5(play: Open, dark: bool) -> None:
    page = play(target=wanted(), dark=dark, at="#step-3")
    page.move_to("#faces > g")  # so that the name of an element is there, too
    contrasts = page.evaluate(CONTRASTS)
    assert {"house", "Step 3 of 7", "best 81.50", "face 0", "Target", "E"} <= {words for words, _ in contrasts}
    assert [pair for pair in contrasts if pair[1] < 4.5] == []


@needs_browser
def test_focus__is_seen_on_every_stop_of_the_tab_key(play: Open) -> None:
    page = play(target=wanted())
    look = """(() => {
      const element = document.activeElement, style = getComputedStyle(element);
      const mark = element.closest("#mesh") ? getComputedStyle(element.querySelector(".seen")) : style;
      return [element.id || element.className.baseVal || element.textContent,
              element.closest("#mesh") ? parseFloat(mark.strokeWidth) : parseFloat(mark.outlineWidth),
              element.closest("#mesh") ? mark.stroke : mark.outlineStyle];
    })()"""
    stops = []
    for _ in range(7):
        page.press("Tab")
        stops.append(page.evaluate(look))
    assert [stop[0] for stop in stops[1:]] == ["step", "previous", "play", "next", "show-target", "opacity"]
    for _, width, kind in stops:
        assert width >= 2 and kind not in ("none", "transparent")


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
def test_phone__shows_everything_without_scrolling_sideways(play: Open, dark: bool) -> None:
    long_name = house(settings={"target": "a-name-without-any-place-to-break-it-" * 4})
    page = play(long_name, wanted(), width=360, height=740, dark=dark)
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    assert page.evaluate("document.getElementById('stage').offsetHeight") >= 260
    small = page.evaluate(
        """[...document.querySelectorAll("button, input")].filter(control => control.checkVisibility())
        .map(control => [control.id, (control.closest("label") || control).getBoundingClientRect().height])
        .filter(([id, height]) => height < 24)"""
    )
    assert small == []
    below = page.evaluate("document.getElementById('card').offsetTop > document.getElementById('controls').offsetTop")
    assert below
