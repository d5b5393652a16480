"""The player for every reader: names and roles, announcements, contrast, focus, a phone."""

import pytest

from tests.helpers.browser import needs_browser
from tests.helpers.constructions import house
from tests.helpers.player import Open, wanted


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
    for _ in range(13):
        page.press("Tab")
        stops.append(page.evaluate(look))
    controls = ["before", "after", "step", "previous", "play", "next", "speed", "show-names", "guess", "print"]
    assert [stop[0] for stop in stops[1:]] == [*controls, "show-target", "opacity"]
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
