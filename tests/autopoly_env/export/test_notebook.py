"""What notebooks show: sequences as players, meshes and states as drawings, and nothing leaks into the page around."""

import subprocess
import sys
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path

import pytest

from autopoly_env.export import to_html, to_svg
from autopoly_env.mesh import PolyMesh
from autopoly_env.score import Score
from autopoly_env.simulator import State
from tests.helpers.browser import Browser, needs_browser
from tests.helpers.constructions import house
from tests.helpers.paths import ROOT

SVG = "{http://www.w3.org/2000/svg}"
QUAD = PolyMesh.rectangle(0.25, 0.125, 0.75, 0.5)
HOSTILE = "\"'></iframe><script>parent.hacked = 1</script>"


class Tags(HTMLParser):
    """The tags of a text with their attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))


def test_sequence__is_the_player_in_a_frame_of_its_own() -> None:
    ((tag, attributes),) = Tags(house()._repr_html_()).found
    assert tag == "iframe" and attributes["srcdoc"] == to_html(house())
    assert attributes["title"] == "Construction of house"
    assert attributes["sandbox"] == "allow-scripts"  # not allow-same-origin: it cannot reach the notebook


def test_sequence__keeps_a_hostile_name_inside_its_frame() -> None:
    sequence = house(settings={"target": HOSTILE})
    ((tag, attributes),) = Tags(sequence._repr_html_()).found
    assert tag == "iframe" and attributes["srcdoc"] == to_html(sequence)


@needs_browser
def test_frame__plays_in_a_page_and_does_not_reach_out_of_it(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "notebook.html"
    path.write_text(f"<!doctype html><body>{house(settings={'target': HOSTILE})._repr_html_()}", encoding="utf-8")
    page = browser.open(path)
    assert page.evaluate("document.querySelector('iframe').offsetHeight") == 620
    assert page.evaluate("typeof hacked") == "undefined"
    assert page.evaluate("document.querySelector('iframe').contentDocument") is None
    assert page.problems() == []


@pytest.mark.parametrize("shown", [QUAD, State(QUAD, Score(0.5, 9, 0, 41.0))])
def test_mesh_and_state__are_the_drawing_of_the_mesh(shown: PolyMesh | State) -> None:
    root = ET.fromstring(shown._repr_svg_())
    assert root.get("width") == "320"
    (face,) = (path for path in root.iter(f"{SVG}path") if path.get("id") == "face-0")
    assert face.get("d") == "M 80 40 L 240 40 L 240 160 L 80 160 Z"


def test_drawing__has_no_style_sheet_that_would_reach_other_drawings() -> None:
    assert not list(ET.fromstring(to_svg(QUAD)).iter(f"{SVG}style"))


@pytest.mark.slow
def test_core__loads_the_writers_only_when_they_are_asked_for() -> None:
    code = (
        "import sys; from autopoly_env import mesh, sequence; quad = mesh.PolyMesh.rectangle(0, 0, 1, 1);"
        "assert not [name for name in sys.modules if name.startswith('autopoly_env.export')];"
        "assert quad._repr_svg_().startswith('<svg')"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
