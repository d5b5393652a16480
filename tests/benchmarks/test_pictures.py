"""The benchmark of pictures: right masks by rule, sprites on three grounds, what is silent."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks import pictures
from tests.helpers.pictures import SIZE, chair, painted


def test_cases__are_compared_by_the_rule_of_their_name(tmp_path: Path) -> None:
    Image.fromarray(painted(chair())).save(tmp_path / pictures.BASE)
    Image.fromarray(painted(chair(), (255, 0, 0), (76, 76, 76))).save(tmp_path / "red-on-equal-luma-grey.png")
    Image.new("L", (9, 9)).save(tmp_path / "all-black.png")
    found = list(pictures.cases(tmp_path))
    assert [(one.name, one.iou) for one in found] == [
        ("all-black.png", 1.0),
        (pictures.BASE, 1.0),
        ("red-on-equal-luma-grey.png", 1.0),
    ]


def test_sprites__are_put_on_grounds_on_which_they_are_to_be_seen(tmp_path: Path) -> None:
    alpha = np.where(chair(), 255, 0).astype(np.uint8)
    Image.fromarray(np.dstack([painted(chair(), (255, 255, 255)), alpha])).save(tmp_path / "white.png")
    Image.new("RGB", (SIZE, SIZE), "red").save(tmp_path / "opaque.png")
    found = dict(pictures.sprites(tmp_path))
    assert found["white"] is None
    assert [found[ground].iou for ground in ("grey 200", "colour")] == [1.0, 1.0]


def test_command__prints_both_tables(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Image.fromarray(painted(chair())).save(tmp_path / pictures.BASE)
    assert pictures.main(["--cases", str(tmp_path), "--sprites", str(tmp_path)]) == 0
    assert "1 of 1 right by default; wrong and not said: 0" in capsys.readouterr().out
