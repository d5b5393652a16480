"""The lines between the rooms: who may import whom, read from the source of every file."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.helpers.paths import ROOT

ROOMS = ("autopoly_env", "agents", "training")
SOURCES = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))

GYMNASIUM_SHELL = tuple(f"autopoly_env/{name}" for name in ("__init__", "env", "vector_env", "wrappers"))

# (who is imported, where it may not be, except there): folders and files relative to the root, without ".py"
LINES = [
    ("agents", ("autopoly_env",), ()),
    ("training", ("autopoly_env", "agents"), ()),
    ("torch", ("autopoly_env",), ("autopoly_env/raster/autograd",)),
    ("gymnasium", ROOMS, (*GYMNASIUM_SHELL, "agents/rl")),
    ("stable_baselines3", ROOMS, ("agents/rl", "training/train_rl")),
    ("sb3_contrib", ROOMS, ("agents/rl", "training/train_rl")),
    ("ray", ROOMS, ("training/parallel",)),
]


def imported_modules(source: str, package: str) -> set[str]:
    """Every module that the source imports, anywhere in it; `package` is what a leading dot means."""
    return {name for node in ast.walk(ast.parse(source)) for name in _names(node, package.split("."))}


def _names(node: ast.AST, package: list[str]) -> Iterator[str]:
    match node:
        case ast.Import(names=names):
            yield from (alias.name for alias in names)
        case ast.ImportFrom(module=module, names=names, level=level):
            above = package[: len(package) - level + 1] if level else []
            base = [*above, *([module] if module else [])]
            yield from (".".join([*base, alias.name]) for alias in names)
        case ast.Call(func=ast.Attribute(attr="import_module") | ast.Name(id="import_module" | "__import__")):
            yield from (a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str))


def lies_in(path: Path, places: tuple[str, ...]) -> bool:
    """Whether a source file is one of the places or in one of them."""
    here = path.relative_to(ROOT).with_suffix("").as_posix()
    return any(here == place or here.startswith(f"{place}/") for place in places)


def test_reader__sees_plain_lazy_relative_and_type_checking_imports() -> None:
    source = (
        "import a.b, c\n"
        "from d import e as f\n"
        "from . import g\n"
        "from ..h import i\n"
        "if TYPE_CHECKING:\n    import j\n"
        "def lazy():\n    import k\n    importlib.import_module('l.m')\n"
    )
    expected = {"a.b", "c", "d.e", "room.inner.g", "room.h.i", "j", "k", "l.m"}
    assert imported_modules(source, "room.inner") == expected


@pytest.mark.parametrize(("module", "forbidden", "allowed"), LINES, ids=[line[0] for line in LINES])
def test_module__is_imported_only_where_it_may_be(
    module: str, forbidden: tuple[str, ...], allowed: tuple[str, ...]
) -> None:
    trespassers = [
        str(path.relative_to(ROOT))
        for path in SOURCES
        if lies_in(path, forbidden) and not lies_in(path, allowed)
        for name in imported_modules(path.read_text(encoding="utf-8"), _package_of(path))
        if name.split(".")[0] == module
    ]
    assert not trespassers


def _package_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).parent.parts)


def test_every_room__is_a_package_with_a_docstring() -> None:
    for folder in sorted({path.parent for path in SOURCES}):
        assert ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))), folder


def test_import_of_the_world__is_light() -> None:
    command = [sys.executable, "-c", "import sys, autopoly_env; print(*sys.modules)"]
    loaded = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    assert {"torch", "skimage", "matplotlib"}.isdisjoint(loaded)
