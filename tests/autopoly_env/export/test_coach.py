"""Lessons for the coach in Blender: what stands in them."""

import base64
import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from autopoly_env.errors import SequenceError
from autopoly_env.export.coach import digest_of, lesson_of, save_lesson
from autopoly_env.silhouette import Silhouette
from tests.helpers.constructions import house

LESSON = lesson_of(house())


def test_lesson__has_the_start_and_then_what_each_step_changes() -> None:
    start, first, second = LESSON["steps"][:3]
    assert start["vertices"] == {"0": (0.25, 0.75), "1": (0.75, 0.75), "2": (0.75, 0.25), "3": (0.25, 0.25)}
    assert start["faces"] == {"0": (0, 3, 2, 1)}  # counter-clockwise, where y goes up
    assert first["vertices"] == {"4": (0.5, 0.875)}
    assert first["faces"] == {"0": (0, 3, 2, 1, 4)}
    assert second["vertices"] == {} and second["faces"] == {"0": (0, 3, 2, 4), "1": (4, 2, 1)}


def test_lesson__says_how_blender_is_called_and_what_is_pointed_at() -> None:
    first, second, third = LESSON["steps"][1:4]
    assert first["call"] == ["edge_subdivide", [0, 1]] and first["picks"] == (("edge", (0, 1)),)
    assert first["aims"] == {"4": (0.5, 0.875)}
    assert second["call"] == ["face_split", [0, 2, 4]] and second["picks"] == (("vertex", (4,)), ("vertex", (2,)))
    assert third["call"] == ["edge_extrude", [1, 2]]
    assert first["lines"][1] == ["Right-click › Subdivide: both halves", "Edge mode; edges 0–4 and 1–4 are selected."]


def test_lesson__says_what_is_gone() -> None:
    dissolved = LESSON["steps"][5]
    assert dissolved["operator"] == "vertex_dissolve" and dissolved["vertices"] == {"5": None}
    deleted = LESSON["steps"][7]
    assert deleted["operator"] == "face_delete" and deleted["faces"] == {"3": None}


def test_lesson__has_the_picture_and_knows_its_sequence(tmp_path: Path) -> None:
    house().save(tmp_path / "sequence.json")
    path = save_lesson(house(), tmp_path / "lesson.json", Silhouette(np.tri(16, dtype=bool)))
    lesson = json.loads(path.read_text(encoding="utf-8"))
    assert lesson["of"] == digest_of((tmp_path / "sequence.json").read_text(encoding="utf-8"))
    with Image.open(io.BytesIO(base64.b64decode(lesson["picture"]))) as picture:
        assert picture.size == (16, 16)


def test_step_that_does_not_replay__is_refused_and_nothing_written(tmp_path: Path) -> None:
    sequence = house()
    broken = replace(sequence.steps[2], element={"edge": [4, 2]})
    with pytest.raises(SequenceError, match=r"^step 3, edge_extrude edge 4–2: "):
        save_lesson(replace(sequence, steps=(*sequence.steps[:2], broken)), tmp_path / "lesson.json")
    assert not list(tmp_path.iterdir())
