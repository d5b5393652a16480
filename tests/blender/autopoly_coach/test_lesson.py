"""Lessons read: they have the meshes of their sequences, and whatever is no lesson is refused in a line."""

import base64
import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopoly_env.export.coach import lesson_of
from autopoly_env.sequence import ConstructionSequence
from blender.autopoly_coach.lesson import LessonError, format_of, parse, read
from tests.helpers.coaching import BROKEN
from tests.helpers.constructions import chapel, house
from tests.helpers.sequences import walked

TEXT = json.dumps(lesson_of(house()))


@pytest.mark.parametrize("sequence", [house(), chapel(), walked(3, 20), walked(4, 20, 0.01, "modeller")])
def test_meshes__are_those_of_the_sequence(sequence: ConstructionSequence) -> None:
    lesson = parse(json.dumps(lesson_of(sequence)))
    assert lesson.last == len(sequence.steps)
    for step, mesh in zip(lesson.steps, sequence.meshes(), strict=True):
        assert step.counts == mesh.counts and tuple(step.vertices) and set(step.faces) == set(mesh.face_ids)
        places = np.array([step.vertices[name] for name in mesh.vertex_ids])
        assert np.abs(places * (1, -1) + (0, 1) - mesh.vertices).max() <= 1e-7
        rings = {name: [mesh.vertex_ids[v] for v in ring] for name, ring in zip(mesh.face_ids, mesh.faces, strict=True)}
        for name, ring in step.faces.items():
            back = [ring[0], *ring[:0:-1]]
            assert back == rings[name]


def test_words__are_one_printable_line() -> None:
    lesson = lesson_of(house(settings={"target": "a\nb\x1b[31m"}))
    lesson["steps"][1]["title"] = "Sub\ndivide\x07"
    assert parse(json.dumps(lesson)).steps[1].title == "Sub divide "


@given(st.integers(0, len(TEXT) - 1), st.binary(max_size=4))
def test_damaged_text__is_a_lesson_or_refused_in_a_line(where: int, instead: bytes) -> None:
    damaged = TEXT[:where] + instead.decode("latin-1") + TEXT[where + len(instead) :]
    try:
        parse(damaged)
    except LessonError as error:
        assert "\n" not in str(error) and str(error).isprintable()


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@given(st.sampled_from(sorted(lesson_of(house())["steps"][1])), st.integers(0, 7), JSON)
def test_field_that_is_something_else__is_taken_or_refused_in_a_line(field: str, number: int, value: Any) -> None:
    lesson = json.loads(TEXT)
    lesson["steps"][number][field] = value
    try:
        parse(json.dumps(lesson))
    except LessonError as error:
        assert "\n" not in str(error) and len(str(error)) < 300


@pytest.mark.parametrize("name", BROKEN)
def test_lesson_that_makes_no_sense__is_refused(name: str) -> None:
    lesson = json.loads(TEXT)
    BROKEN[name](lesson["steps"])
    with pytest.raises(LessonError, match=r"^(step \d of the lesson is damaged \(.*\)|the lesson has no list)"):
        parse(json.dumps(lesson))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "this is no JSON, or only a piece of it"),
        ("[" * 100_000, "this is no JSON"),
        ("[1]", "this JSON is no lesson"),
        ('{"format": "glTF"}', "the format is 'glTF', not 'autopoly-lesson'"),
        (TEXT.replace('"version": 1', '"version": 2'), "the lesson has version 2, and this coach reads 1"),
        (TEXT.replace('"version": 1', '"version": true'), "the lesson has version True"),
        (TEXT.replace('"picture": ""', '"picture": "?"'), "the head of the lesson is damaged"),
        (TEXT.replace('"name": "house"', '"name": 7'), "the head of the lesson is damaged"),
    ],
)
def test_what_is_no_lesson__is_refused(text: str, message: str) -> None:
    with pytest.raises(LessonError) as refusal:
        parse(text)
    assert str(refusal.value).startswith(message)


def png(width: int, height: int) -> str:
    """The beginning of a PNG that says it is so large."""
    head = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + width.to_bytes(4, "big") + height.to_bytes(4, "big")
    return base64.b64encode(head).decode("ascii")


@pytest.mark.parametrize(
    ("picture", "is_taken"), [("", True), (png(768, 768), True), (png(1, 10**6), False), ("R0lGODlh", False)]
)
def test_picture__is_a_png_that_can_be_shown(picture: str, is_taken: bool) -> None:
    text = json.dumps(json.loads(TEXT) | {"picture": picture})
    if is_taken:
        assert parse(text).picture == base64.b64decode(picture)
    else:
        with pytest.raises(LessonError, match=r"its picture is no PNG of at most 4096 pixels a side"):
            parse(text)


def test_lesson_that_would_fill_the_memory__is_refused() -> None:
    lesson = json.loads(TEXT)
    n = 600
    rings = {str(k): [3 * k, 3 * k + 1, 3 * k + 2] for k in range(n)}
    lesson["steps"][0] |= {"vertices": {str(k): [k, k % 3] for k in range(3 * n)}, "faces": rings}
    lesson["steps"][1:] = [{**lesson["steps"][0], "vertices": {}, "faces": {}}] * 1000
    with pytest.raises(LessonError, match=r"^up to step 208 there are 501600 vertices and faces; a lesson has 500000"):
        parse(json.dumps(lesson))


def test_format_of__tells_a_sequence_from_a_lesson() -> None:
    assert format_of(TEXT) == "autopoly-lesson"
    assert format_of(house().to_json()) == "autopoly-construction-sequence"
    with pytest.raises(LessonError, match="does not say that it is a lesson"):
        format_of("{}")


def test_file_that_cannot_be_read__is_named(tmp_path: Any) -> None:
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe\xfa")
    for path, message in ((tmp_path, "is not there"), (tmp_path / "gone.json", "is not there")):
        with pytest.raises(LessonError, match=message):
            read(path)
    with pytest.raises(LessonError, match=r"^bytes\.json cannot be read \(it is no text\)"):
        read(tmp_path / "bytes.json")
