"""Text from outside as it is shown: one line, tame, not too long; and the errors, which all are."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from autopoly_env import errors
from autopoly_env.shown import MOST_LETTERS, short, tame, told

ERRORS = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, errors.AutoPolyError)]


@given(st.text(st.characters(codec=None, exclude_categories=())), st.integers(10, 90))
@example("\x1b\r\U0001342f", 13)  # cut at a space
def test_told__is_one_printable_line_of_so_many_letters(text: str, most: int) -> None:
    line = told(text, most)
    assert line.isprintable()
    assert len(line) <= most
    assert told(line, most) == line


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126)))
def test_tame__leaves_alone_what_prints(text: str) -> None:
    assert tame(text) == text


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("\x1b]0;PWN\x07\x1b[2J", r"\x1b]0;PWN\x07\x1b[2J"),
        ("b\nc\t.png", r"b\nc\t.png"),
        ("\u202egnp.exe", r"\u202egnp.exe"),
        ("\udc80", r"\udc80"),
        ("\x9b31m", r"\x9b31m"),
        ("é – 木", "é – 木"),
    ],
)
def test_tame__writes_out_what_acts_on_a_terminal(given: str, shown: str) -> None:
    assert tame(given) == shown


def test_told__keeps_the_beginning_and_the_end_of_what_is_too_long() -> None:
    line = told("lock " + "9" * 100_000 + ": give ids")
    assert len(line) == MOST_LETTERS
    assert line.startswith("lock 999")
    assert line.endswith("999: give ids")


def nested(depth: int, width: int) -> list[object]:
    """A list that is small in memory and would be `width ** depth` items long if written out."""
    value: list[object] = []
    for _ in range(depth):
        value = [value] * width
    return value


HUGE = [nested(60, 9), "x" * 10**6, 10**5000, -(10**5000), [10**5000], {"a": "b" * 99}, b"\0" * 999]


@pytest.mark.parametrize("number", range(len(HUGE)))
def test_short__is_short_whatever_the_value_is(number: int) -> None:
    assert 0 < len(short(HUGE[number])) <= 60


def test_short__is_how_python_writes_what_is_short() -> None:
    assert short({"w_sc": [0.3, "one\n"]}) == "{'w_sc': [0.3, 'one\\n']}"


@pytest.mark.parametrize("kind", ERRORS, ids=[kind.__name__ for kind in ERRORS])
def test_error__is_one_tame_line_whatever_was_given(kind: type[errors.AutoPolyError]) -> None:
    message = str(kind("a \x1b[2J\nb" + "c" * 10**6 + "; give less"))
    assert message.startswith(r"a \x1b[2J bccc")
    assert message.endswith("ccc; give less")
    assert len(message) == MOST_LETTERS
    assert str(kind("short; as it is")) == "short; as it is"
