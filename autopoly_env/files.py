"""Writing result files so that nobody ever meets half of one."""

import contextlib
import os
import secrets
from pathlib import Path

from autopoly_env.errors import OutputError


def write_atomically(path: str | os.PathLike[str], data: bytes | str) -> Path:
    """Write `data` (text as UTF-8) to a file, whole or not at all, and return its path.

    Missing parent folders are made, a file that is there is replaced, a link is followed. Until all is written, a
    file of that name keeps its old content; whatever goes wrong, the temporary file beside it is removed.

    Raises OutputError if the place cannot be written or the disk is full.
    """
    real = Path(os.path.realpath(path))
    if real.exists() and not real.is_file():
        raise OutputError(f"cannot write {path} (it is no ordinary file); give the path of a file")
    part = real.with_name(f"{real.name}.{secrets.token_hex(4)}.tmp")
    try:
        real.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(data.encode("utf-8") if isinstance(data, str) else data)
        os.replace(part, real)
    except BaseException as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise OutputError(f"cannot write {path} ({error.strerror or error}); give a writable path") from None
        raise
    return Path(path)
