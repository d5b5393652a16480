"""Variants of a construction, and the command `python -m agents.vary`."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image

from agents.retell.variants import draw_variants
from agents.vary import main
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence
from tests.helpers.commands import Run, runner
from tests.helpers.paths import ROOT
from tests.helpers.tables import table


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs the command in an empty folder; gives `code`, `out` and `err`."""
    monkeypatch.chdir(tmp_path)
    return runner(main, capsys)


# Variants


def crosses(mesh: PolyMesh) -> bool:
    edges = shapely.linestrings(mesh.vertices[mesh.edges])
    return any(a.crosses(b) for i, a in enumerate(edges) for b in edges[:i])


@pytest.mark.parametrize("amount", [0.05, 0.15, 0.3])
def test_variants__have_no_defect_in_any_prefix_and_lie_in_the_unit_square(amount: float) -> None:
    variants = [variant for variant in draw_variants(table(), 12, amount, 1) if variant is not None]
    assert len(variants) >= 11
    for variant in variants:
        for mesh in ConstructionSequence.from_json(variant.sequence.to_json()).meshes():
            assert not crosses(mesh)
            assert (mesh.face_areas() > 0.0).all()
            assert 0.0 <= mesh.vertices.min() and mesh.vertices.max() <= 1.0


def test_variants__differ_from_each_other_by_a_good_part_of_the_amount() -> None:
    finals = [table().final().vertices]
    finals += [variant.sequence.final().vertices for variant in draw_variants(table(), 8, 0.1, 0) if variant]
    assert len(finals) == 9
    for i, one in enumerate(finals):
        assert all(np.hypot(*(one - other).T).max() > 0.02 for other in finals[:i])


def is_symmetric(mesh: PolyMesh) -> bool:
    low, high = mesh.vertices[:, 0].min(), mesh.vertices[:, 0].max()
    images = [low + high, 0.0] + [-1.0, 1.0] * mesh.vertices
    return all(np.abs(mesh.vertices - image).max(axis=1).min() < 1e-9 for image in images)


def tilted(mesh: PolyMesh) -> list[tuple[int, int]]:
    """Edges by their ids that are neither level nor plumb; all edges of the table are one of them."""
    ends = [(mesh.vertex_ids[a], mesh.vertex_ids[b]) for a, b in mesh.edges.tolist()]
    ways = np.abs(mesh.vertices[mesh.edges[:, 0]] - mesh.vertices[mesh.edges[:, 1]])
    return [pair for pair, way in zip(ends, ways, strict=True) if way.min() > 1e-12]


@pytest.mark.parametrize("keep_level", [False, True])
def test_variants__of_a_symmetric_construction_are_symmetric_unless_told_otherwise(keep_level: bool) -> None:
    assert is_symmetric(table().final())
    kept, free = (
        [v for v in draw_variants(table(), 6, 0.1, 2, keep_level=keep_level, keep_symmetry=keep) if v]
        for keep in (True, False)
    )
    assert len(kept) >= 5 and all(is_symmetric(variant.sequence.final()) for variant in kept)
    assert not all(is_symmetric(variant.sequence.final()) for variant in free)


@pytest.mark.parametrize("keep_symmetry", [False, True])
def test_variants__keep_level_and_plumb_edges_so_if_asked_to(keep_symmetry: bool) -> None:
    assert tilted(table().final()) == []
    kept, free = (
        [v for v in draw_variants(table(), 6, 0.1, 3, keep_level=keep, keep_symmetry=keep_symmetry) if v]
        for keep in (True, False)
    )
    assert len(kept) >= 5 and all(tilted(mesh) == [] for v in kept for mesh in v.sequence.meshes())
    assert any(tilted(variant.sequence.final()) for variant in free)


def test_variants__move_the_same_vertices_as_before_in_every_later_step() -> None:
    def moved(sequence: ConstructionSequence, first: int) -> list[list[int]]:
        return [sorted(name for name, _, _ in step.moved) for step in sequence.steps[first:]]

    for variant in draw_variants(table(), 6, 0.1, 4, keep_level=True):
        assert variant is None or moved(variant.sequence, variant.step) == moved(table(), variant.step)


def test_variants__depend_on_the_seed_alone() -> None:
    first, second, other = (
        [variant and variant.sequence.to_json() for variant in draw_variants(table(), 3, 0.1, seed)]
        for seed in (0, 0, 1)
    )
    assert first == second != other


# The command


def test_command__writes_a_folder_for_each_variant_and_a_sheet(run: Run) -> None:
    table().save("table.json")
    done = run("table.json", "--n", 2, "--out", "made")
    assert (done.code, done.err) == (0, "")
    assert "Open made/variants.png" in done.out
    assert sorted(os.listdir("made")) == ["variant-1", "variant-2", "variants.png"]
    assert {"sequence.json", "mesh.svg"} <= set(os.listdir("made/variant-1"))
    told = ConstructionSequence.load("made/variant-2/sequence.json")
    assert told.final().topology == table().final().topology
    assert Image.open("made/variants.png").size[0] == 2 * 256


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("table.json", "--n", 0), 2, "--n 0"),
        (("table.json", "--amount", "nan"), 2, "--amount nan"),
        (("table.json", "--amount", -0.1), 2, "--amount -0.1"),
        (("table.json", "--amount", "inf"), 2, "--amount inf"),
        (("table.json", "--seed", -1), 2, "--seed -1"),
        (("table.json", "--n", "many"), 2, "--n"),
        (("nothing.json",), 1, "cannot read nothing.json"),
        (("broken.json",), 1, "broken.json: not JSON"),
        (("illegal.json",), 1, "illegal.json: step 3, edge_extrude edge 2–3: no edge"),
        (("unknown.json",), 1, "operator 'edge_melt' is unknown"),
        (("crossed.json",), 1, "crossed.json: step 4: the mesh after it crosses itself"),
        (("table.json", "--out", "table.json"), 1, "table.json"),
    ],
)
def test_command__tells_in_a_line_what_is_wrong(run: Run, arguments: tuple[Any, ...], code: int, message: str) -> None:
    table().save("table.json")
    Path("broken.json").write_text(table().to_json()[:300])
    for name, key, value in (("illegal", "element", {"edge": [2, 3]}), ("unknown", "operator", "edge_melt")):
        data = json.loads(table().to_json())
        data["steps"][2][key] = value
        Path(f"{name}.json").write_text(json.dumps(data))
    last = table().steps[-1]
    crossed = replace(table(), steps=(*table().steps[:-1], replace(last, moved=((8, 0.75, 0.7), (9, 0.9, 0.6)))))
    crossed.save("crossed.json")
    done = run(*arguments)
    assert done.code == code
    assert done.err.startswith("error: ") and done.err.count("\n") == 1
    assert message in done.err
    assert not Path("out").exists()


def test_help__has_examples() -> None:
    shown = subprocess.run([sys.executable, "-m", "agents.vary", "--help"], cwd=ROOT, capture_output=True, text=True)
    assert shown.returncode == 0
    assert "python -m agents.vary out/chair/sequence.json" in shown.stdout
