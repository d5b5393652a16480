"""The table of readers: what counts as right, and a reader that is asked for real."""

import shutil
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.formats import __main__ as table
from benchmarks.formats.files import VARIANTS, expected, write
from benchmarks.formats.in_godot import packed
from benchmarks.formats.programs import READERS, Asking, ask_python
from benchmarks.formats.solids import look_at_solids
from tests.helpers.sequences import gabled

ASKING = Asking((sys.executable,), None)


def test_cell__says_how_much_too_much_and_what_helps() -> None:
    assert table._cell("obj", {"obj": 1.0 + 5e-6}) == table.RIGHT
    assert table._cell("obj", {"obj": 3.92, "obj-triangles": 1.0}) == "×3.92; `--triangles`"
    assert table._cell("obj", {"obj": float("nan"), "obj-triangles": 1.0}) == "nothing; `--triangles`"
    assert table._cell("obj", {"obj": 3.92, "obj-triangles": 2.0}) == "×3.92, **wrong**"
    assert table._cell("stl", {"stl": 0.5}) == "×0.5, **wrong**"


def test_readers__are_asked_for_variants_that_there_are() -> None:
    names = [name for name, _, _, _ in READERS]
    assert len(set(names)) == len(names)
    assert {kind for *_, kinds in READERS for kind in kinds} <= set(VARIANTS)
    ways_out = {variant.way_out for variant in VARIANTS.values() if variant.way_out}
    assert ways_out <= set(VARIANTS) and all(bool(v.way_out) == bool(v.advice) for v in VARIANTS.values())


def test_pack_for_godot__leads_to_its_files() -> None:
    files = {"main.gd": b"extends Node\n", "0.tscn": b"[gd_scene format=3]\n"}
    pack = packed(files)
    assert struct.unpack_from("<4s5IQ", pack) == (b"GDPC", 2, 4, 0, 0, 0, 0)
    (n,), at, found = struct.unpack_from("<I", pack, 96), 100, {}
    for _ in range(n):
        (length,) = struct.unpack_from("<I", pack, at)
        name = pack[at + 4 : at + 4 + length].rstrip(b"\0").decode()
        offset, size = struct.unpack_from("<QQ", pack, at + 4 + length)
        found[name] = pack[offset : offset + size]
        at += 4 + length + 8 + 8 + 16 + 4
    assert found == {f"res://{name}": data for name, data in files.items()}


@pytest.mark.slow
def test_trimesh__is_asked_and_finds_what_is_there(tmp_path: Path) -> None:
    pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    kinds = ("obj-triangles", "gltf", "stl")
    paths = [write(gabled(), kind, tmp_path / f"{kind}{VARIANTS[kind].suffix}") for kind in kinds]
    answer = ask_python("trimesh", ASKING, paths)
    assert answer is not None and answer[0]
    for kind, found in zip(kinds, answer[1], strict=True):
        assert found[VARIANTS[kind].measure] == pytest.approx(expected(gabled(), kind), rel=1e-5)


@pytest.mark.slow
def test_solids_of_a_folder__are_looked_at(tmp_path: Path) -> None:
    gabled().save(tmp_path / "sequence.json")
    lines, is_right = look_at_solids(tmp_path, ASKING)
    assert is_right and len(lines) >= 2 + (shutil.which("admesh") is not None)
    assert all(" | 1 | 0 | " in line for line in lines[2:])
    (tmp_path / "none").mkdir()
    assert not look_at_solids(tmp_path / "none", ASKING)[1]


def test_reader__that_is_not_there_is_no_answer() -> None:
    assert ask_python("trimesh", Asking((), None), []) is None


@pytest.mark.slow
def test_wrong_usage__is_told() -> None:
    done = subprocess.run([sys.executable, "-m", "benchmarks.formats", "--fast"], capture_output=True, text=True)
    assert done.returncode == 2 and "unrecognized arguments" in done.stderr
