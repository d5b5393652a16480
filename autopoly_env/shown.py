"""Text and values from outside as they are shown: nothing in them acts on a terminal, and none of them fills it."""

import reprlib
from typing import Any

MOST_LETTERS = 400  # of a message
_SHORT = 60  # letters of a value in it
_KEPT = 0.6  # of the letters that a message may have, from its beginning; the others are from its end


def tame(text: str) -> str:
    r"""The text with whatever does not print (line ends, escapes, bidi marks, lone surrogates) written out.

    >>> print(tame("a\x1b[2J\n b"))
    a\x1b[2J\n b
    """
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() else _written(letter) for letter in text)


def told(text: str, most: int = MOST_LETTERS) -> str:
    """The text in one tame line of at most `most` letters: its beginning, and its end, which says what to do.

    >>> told("0123456789" * 9, 20)
    '012345678 ... 456789'
    """
    if len(text) > 8 * most:  # so that no more is gone through than can be shown
        text = f"{text[: 4 * most]} {text[-4 * most :]}"
    line = tame(" ".join(text.split()))
    if len(line) <= most:
        return line
    n = round(_KEPT * (most - 5))
    return f"{line[:n].rstrip()} ... {line[len(line) - (most - 5 - n) :].lstrip()}"


def counted(count: int, noun: str) -> str:
    """How many of something.

    >>> counted(1, "hole"), counted(0, "hole"), counted(2, "process")
    ('1 hole', '0 holes', '2 processes')
    """
    return f"{count} {noun}" if count == 1 else f"{count} {noun}{'es' if noun.endswith('s') else 's'}"


def short(value: Any, most: int = _SHORT) -> str:
    """A value as Python writes it, of at most `most` letters; what it holds is not gone through beyond that."""
    look = reprlib.Repr()
    look.maxlevel, look.maxstring, look.maxother = 3, most, most
    try:
        text = look.repr(value)
    except ValueError:  # a whole number with more digits than Python writes
        text = f"a whole number of {value.bit_length()} bits" if isinstance(value, int) else f"a {type(value).__name__}"
    return text if len(text) <= most else f"{text[: most - 3]}..."


def _written(letter: str) -> str:
    return letter.encode("unicode_escape").decode("ascii")
