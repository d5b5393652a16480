"""How a lesson is shown."""

import json

from autopoly_env.export.coach import lesson_of
from blender.autopoly_coach.lesson import parse
from blender.autopoly_coach.telling import HEAD, Row, rows_of, wrapped
from tests.helpers.constructions import house


def test_rows__are_the_steps_alone_where_there_is_one_part() -> None:
    lesson = parse(json.dumps(lesson_of(house(2))))
    assert rows_of(lesson) == [Row(0, "0  Start"), Row(1, "1  Subdivide an edge"), Row(2, "2  Split a face")]


def test_rows__stand_under_the_names_of_parts() -> None:
    sequence = house(3).with_parts(["body", "roof", "roof"])
    rows = rows_of(parse(json.dumps(lesson_of(sequence))))
    assert [row.words for row in rows if row.number == HEAD] == ["Body", "Roof"]
    assert [row.number for row in rows] == [HEAD, 0, 1, HEAD, 2, 3]


def test_lines__fit_and_show_keys_in_brackets() -> None:
    lines = wrapped("`2` edge select, click edge 0–1 and `E`", 120.0)
    assert lines == ["[2] edge select,", "click edge 0–1 and", "[E]"]
    assert wrapped("", 500.0) == [""]
    assert len(wrapped("word " * 20, 500.0, scale=2.0)) > len(wrapped("word " * 20, 500.0))
