"""The benchmark of a style against single agents: who is compared, what is below, what a run goes on from."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks import never_below
from benchmarks.never_below import Built


def square(folder: Path) -> Path:
    picture = np.full((64, 64), 255, np.uint8)
    picture[16:48, 16:48] = 0
    path = folder / "square.png"
    Image.fromarray(picture).save(path)
    return path


def built(picture: Path, agent: str, r_all: float) -> Built:
    return Built(str(picture), "modeller", 0.3, agent, r_all, 1, 0.5)


def test_style__is_compared_with_the_agents_that_take_its_rule(tmp_path: Path) -> None:
    lines = tmp_path / "lines.jsonl"
    path = square(tmp_path)
    assert never_below.main([str(path), "--json", str(lines)]) == 0
    found = [Built(**json.loads(line)) for line in lines.read_text().splitlines()]
    assert [one.agent for one in found] == ["quads", "greedy"]  # nobody else builds in quads
    assert [one.r_all for one in found] == pytest.approx([100 - 0.3 * 9] * 2)


def test_run__goes_on_from_its_lines_and_fails_where_the_style_is_worth_less(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, lines = square(tmp_path), tmp_path / "lines.jsonl"
    for greedy, code in ((80.04, 0), (80.06, 1)):
        kept = [built(path, "quads", 80.0), built(path, "greedy", greedy)]
        lines.write_text("".join(json.dumps(asdict(one)) + "\n" for one in kept))
        assert never_below.main([str(path), "--json", str(lines)]) == code
        assert len(lines.read_text().splitlines()) == 2
    assert f"{path}: quads 80.00, greedy 80.06" in capsys.readouterr().out
