"""The table of Blender's modifiers: what counts as right, and what real Blender makes of a vase."""

from pathlib import Path
from typing import Any

import pytest

from autopoly_env.errors import ConfigError
from autopoly_env.export.blender import find_blender
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence
from benchmarks import modifiers_in_blender
from benchmarks.modifiers_in_blender import main, table
from tests.helpers.sequences import SCORE
from tests.helpers.shapes import polygon
from tests.helpers.vases import cut_anyhow, vase

SQUARE = PolyMesh.rectangle(0.0, 0.0, 1.0, 1.0)
PLAIN = {"area": 1.0, "volume": 0.05, "turned": 0, "open": 0}
RIGHT = dict.fromkeys(("simple", "smooth", "solid", "bevelled", "mirrored"), PLAIN)


@pytest.mark.parametrize(
    ("key", "change", "is_right"),
    [
        ("simple", {}, True),
        ("simple", {"area": 1.0 + 1e-4}, False),
        ("simple", {"turned": 1}, False),
        ("smooth", {"area": 0.6, "turned": 3}, True),  # it rounds, and turns over what is thinner
        ("solid", {"volume": 0.051}, False),
        ("solid", {"volume": -0.05}, False),
        ("bevelled", {"open": 2, "volume": 0.049}, False),
        ("bevelled", {"volume": 0.049}, True),
        ("mirrored", {"area": 0.5}, False),
    ],
)
def test_table__says_what_is_wrong(key: str, change: dict[str, float], is_right: bool) -> None:
    lines, found = table([SQUARE], [RIGHT | {key: PLAIN | change}])
    assert found is is_right and len(lines) == 2 + len(RIGHT)


def test_mesh_without_a_half__is_not_counted() -> None:
    lines, _ = table([SQUARE, SQUARE], [RIGHT, {key: RIGHT[key] for key in RIGHT if key != "mirrored"}])
    assert lines[2].startswith("| Subdivision Surface, Simple | 2 | area 0.0e+00 | 0 |")
    assert lines[-1] == "| Mirror, of the half | 1 | area 0.0e+00 | 0 |  |"


@pytest.mark.slow
def test_blender__is_asked_and_keeps_areas_and_volumes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        find_blender()
    except ConfigError as error:
        pytest.skip(str(error))
    for seed in range(2):
        folder = tmp_path / str(seed)
        folder.mkdir()
        mesh = cut_anyhow(polygon(vase(seed, 1)), seed, 4)
        ConstructionSequence({}, mesh, SCORE).save(folder / "sequence.json")
    assert main([str(tmp_path)]) == 0
    assert "| Mirror, of the half | 2 | area " in capsys.readouterr().out


def test_folder_without_sequences_or_no_blender__is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(SystemExit):
        main([str(tmp_path)])
    assert "no sequence.json below" in capsys.readouterr().err

    def absent(*_: Any, **__: Any) -> None:
        raise ConfigError("Blender was not found")

    monkeypatch.setattr(modifiers_in_blender, "ask_blender", absent)
    ConstructionSequence({}, SQUARE, SCORE).save(tmp_path / "sequence.json")
    assert main([str(tmp_path)]) == 2
    assert capsys.readouterr().err == "error: Blender was not found\n"
