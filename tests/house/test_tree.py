"""The tests lie as the packages do, so that whoever changes a room knows where its tests are."""

from pathlib import Path

import pytest

from tests.helpers.paths import ROOT

TESTS = ROOT / "tests"
MIRRORED = ("autopoly_env", "agents", "training", "benchmarks", "blender")
FOLDERS = sorted({path.parent.relative_to(TESTS) for path in TESTS.rglob("*.py")})


def test_tests__are_of_the_packages_or_of_the_house() -> None:
    assert {folder.parts[0] for folder in FOLDERS if folder.parts} == {*MIRRORED, "house", "helpers"}
    assert [path.name for path in TESTS.glob("*.py")] == ["conftest.py"]


@pytest.mark.parametrize(
    "folder", [folder for folder in FOLDERS if folder.parts and folder.parts[0] in MIRRORED], ids=str
)
def test_folder_of_tests__is_named_after_a_room(folder: Path) -> None:
    assert (ROOT / folder / "__init__.py").is_file()


def test_helpers__hold_no_tests_and_tests_import_none() -> None:
    assert not list((TESTS / "helpers").glob("test_*.py"))
    for path in TESTS.rglob("test_*.py"):
        lines = path.read_text(encoding="utf-8").splitlines()
        assert all(
            line.startswith("from tests.helpers.") for line in lines if line.startswith(("from tests", "import tests"))
        ), path
