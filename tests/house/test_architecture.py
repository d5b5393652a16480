"""The lines between the rooms: who may import whom, read from the source of every file."""

import ast
import functools
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from docs import draw_architecture
from tests.helpers.paths import ROOT

PACKAGES = ("autopoly_env", "agents", "training")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))

GYMNASIUM_SHELL = tuple(f"autopoly_env/{name}" for name in ("__init__", "env", "vector_env", "wrappers"))

# (who is imported, where it may not be, except there): folders and files relative to the root, without ".py"
LINES = [
    ("agents", ("autopoly_env",), ()),
    ("training", ("autopoly_env", "agents"), ()),
    ("torch", ("autopoly_env",), ("autopoly_env/raster/autograd",)),
    ("gymnasium", PACKAGES, (*GYMNASIUM_SHELL, "agents/rl", "training/datasets/plays")),
    ("minari", PACKAGES, ("training/datasets/plays",)),
    ("stable_baselines3", PACKAGES, ("agents/rl", "training/train_rl", "training/policies/session")),
    ("sb3_contrib", PACKAGES, ("agents/rl",)),
    ("ray", PACKAGES, ("training/parallel",)),
    ("starlette", PACKAGES, ("agents/studio",)),
    ("uvicorn", PACKAGES, ("agents/studio",)),
]

# What runs inside Blender imports nothing of AutoPoly; what packs it imports the world only.
IN_BLENDER = sorted((ROOT / "blender").rglob("*.py"))

# A notebook shows a sequence as the player, and the player is made of sequences. The one import that runs back up.
DOORBELL = ("autopoly_env.sequence.sequence", "autopoly_env.export.player")

Graph = Mapping[str, set[str]]  # who imports -> who is imported


# --- what a file imports ---


def imported_modules(source: str | ast.AST, package: str) -> set[str]:
    """Every module that the source imports, anywhere in it; `package` is what a leading dot means."""
    tree = ast.parse(source) if isinstance(source, str) else source
    return {name for node in ast.walk(tree) for name in _names(node, package.split("."))}


@functools.cache
def imports_of(path: Path) -> frozenset[str]:
    """Every module that a source file imports, now or later, or for the type checker alone."""
    return frozenset(imported_modules(path.read_text(encoding="utf-8"), package_of(path)))


def package_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).parent.parts)


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


# --- who may import whom ---


def lies_in(path: Path, places: tuple[str, ...]) -> bool:
    """Whether a source file is one of the places or in one of them."""
    here = path.relative_to(ROOT).with_suffix("").as_posix()
    return any(here == place or here.startswith(f"{place}/") for place in places)


@pytest.mark.slow
@pytest.mark.parametrize(("module", "forbidden", "allowed"), LINES, ids=[line[0] for line in LINES])
def test_module__is_imported_only_where_it_may_be(
    module: str, forbidden: tuple[str, ...], allowed: tuple[str, ...]
) -> None:
    trespassers = [
        str(path.relative_to(ROOT))
        for path in SOURCES
        if lies_in(path, forbidden) and not lies_in(path, allowed)
        for name in imports_of(path)
        if name.split(".")[0] == module
    ]
    assert not trespassers


def test_coach__runs_without_autopoly_and_nothing_of_autopoly_needs_it() -> None:
    packages = {*PACKAGES, "benchmarks", "docs", "tests"}
    for path in IN_BLENDER:
        found = {name.split(".")[0] for name in imports_of(path)} & packages
        assert found <= (set() if path.parent.name == "autopoly_coach" else {"autopoly_env"}), path
    assert not [path for path in SOURCES if "blender" in {name.split(".")[0] for name in imports_of(path)}]


# --- no circles ---


def graph_of(imports: Mapping[str, Iterable[str]]) -> dict[str, set[str]]:
    """The files that each file runs when all of its imports are followed, by module name.

    Importing `room.inner` from outside runs `room/__init__.py` as well, so the room's face is an edge too. Inside the
    room it is none: there Python has begun to run the face before the file. Only a file that asks for its own room's
    face by name has that edge.
    """
    graph = {}
    for name, found in imports.items():
        modules = {_module(one, imports) for one in found} - {""}
        faces = {above for module in modules for above in _above(module) if not f"{name}.".startswith(f"{above}.")}
        graph[name] = modules | (faces & imports.keys())
    return graph


def _module(found: str, modules: Iterable[str]) -> str:
    """The module that an imported name is or lies in; "" for one from elsewhere."""
    return next((name for name in (found, found.rpartition(".")[0]) if name in modules), "")


