"""The player's page as a text: its data, its names, its words, and what it never asks for."""

import base64
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from autopoly_env.errors import OutputError, SequenceError
from autopoly_env.export import save_html, to_html
from autopoly_env.export.player import describe_start, describe_step
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from tests.helpers.constructions import TOTALS, chapel, house, score
from tests.helpers.drawings import HOUSE, painted
from tests.helpers.player import HOSTILE, wanted
from tests.helpers.tables import table


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


def test_page__names_parts_and_tells_what_steps_take_by_hand() -> None:
    data = data_of(to_html(table()))
    assert [step["part"] for step in data["steps"][1:]] == ["body", "body", "lower right, 1 of 2", "lower left, 2 of 2"]
    assert [step["seconds"] for step in data["steps"][1:]] == [7.03, 7.03, 4.23, 4.23]
    assert data["lesson"] == ["23 s by hand", "3 parts", "0 returns", "67 % quads", "1 n-gon"]
    cut, leg = ([line["words"] for line in data["steps"][k]["lines"]] for k in (1, 3))
    assert "`G`" in cut[-1] and leg[-1].startswith("`E`: pull the new edge out")  # which puts it in its place


def test_page__of_one_part_says_nothing_of_parts() -> None:
    assert data_of(to_html(house(2)))["lesson"] == ["12 s by hand", "50 % quads"]


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


def test_words__name_elements_of_every_operator() -> None:
    steps = (*house().steps, *chapel().steps)
    words = {step.operator: describe_step(step, len(step.moved)) for step in steps}
    assert words.keys() == OPERATORS.keys()
    assert words["edge_fill"].done == "Edge 1–4 and edge 1–5 are joined by a new face, face 3. All vertices stay."
    assert words["vertex_merge"].done == "Vertex 9 is merged into vertex 6. All vertices stay."
    cut = "An edge loop is cut through 2 quads, across edge 0–1, and adds 3 vertices. All vertices stay."
    assert words["loop_cut"].done == cut
    assert words["face_inset"].done == "Face 6 gets a ring of 4 quads around its middle. All vertices stay."
    assert (
        words["edge_subdivide"].done == "Edge 0–1 gets vertex 4 in its middle. Then 1 vertex moves to fit the target."
    )
    assert words["face_delete"].done == "Face 3 is deleted. All vertices stay."


def test_words__of_a_start_that_is_no_quad_count_its_faces() -> None:
    assert "a quad" in describe_start(PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)).done
    assert describe_start(PolyMesh.grid(2, 0.0, 0.0, 1.0, 1.0)).done == "The start has 4 faces."
