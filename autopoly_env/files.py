"""Reading files that people give, within bounds; writing result files so that nobody ever meets half of one."""

import contextlib
import errno
import functools
import os
import re
import secrets
import stat
import time
from pathlib import Path

from autopoly_env.errors import OutputError

_TEMPORARY = re.compile(r"\.[0-9a-f]{12}\.tmp")  # how files are called that are being written
_PATIENCE = 3600.0  # seconds from which on nobody writes such a file any more
_MOST_STEM = 200  # bytes: what is put behind it has to fit into the 255 of a file's name


def file_stem(path: Path) -> str:
    """A name for what comes of a file: its own without the ending, as text, not hidden, not empty and not too long."""
    stem = path.stem.encode("utf-8", "replace").decode().lstrip(".")
    return stem.encode()[:_MOST_STEM].decode("utf-8", "ignore") or "image"


def read_text(path: str | os.PathLike[str], most_bytes: int) -> str:
    """The text, in UTF-8, of an ordinary file of at most `most_bytes`.

    Raises OSError, whose `strerror` says what is wrong in a few words, for all else: also for devices and pipes, which
    may have no end, for a larger file, and for bytes that are no text.
    """
    try:
        kind = os.stat(path).st_mode
    except ValueError as error:  # a path with a null in it
        raise OSError(errno.EINVAL, str(error)) from None
    if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
        raise OSError(errno.EINVAL, "it is no ordinary file")
    with open(path, "rb") as stream:
        data = stream.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise OSError(errno.EFBIG, f"it has more than {most_bytes / 1e6:g} MB")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise OSError(errno.EILSEQ, "not UTF-8 text") from None


@functools.lru_cache(maxsize=64)
def _sweep(folder: Path) -> None:
    """Remove, once in a folder, the temporary files of processes that were killed while they wrote there."""
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            if _TEMPORARY.fullmatch(entry.name) and time.time() - entry.stat().st_mtime > _PATIENCE:
                os.unlink(entry.path)


def write_atomically(path: str | os.PathLike[str], data: bytes | str) -> Path:
    """Write `data` (text as UTF-8) to a file, whole or not at all, and return its path.

    Missing parent folders are made, a file that is there is replaced, a link is followed. Until all is written, a
    file of that name keeps its old content; whatever goes wrong, the temporary file beside it is removed.

    Raises OutputError if the place cannot be written or the disk is full.
    """
    part = None
    try:
        real = Path(os.path.realpath(path))
        if os.path.exists(real) and not os.path.isfile(real):
            raise OutputError(f"cannot write {path} (it is no ordinary file); give the path of a file")
        part = real.with_name(f".{secrets.token_hex(6)}.tmp")  # short, for the name itself may be as long as can be
        real.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(data.encode("utf-8") if isinstance(data, str) else data)
        os.replace(part, real)
        _sweep(real.parent)
    except BaseException as error:
        if part is not None:
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise OutputError(f"cannot write {path} ({error.strerror or error}); give a writable path") from None
        if isinstance(error, ValueError):  # no name to write to, a null in it, a lone surrogate in the text
            raise OutputError(f"cannot write {path} ({error}); give the path of a file") from None
        raise
    return Path(path)