def _above(module: str) -> Iterator[str]:
    while module := module.rpartition(".")[0]:
        yield module


def circle_in(graph: Graph) -> list[str]:
    """A circle of the graph, each importing the next, or none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(reversed(error.args[1]))
    return []


def rooms_of(graph: Graph) -> Graph:
    """The same between rooms: folders of a package; a file in no folder is a room of its own."""
    rooms: dict[str, set[str]] = {}
    for name, imported in graph.items():
        rooms.setdefault(_room(name), set()).update(_room(other) for other in imported)
    return {room: others - {room} for room, others in rooms.items()}


def _room(module: str) -> str:
    return ".".join(module.split(".")[:2])


@pytest.fixture(scope="module")
def house() -> Graph:
    """The files of the three packages, without the doorbell."""
    graph = graph_of({module_of(path): imports_of(path) for path in SOURCES})
    caller, called = DOORBELL
    graph[caller] -= {called, *_above(called)}
    return graph


def module_of(path: Path) -> str:
    return package_of(path) if path.stem == "__init__" else f"{package_of(path)}.{path.stem}"


@pytest.mark.parametrize(
    ("imports", "circle"),
    [
        ({"p.a": ["p.b"], "p.b": ["p.c.x"], "p.c": []}, set()),
        ({"p.a": ["p.b.x"], "p.b": ["p.a.y"]}, {"p.a", "p.b"}),
        ({"p.r": ["p.r.one.x"], "p.r.one": [], "p.a": ["p.r.x"]}, set()),
        ({"p.r": ["p.r.one.x"], "p.r.one": ["p.r.two.x"], "p.r.two": []}, set()),
        ({"p.r": ["p.r.one.x"], "p.r.one": ["p.r.y"]}, {"p.r", "p.r.one"}),
        ({"p.r": ["p.r.one"], "p.r.one": ["p.a"], "p.r.two": [], "p.a": ["p.r.two"]}, {"p.r", "p.r.one", "p.a"}),
    ],
    ids=["chain", "pair", "face", "room-mates", "own-face", "by-way-of-the-face"],
)
def test_circle__is_found_where_there_is_one(imports: dict[str, list[str]], circle: set[str]) -> None:
    assert set(circle_in(graph_of(imports))) == circle


def test_files__import_each_other_in_no_circle(house: Graph) -> None:
    assert not circle_in(house)


def test_rooms__stand_on_floors(house: Graph) -> None:
    assert not circle_in(rooms_of(house))


def test_floors__are_those_that_the_page_draws(house: Graph) -> None:
    """Every room is drawn, above all that it imports from."""
    rooms = {room: others for room, others in rooms_of(house).items() if "." in room}
    floors = {
        f"{package}.{room}": (number, -k)
        for number, package in enumerate(PACKAGES)
        for k, floor in enumerate(draw_architecture.FLOORS[package])
        for room in floor
    }
    assert rooms.keys() == floors.keys(), "put the rooms where they stand into docs/draw_architecture.py and run it"
    climbing = [(room, other) for room, others in rooms.items() for other in others - {*PACKAGES}
                if floors[other] >= floors[room]]  # fmt: skip
    assert not climbing
    assert (draw_architecture.PICTURES / "floors.svg").read_text(encoding="utf-8") == draw_architecture.drawing()


def test_files__do_not_ask_for_the_face_of_their_own_room(house: Graph) -> None:
    assert not [(name, above) for name, imported in house.items() for above in _above(name) if above in imported]


def test_doorbell__is_rung_where_a_notebook_shows_a_sequence_and_nowhere_else() -> None:
    caller, called = DOORBELL
    path = ROOT.joinpath(*caller.split(".")).with_suffix(".py")
    (method,) = (
        node
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef) and node.name == "_repr_html_"
    )
    (rung,) = (name for name in imported_modules(method, package_of(path)) if name.startswith(called))
    assert [name for name in imports_of(path) if name.startswith("autopoly_env.export")] == [rung]


# --- what the rooms are ---


def test_every_room__is_a_package_with_a_docstring() -> None:
    for folder in sorted({path.parent for path in SOURCES}):
        assert ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))), folder


def test_import_of_the_world__is_light() -> None:
    command = [sys.executable, "-c", "import sys, autopoly_env; print(*sys.modules)"]
    loaded = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    assert {"torch", "skimage", "matplotlib"}.isdisjoint(loaded)
