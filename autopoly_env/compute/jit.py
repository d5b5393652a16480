"""`kernel`: compile a numeric function with Numba once per machine, and say so the one time that it takes a while.

Numba's own on-disk cache is stamped with one source file, so a kernel that inlines a kernel of another file goes
stale when that other file changes. Here every kernel is stamped with all ``*_kernels.py`` files of this
package and of its own, in whichever folder they lie.
"""

import contextlib
import functools
import hashlib
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache

_announced = False


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


def _announce_compilation() -> None:
    global _announced
    if not _announced:
        _announced = True
        print(
            "autopoly_env: compiling the numeric kernels (once on this machine, about a minute) ...",
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
        self._save_index({**self._load_index(), key: name})

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
        found = None
        with contextlib.suppress(OSError):
            found = super().load_overload(sig, target_context)
        if found is None:
            _announce_compilation()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)


class _NoCache(NullCache):
    """Stands in where nothing can be written: every process compiles, and says so."""

    def load_overload(self, sig: Any, target_context: Any) -> None:
        _announce_compilation()


def kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` to machine code that runs without the GIL, IEEE division included, cached on disk."""
    compiled = njit(nogil=True, error_model="numpy")(function)
    try:
        compiled._cache = _KernelCache(function)
    except (RuntimeError, OSError):
        compiled._cache = _NoCache()
    return compiled
