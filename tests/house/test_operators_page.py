"""The page of the operators: its pictures are what the script draws, its table is the registry."""

import re
from pathlib import Path

import numpy as np
from PIL import Image

from autopoly_env.operators import OPERATORS, PRESETS
from docs import draw_operators


def test_operator_pictures__are_what_the_script_draws(tmp_path: Path) -> None:
    draw_operators.main(tmp_path)
    kept = {path.name: path for path in draw_operators.PICTURES.glob("operator_*.png")}
    assert kept.keys() == {f"operator_{name}.png" for name in OPERATORS} == {p.name for p in tmp_path.iterdir()}
    for name, path in kept.items():
        assert path.stat().st_size < 30_000, name
        with Image.open(path) as old, Image.open(tmp_path / name) as new:
            np.testing.assert_array_equal(np.asarray(old), np.asarray(new), err_msg=name)


def doc_text() -> str:
    return (draw_operators.PICTURES.parent / "operators.md").read_text(encoding="utf-8")


def test_operators_doc__has_the_registry_in_its_table() -> None:
    table = doc_text().partition("\n## ")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if "| `" in line]
    stated = []
    for name, element, effect, changes, presets in rows:
        numbers = [int(number.replace("−", "-")) for number in re.findall(r"[+−]?\d+", changes)]
        triples = tuple(tuple(numbers[i : i + 3]) for i in range(0, len(numbers), 3))
        stated.append((name.strip("`"), element, effect, triples, re.findall(r"`(\w+)`", presets)))
    assert stated == [
        (o.name, o.element.name, o.effect, o.changes, [name for name, operators in PRESETS.items() if o in operators])
        for o in OPERATORS.values()
    ]


def test_operators_doc__has_a_section_with_its_picture_for_each() -> None:
    sections = re.findall(r"^## (\w+)\n\n!\[[^]]+\]\(pictures/operator_(\w+)\.png\)\n", doc_text(), re.MULTILINE)
    assert sections == [(name, name) for name in OPERATORS]
