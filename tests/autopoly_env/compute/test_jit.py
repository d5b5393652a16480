"""Kernels are compiled once, and never run as an older source said."""

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import FrameType
from typing import get_args, get_type_hints

import numpy as np
import pytest

from autopoly_env.compute import jit
from autopoly_env.silhouette.target_kernels import row_sums

pytestmark = pytest.mark.slow  # kernels are compiled from nothing

PACKAGE = Path(jit.__file__).parent.parent
INNER = "from autopoly_env.compute.jit import kernel\n\n@kernel\ndef factor() -> float:\n    return {factor}\n"
OUTER = (
    "from autopoly_env.inner.inner_kernels import factor\nfrom autopoly_env.compute.jit import kernel\n\n"
    "@kernel\ndef scaled(x: float) -> float:\n    return factor() * x\n"
)
CALL = "from autopoly_env.outer.outer_kernels import scaled; print(scaled(10.0))"
TWICE = "from autopoly_env.outer.outer_kernels import scaled; print(scaled(10.0), scaled(10))"
FROM_OUTSIDE = "from players.moves.outer_kernels import scaled; print(scaled(10.0))"
QUIET, LOUD = 0, 1  # announcements


def run_python(code: str, package_parent: Path, **variables: str) -> tuple[str, int]:
    """(What a process that imports the package from there prints, how often it says that it compiles)."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA", "AUTOPOLY"))}
    # No .pyc files: Python tells them from their sources by size and whole seconds, and a test changes a file in less.
    environment |= {"PYTHONPATH": str(package_parent), "PYTHONDONTWRITEBYTECODE": "1", **variables}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=package_parent, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    lines = done.stderr.splitlines()
    assert all("compiling" in line for line in lines)
    return done.stdout.strip(), len(lines)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of two tiny kernel files, one of which inlines the other from another folder, and the real `jit`."""
    folder = tmp_path / "autopoly_env"
    for room in (folder, folder / "compute", folder / "inner", folder / "outer"):
        room.mkdir()
        (room / "__init__.py").write_text("")
    shutil.copy(PACKAGE / "compute" / "jit.py", folder / "compute")
    (folder / "inner" / "inner_kernels.py").write_text(INNER.format(factor=2.0))
    (folder / "outer" / "outer_kernels.py").write_text(OUTER)
    return folder


def test_second_process__does_not_compile_until_a_kernel_file_changes(package: Path, tmp_path: Path) -> None:
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    assert run_python(CALL, tmp_path, **cache) == ("20.0", LOUD)
    assert run_python(CALL, tmp_path, **cache) == ("20.0", QUIET)
    (package / "inner" / "inner_kernels.py").write_text(INNER.format(factor=3.0))
    assert run_python(CALL, tmp_path, **cache) == ("30.0", LOUD)  # although nothing in its own folder has changed
    assert run_python(CALL, tmp_path, **cache) == ("30.0", QUIET)


def test_kernel_of_another_package__is_compiled_anew_when_one_that_it_inlines_changes(
    package: Path, tmp_path: Path
) -> None:
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    moves = tmp_path / "players" / "moves"
    moves.mkdir(parents=True)
    for room in (moves, moves.parent):
        (room / "__init__.py").write_text("")
    (moves / "outer_kernels.py").write_text(OUTER)
    assert run_python(FROM_OUTSIDE, tmp_path, **cache) == ("20.0", LOUD)
    assert run_python(FROM_OUTSIDE, tmp_path, **cache) == ("20.0", QUIET)
    (package / "inner" / "inner_kernels.py").write_text(INNER.format(factor=3.0))
    assert run_python(FROM_OUTSIDE, tmp_path, **cache) == ("30.0", LOUD)


def test_damaged_cache__is_replaced(package: Path, tmp_path: Path) -> None:
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    assert run_python(CALL, tmp_path, **cache) == ("20.0", LOUD)
    index, data = (sorted((tmp_path / "cache").rglob(f"*.{kind}")) for kind in ("nbi", "nbc"))
    assert len(index) == len(data) == 2
    for path, size in zip((*index, *data), (0, 40, 0, 500), strict=True):
        path.write_bytes(path.read_bytes()[:size])
    assert run_python(CALL, tmp_path, **cache) == ("20.0", LOUD)
    assert run_python(CALL, tmp_path, **cache) == ("20.0", QUIET)


