"""Options from outside: YAML files, and values that are checked against a config dataclass."""

import os
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import TypeAdapter, ValidationError

from autopoly_env.arguments import first_defect
from autopoly_env.errors import ConfigError

_Config = TypeVar("_Config")


def read_yaml(path: str | os.PathLike[str], of: str = "options", *, may_be_empty: bool = True) -> dict[Any, Any]:
    """The mapping in a YAML file `of` something; an empty file is an empty one, if it `may_be_empty`.

    Raises ConfigError, in one line with the path.
    """
    try:
        options = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise ConfigError(f"cannot read {path} ({reason}); give a YAML file of {of}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"{path}: not YAML ({reason}); write one 'option: value' a line") from None
    if options is None and may_be_empty:
        return {}
    if not isinstance(options, dict):
        raise ConfigError(f"{path}: holds a {type(options).__name__}; write one 'option: value' a line")
    return options


def validated(kind: type[_Config], values: dict[str, Any], what: str = "") -> _Config:
    """A config of a dataclass from plain values.

    Raises ConfigError for the first value that does not fit, its message beginning with `what` and the value's key;
    errors of the dataclass itself come as they are.
    """
    try:
        return TypeAdapter(kind).validate_python(values)
    except ValidationError as error:
        defect = first_defect(error)
        raise ConfigError(f"{what}{defect}, got {defect.value!r}") from None
