"""Options from outside: YAML files, `key=value` on the command line, and values checked against a config dataclass."""

import json
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


def put_override(values: dict[Any, Any], text: str, where: str, example: str) -> None:
    """Put "key=value" or "section.key=value" into plain values, sections made where there are none.

    A value is YAML, such as 4, 1e-3, [trace] or text, in which JSON means what it means as JSON. Raises ConfigError,
    which begins with `where` the text comes from and gives an `example`, for what is none of that.

    >>> values = {"net": {"n": 3}}
    >>> put_override(values, "net.inputs=[a, b]", "--set net.inputs=[a, b]", "net.n=4")
    >>> values
    {'net': {'n': 3, 'inputs': ['a', 'b']}}
    """
    path, equals, written = text.partition("=")
    if not (path and equals):
        raise ConfigError(f"{where}: expected key=value, such as {example}")
    *sections, key = path.split(".")
    for section in sections:
        values = values.setdefault(section, {})
        if not isinstance(values, dict):
            raise ConfigError(f"{where}: {section!r} is no section; give such as {example}")
    values[key] = _value(written, where)


def _value(written: str, where: str) -> Any:
    try:
        return json.loads(written)  # first, for YAML 1.1 takes 1e-3 for text
    except (ValueError, RecursionError):
        pass
    try:
        return yaml.safe_load(written)
    except (yaml.YAMLError, ValueError, RecursionError):
        raise ConfigError(f"{where}: the value is not YAML; quote it or correct it") from None


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
