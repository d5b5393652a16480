"""`kernel`: compile a numeric function with Numba once per machine, and say so the one time that it takes a while.

Numba's own on-disk cache is stamped with one source file, so a kernel that inlines a kernel of another file goes
stale when that other file changes. Here every kernel is stamped with all ``*_kernels.py`` files of this
package and of its own, in whichever folder they lie.
"""

import contextlib
import functools
import glob
import hashlib
import inspect
import multiprocessing
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

with warnings.catch_warnings(record=True) as _said:  # of its variables; a warning of Numba's has a traceback in it
    import numba
    from numba import njit, types
    from numba.core import serialize
    from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache
    from numba.core.registry import cpu_target
    from numba.core.runtime import rtsys
for _one in _said:
    print("autopoly_env:", str(_one.message).partition("\n")[0], file=sys.stderr)

ALONE = "AUTOPOLY_WARM"  # a variable of the environment: 0 in a process that is to compile what it calls by itself
_AGE = 3600.0  # seconds after which a file that no index lists is nobody's: not one that is just being filled
_announced = _sought = False

# For every array that a kernel returns Numba looks up its type, by a function in Python. Where a signal comes just then
# and its handler raises, as that of Ctrl-C does, Numba goes on without the type, and the process crashes. While C looks
# into a cache of functools nothing of that kind happens.
serialize._numba_unpickle = functools.cache(serialize._numba_unpickle)


def _seek_all() -> None:
    """Once, before this process compiles its first kernel: have all kernels compiled, by several processes at once.

    Not so in workers, of which there may be many: whoever starts them sees to it.
    """
    global _sought
    if _sought or os.environ.get(ALONE) == "0" or multiprocessing.parent_process() is not None:
        return
    _sought = True
    if (Path(__file__).parent.parent / "warm.py").exists():
        with contextlib.suppress(OSError):
            subprocess.run(
                [sys.executable, "-m", "autopoly_env.warm", "--once"],
                env={**os.environ, "PYTHONPATH": os.pathsep.join(path or "." for path in sys.path)},
                stdin=subprocess.DEVNULL,
                check=False,
            )


@functools.cache
def _kernel_sources_stamp(package: Path) -> bytes:
    """Hash of this file, which says how to compile, and of every kernel file of its package and of `package`."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for home in sorted({_package_of(Path(__file__)), package}):
        for path in sorted(home.rglob("*_kernels.py")):
            digest.update(path.read_bytes())
    return digest.digest()


def _package_of(source: Path) -> Path:
    """The folder of the outermost package that a source file belongs to; its own, where that is no package."""
    folder = source.parent
    while (folder.parent / "__init__.py").exists():
        folder = folder.parent
    return folder


def stamp_of(package: Path) -> bytes:
    """A hash of all kernel files of a package, and of how they are compiled."""
    return _kernel_sources_stamp(package)


def machine() -> bytes:
    """What code that is compiled is for: the processor, and Numba's version."""
    return repr((numba.__version__, cpu_target.target_context.codegen().magic_tuple())).encode()


def cache_folder() -> Path | None:
    """Where what this file compiles would be kept; None where that cannot be written."""
    try:
        return Path(FunctionCache(_announce_compilation).cache_path)
    except (RuntimeError, OSError):
        return None


def _announce_compilation() -> None:
    global _announced
    if not _announced:
        _announced = True
        print(
            "autopoly_env: compiling the numeric kernels that this needs ("
            "`python -m autopoly_env.warm` compiles all, once on this machine) ...",
            file=sys.stderr,
            flush=True,
        )


class _CacheFile(IndexDataCacheFile):
    """Numba's cache file, made safe for processes that fill it together, and for what a full disk leaves behind.

    Numba numbers the data files from 1 and lists a file before it writes it, so a reader can be led to the file of
    an older source or of another signature. Here a file is named by what it holds and is listed once it exists.
    """

    def save(self, key: Any, data: Any) -> None:
        content = repr((self._version, self._source_stamp, key)).encode()
        name = self._data_name(int.from_bytes(hashlib.sha256(content).digest()[:8], "big"))
        self._save_data(name, data)
        listed = {**self._load_index(), key: name}
        self._save_index(listed)
        self._sweep({self._index_name, *listed.values()})

    def _sweep(self, kept: set[str]) -> None:
        """Remove what was compiled of older sources of this function, in whichever line it stood; see `_AGE`."""
        function, _, line = self._index_name.removesuffix(".nbi").rpartition("-")
        python = line.partition(".")[2]
        for path in Path(self._cache_path).glob(f"{glob.escape(function)}-*.{python}.*"):
            if path.name not in kept and time.time() - path.stat().st_mtime > _AGE:
                path.unlink(missing_ok=True)  # to whoever still runs the older source it is missing, and is compiled

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except Exception:  # unpickling a damaged file raises almost anything
            return {}

    def _load_data(self, name: str) -> Any:
        try:
            return super()._load_data(name)
        except Exception as error:
            raise OSError(f"{name} is damaged") from error  # which counts as missing


class _KernelCache(FunctionCache):
    """Numba's function cache, stamped with all kernel files, that announces a compilation and survives a full disk."""

    def __init__(self, py_func: Callable[..., Any]) -> None:
        super().__init__(py_func)
        self._cache_file = _CacheFile(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=_kernel_sources_stamp(_package_of(Path(inspect.getfile(py_func)))),
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        found = self._loaded(sig, target_context)
        if found is None:
            _seek_all()
            found = self._loaded(sig, target_context)
        if found is None:
            _announce_compilation()
        return found

    def _loaded(self, sig: Any, target_context: Any) -> Any:
        """What is compiled already. Numba would first load all that it knows of compiling, which takes longer."""
        with contextlib.suppress(OSError):
            rtsys.initialize(target_context)  # machine code that allocates calls it
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)


class _NoCache(NullCache):
    """Stands in where nothing can be written: every process compiles, and says so."""

    def load_overload(self, sig: Any, target_context: Any) -> None:
        _announce_compilation()


class _Unopened:
    """A kernel's cache that is opened at its first call: of the kernels that a process imports it calls a few."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    @functools.cached_property
    def _opened(self) -> Any:
        try:
            return _KernelCache(self._function)
        except (RuntimeError, OSError):
            return _NoCache()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._opened, name)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` to machine code that runs without the GIL, IEEE division included, cached on disk."""
    return _compiled(function, counts=True)


def uncounted_kernel(function: Callable[..., Any]) -> Any:
    """`kernel` without reference counts, whose atomic additions at every call took a third of a refit.

    For one that makes no array, calls none that hands it an array (but for `inlined` ones), and returns none: numbers
    come out of it, or are written to arrays that it is given.
    """
    return _compiled(function, counts=False)


def inlined(function: Callable[..., Any]) -> Any:
    """A function that becomes part of each kernel that calls it, so that it may hand arrays to uncounted ones, too."""
    return njit(nogil=True, error_model="numpy", inline="always")(function)


def _compiled(function: Callable[..., Any], counts: bool) -> Any:
    inner = function.__name__.startswith("_")
    compiled = njit(
        nogil=True, error_model="numpy", no_cfunc_wrapper=True, no_cpython_wrapper=inner, _nrt=counts
    )(function)  # fmt: skip
    template_of = compiled.get_call_template
    compiled.get_call_template = lambda args, kws: template_of(
        tuple(map(types.unliteral, args)), {name: types.unliteral(kind) for name, kind in kws.items()}
    )  # a call with a constant is no other call: Numba would compile the kernel once more for it
    compiled._cache = _Unopened(function)
    return compiled
