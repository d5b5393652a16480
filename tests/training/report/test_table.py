"""The table on a screen: what does not fit into one part comes in the next, and nothing is cut."""

import io

import pytest
from rich.console import Console

from training.report.table import Cell, Line, as_rich_parts

HEADS = ("agent", "shapes", "r_sm", "r_sc", "r_si", "r_all", "refits", "seconds", "won–tied–lost")
NUMBERS = ("0.9722", "26.1", "0.00", "89.42", "1,984", "2.89")


def lines(label: str) -> list[Line]:
    cells = [Cell(text, "123.456 to 234.567") for text in NUMBERS]
    row = Line([Cell(label), Cell("50"), *cells, Cell("12–3–35")])
    return [row, Line([Cell("  in print"), *(Cell(text) for text in ("", *NUMBERS, ""))], is_quoted=True)]


def shown(label: str, width: int) -> str:
    console = Console(file=io.StringIO(), width=width)
    for part in as_rich_parts(HEADS, lines(label), width):
        console.print(part)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


@pytest.mark.parametrize("width", [60, 80, 132])
@pytest.mark.parametrize("label", ["mcts", "an agent whose label is a whole sentence, and then some more of it"])
def test_table__shows_every_head_and_number_uncut(width: int, label: str) -> None:
    text = shown(label, width)
    assert "…" not in text and max(map(len, text.splitlines())) <= width
    assert all(word in text for word in (*HEADS, *NUMBERS, "123.456 to 234.567", "12–3–35"))
    assert all(word in text for word in label.split())


def test_table__is_one_part_where_it_fits() -> None:
    assert len(as_rich_parts(HEADS, lines("mcts"), 200)) == 1
    assert len(as_rich_parts(HEADS, lines("mcts"), 80)) > 1
