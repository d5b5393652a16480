"""Parts from outside this repository: found by `my.module:name`, and what goes wrong in them told in one line."""

import importlib
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from autopoly_env.errors import AutoPolyError, ConfigError


def is_path(text: str) -> bool:
    """Whether a text names something by its module, as in my.module:Agent."""
    module, colon, name = text.partition(":")
    return bool(colon) and all(part.isidentifier() for part in (*module.split("."), *name.split(".")))


def load(text: str, what: str) -> object:
    """What `my.module:name` names. Raises ConfigError, in one line that begins with `what` the text is for."""
    if not is_path(text):
        raise ConfigError(f"{what} {text!r}: expected a module and a name in it, such as my.module:name")
    module, _, name = text.partition(":")
    with told(f"{what} {text!r}: cannot import {module}", module):
        try:
            found: object = importlib.import_module(module)
        except ModuleNotFoundError as error:
            if error.name is None or not f"{module}.".startswith(f"{error.name}."):
                raise
            where = "run from the folder that it is in, or put that on PYTHONPATH"
            raise ConfigError(f"{what} {text!r}: there is no module {error.name}; {where}") from None
    for part in name.split("."):
        if not hasattr(found, part):
            raise ConfigError(f"{what} {text!r}: {module} has no attribute {name}")
        found = getattr(found, part)
    return found


@contextmanager
def told(where: str, module: str) -> Iterator[None]:
    """Errors from within become a ConfigError in one line, which begins with `where`; ours come as they are.

    `module` is the one that they are looked for in.
    """
    try:
        yield
    except AutoPolyError:
        raise
    except (Exception, SystemExit) as error:  # whatever somebody else's code may do
        raise ConfigError(f"{where}: {described(error, module)}") from error


def described(error: BaseException, module: str = "") -> str:
    """An exception in one line: its type, what it says, and the file and line that it comes from.

    With a module: the innermost line of that one, if it took part.
    """
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if _is_told(frame.filename)]
    own = [frame for frame in frames if _is_file_of(frame.filename, module)] or frames
    place = f" ({Path(own[-1].filename).name} line {own[-1].lineno})" if own else ""
    return " ".join(f"{type(error).__name__}: {error}{place}".split())


def _is_told(file: str) -> bool:
    """Whether a file is not of the machinery that modules are imported with."""
    return not file.startswith("<") and file not in (__file__, importlib.__file__)


def _is_file_of(file: str, module: str) -> bool:
    parts, names = Path(file).with_suffix("").parts, tuple(module.split("."))
    return parts[-len(names) :] == names or parts[-len(names) - 1 :] == (*names, "__init__")
