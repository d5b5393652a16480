"""The zip of the coach: what is in it, that it is small, and that Blender's rules for it are kept."""

import ast
import io
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from autopoly_env.export.blender.script import TEMPLATE
from blender import build
from blender.autopoly_coach import bl_info

FILES = build.packed()
OF_BLENDER = {"blf", "bmesh", "bpy", "bpy_extras", "gpu", "gpu_extras", "mathutils"}
PURE = {"__init__.py", "comparing.py", "judging.py", "lesson.py", "solver.py", "telling.py"}
MANIFEST = tomllib.loads(FILES["blender_manifest.toml"].decode())


def imports(name: str) -> set[str]:
    """What a file imports from elsewhere."""
    tree = ast.parse(FILES[name])
    plain = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    named = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level == 0}
    return {found.split(".")[0] for found in plain | named if found}


MODULES = sorted(name for name in FILES if name.endswith(".py"))


@pytest.mark.parametrize("name", MODULES)
def test_module__needs_nothing_but_blender_and_python(name: str) -> None:
    assert imports(name) <= sys.stdlib_module_names | OF_BLENDER
    if name in PURE:
        assert imports(name) <= sys.stdlib_module_names


@pytest.mark.parametrize("name", MODULES)
def test_module__is_written_in_the_python_of_blender_3_4(name: str) -> None:
    ast.parse(FILES[name], feature_version=(3, 10))


def test_zip__is_the_same_every_time_and_small(tmp_path: Path) -> None:
    first, second = build.build(tmp_path / "a"), build.build(tmp_path / "b")
    assert first.read_bytes() == second.read_bytes()
    assert first.name == f"autopoly_coach-{MANIFEST['version']}.zip"
    assert first.stat().st_size <= 200_000


def test_zip__has_one_folder_with_all_files() -> None:
    with zipfile.ZipFile(io.BytesIO(build.zipped(FILES))) as archive:
        assert {Path(name).parts[0] for name in archive.namelist()} == {MANIFEST["id"]}
        assert {Path(name).name for name in archive.namelist()} == FILES.keys()


def test_manifest__says_what_the_add_on_of_older_blenders_says() -> None:
    assert MANIFEST["version"] == ".".join(map(str, bl_info["version"]))  # type: ignore[arg-type]
    assert (MANIFEST["name"], MANIFEST["tagline"]) == (bl_info["name"], bl_info["description"])
    assert bl_info["blender"] == (3, 4, 0) and MANIFEST["blender_version_min"] == "4.2.0"
    assert len(MANIFEST["tagline"]) <= 64 and MANIFEST["license"] == ["SPDX:MIT"]


def functions_in(source: str) -> dict[str, str]:
    return {node.name: ast.dump(node) for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)}


def test_operators__are_those_of_the_scripts_to_the_letter() -> None:
    functions = functions_in(build.making())
    assert functions.items() <= functions_in(TEMPLATE.read_text(encoding="utf-8")).items()
    assert {"edge_extrude", "face_hole", "loop_cut", "start"} <= functions.keys()


def stub(tmp_path: Path, version: str, code: int) -> str:
    path = tmp_path / "blender"
    path.write_text(f'#!/bin/sh\n[ "$1" = --version ] && echo "Blender {version}" && exit 0\necho "$@"; exit {code}\n')
    path.chmod(0o755)
    return str(path)


@pytest.mark.parametrize(
    ("version", "code", "expected"),
    [
        ("3.4.1", 0, (0, "not validated, which takes Blender 4.2 or newer")),
        ("4.2.0", 0, (0, "validated by Blender 4.2")),
        ("5.0.1", 1, (1, "Blender 5.0: --command extension validate ")),
        ("unknown", 0, (0, "not validated")),
    ],
)
def test_blender__is_asked_whether_it_takes_the_zip(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    version: str,
    code: int,
    expected: tuple[int, str],
) -> None:
    monkeypatch.setenv("BLENDER", stub(tmp_path, version, code))
    assert build.main([str(tmp_path / "dist")]) == expected[0]
    assert f" kB, {expected[1]}" in capsys.readouterr().out


def test_folder_that_cannot_be_written__is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    assert build.main([str(tmp_path / "file")]) == 2
    assert capsys.readouterr().err.startswith("error: ")