def test_unwritable_cache__means_compiling_in_every_process_and_saying_so(package: Path, tmp_path: Path) -> None:
    """No folder can be made below a regular file, not even by root."""
    (tmp_path / "file").touch()
    for room in ("inner", "outer"):
        (package / room / "__pycache__").touch()
    nowhere = str(tmp_path / "file" / "cache")
    variables = {"NUMBA_CACHE_DIR": nowhere, "HOME": nowhere, "XDG_CACHE_HOME": nowhere}
    for _ in range(2):
        assert run_python(TWICE, tmp_path, **variables) == ("20.0 20.0", LOUD)


def test_cache__gives_each_signature_its_own_code_when_two_processes_fill_it_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both read the empty index before either has written anything, and their writes interleave."""
    one, other, reader = (jit._CacheFile(str(tmp_path), "kernel", b"source") for _ in range(3))
    save_data = one._save_data

    def interrupted(name: str, data: str) -> None:
        other.save("int", "code for int")
        save_data(name, data)

    monkeypatch.setattr(other, "_load_index", dict)
    monkeypatch.setattr(one, "_save_data", interrupted)
    one.save("float", "code for float")
    assert reader.load("int") in (None, "code for int")
    assert reader.load("float") == "code for float"


def test_cache__never_shows_the_code_of_an_older_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, new, reader = (jit._CacheFile(str(tmp_path), "kernel", source) for source in (b"old", b"new", b"new"))
    old.save("float", "old code")
    found = []
    save_data, save_index = new._save_data, new._save_index

    def look_first(name: str, data: str) -> None:
        found.append(reader.load("float"))
        save_data(name, data)

    def look_after(entries: dict[str, str]) -> None:
        save_index(entries)
        found.append(reader.load("float"))

    monkeypatch.setattr(new, "_save_data", look_first)
    monkeypatch.setattr(new, "_save_index", look_after)
    new.save("float", "new code")
    assert found == [None, "new code"]


def test_cache__sweeps_up_what_older_sources_of_a_function_have_left(tmp_path: Path) -> None:
    def kept(age: float, name: str, source: bytes, *kinds: str) -> set[str]:
        """The files that are there an hour (age 1) later, and after a function of this source was compiled."""
        for path in tmp_path.iterdir():
            os.utime(path, (path.stat().st_mtime - 3601 * age,) * 2)
        for kind in kinds:
            jit._CacheFile(str(tmp_path), name, source).save(kind, "code")
        return {path.name for path in tmp_path.iterdir()}

    old = kept(0, "one_kernels.cut-7.py311", b"old", "float", "int")
    others = kept(0, "one_kernels.cut-7.py312", b"old", "float") | kept(0, "one_kernels.cut_all-7.py311", b"old", "int")
    assert len(old) == 3 and len(others) == 3 + 4
    assert kept(0, "one_kernels.cut-9.py311", b"new", "float") > others  # nobody knows yet whose the young ones are
    there = kept(1, "one_kernels.cut-9.py311", b"new", "int")
    assert not there & old and there > others - old
    assert len(there - others) == 3  # the index, of float and of int


def test_kernel__calls_no_python_on_its_way_out() -> None:
    """A signal's handler, as that of Ctrl-C, may raise in any Python; Numba would crash where that is its own."""
    given = np.eye(2), np.empty((0, 0))
    row_sums(*given)  # the first call is for what Numba looks up once
    called: list[str] = []

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            called.append(frame.f_code.co_qualname)

    sys.setprofile(note)
    try:
        sums, squares, _ = row_sums(*given)
    finally:
        sys.setprofile(None)
    assert sums.tolist() == squares.tolist() == [[0, 1, 1], [0, 0, 1]]
    assert called == ["row_sums"]  # machine code: Numba tells profilers of it


def test_kernels__give_python_no_named_tuples() -> None:
    """Their classes are Python, which a kernel is not to call."""
    given = []
    for path in [path for room in ("autopoly_env", "agents") for path in (PACKAGE.parent / room).rglob("*_kernels.py")]:
        module = importlib.import_module(".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts))
        outer = [one for name, one in vars(module).items() if hasattr(one, "py_func") and not name.startswith("_")]
        outer = [one for one in outer if one.targetoptions.get("inline") != "always"]  # no kernels of their own
        given += [get_type_hints(one.py_func)["return"] for one in outer]
    kinds = {kind for one in given for kind in (one, *get_args(one))}
    assert len(given) > 20
    assert not [kind for kind in kinds if hasattr(kind, "_fields")]


def test_kernels__all_go_through_this_cache() -> None:
    rooms = [PACKAGE.parent / room for room in ("autopoly_env", "agents", "training")]
    sources = [path for room in rooms for path in room.rglob("*.py") if path.name != "jit.py"]
    assert not [path.name for path in sources if "njit" in path.read_text()]
    assert not [path.name for path in sources if "@kernel" in path.read_text() and "_kernels" not in path.name]
