"""Options from outside: YAML files, `key=value` on the command line, and values checked against a config dataclass."""

import json
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, get_type_hints

import yaml
from pydantic import TypeAdapter, ValidationError

from autopoly_env.arguments import LARGEST, first_defect
from autopoly_env.errors import ConfigError
from autopoly_env.files import read_text
from autopoly_env.shown import short, told

_Config = TypeVar("_Config")

MOST_BYTES = 1_000_000  # of a file
MOST_VALUES = 100_000  # in it
_MOST_REASON = 160  # letters of what is wrong with it


def read_yaml(path: str | os.PathLike[str], of: str = "options", *, may_be_empty: bool = True) -> dict[Any, Any]:
    """The mapping in a YAML file `of` something; an empty file is an empty one, if it `may_be_empty`.

    Raises ConfigError, in one line with the path.
    """
    try:
        text = read_text(path, MOST_BYTES)
    except OSError as error:
        raise ConfigError(f"cannot read {path} ({error.strerror}); give a YAML file of {of}") from None
    try:
        options = plain_yaml(text)
    except ValueError as error:
        raise ConfigError(f"{path}: not YAML ({error}); write one 'option: value' a line") from None
    if options is None and may_be_empty:
        return {}
    if not isinstance(options, dict):
        raise ConfigError(f"{path}: holds a {type(options).__name__}; write one 'option: value' a line")
    return options


def plain_yaml(text: str) -> Any:
    """The plain values in YAML text. Raises ValueError, in one line, for what is none.

    That is also what an alias makes too large, or a part of itself: it would be written out in full somewhere.
    """
    try:
        return _checked(yaml.safe_load(text))
    except (
        yaml.YAMLError,
        ArithmeticError,
        AttributeError,
        LookupError,
        RecursionError,
        TypeError,
        ValueError,
    ) as error:
        raise ValueError(
            told(str(error), _MOST_REASON)
        ) from None  # its readers of dates and numbers raise what they like


def _checked(value: Any) -> Any:
    """The value, if it is not too large once written out. Raises ValueError."""
    n = _n_written(value, {})
    if n > MOST_VALUES:
        raise ValueError(f"with its aliases it holds more than {MOST_VALUES} values")
    return value


def _n_written(value: Any, known: dict[int, int]) -> int:
    """How many values are written where this is; `known`: of lists and mappings by identity, 0 while in work."""
    if not isinstance(value, dict | list | set | tuple):
        return 1
    if id(value) in known:
        if known[id(value)] == 0:
            raise ValueError("it is a part of itself")
        return known[id(value)]
    known[id(value)] = 0
    inner = [*value.keys(), *value.values()] if isinstance(value, dict) else value
    known[id(value)] = 1 + sum(_n_written(one, known) for one in inner)
    return known[id(value)]


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
        return _checked(json.loads(written))  # first, for YAML 1.1 takes 1e-3 for text
    except (ValueError, RecursionError):
        pass
    try:
        return plain_yaml(written)
    except ValueError:
        raise ConfigError(f"{where}: the value is not YAML; quote it or correct it") from None


@cache
def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    """What validates values of a dataclass: it takes longer to make than to use."""
    return TypeAdapter(kind)


def validated(kind: type[_Config], values: dict[str, Any], what: str = "") -> _Config:
    """A config of a dataclass from plain values.

    Raises ConfigError for the first value that does not fit or is no finite number of 64 bits, its message beginning
    with `what` and the value's key. Errors of the dataclass itself come as they are, those of a section, which does not
    know its own name, with that before them.
    """
    hashable: Any = kind  # as classes are, which mypy does not believe
    try:
        config: _Config = _adapter(hashable).validate_python(values)
    except ValidationError as error:
        defect = first_defect(error)
        raise ConfigError(f"{what}{defect}, got {short(defect.value)}") from None
    except ConfigError as error:
        raise ConfigError(f"{_section_of(kind, values, str(error))}{error}") from None
    for key, number in _numbers_in(config):
        if not -LARGEST <= number <= LARGEST:
            raise ConfigError(f"{what}{key}: expected a finite number of at most 64 bits, got {short(number)}")
    return config


def _section_of(kind: type[Any], values: dict[str, Any], problem: str) -> str:
    """Where the setting stands with whose name a problem begins, as in "run."; empty where that is in no section."""
    for name, section in get_type_hints(kind).items():
        if not (is_dataclass(section) and isinstance(section, type) and isinstance(values.get(name), dict)):
            continue
        try:
            _adapter(section).validate_python(values[name])
        except ValidationError:
            continue  # whoever calls has told of that
        except ConfigError as error:
            is_its_own = re.split(r"\W", str(error))[0] in {field.name for field in fields(section)}
            if str(error) == problem:
                return f"{name}." if is_its_own else _section_of(section, values[name], problem)
    return ""


def _numbers_in(value: Any, key: str = "") -> Iterator[tuple[str, int | float]]:
    """All numbers of a config, with their dotted keys; what is no plain value or dataclass is passed over."""
    if isinstance(value, int | float):
        yield key, value
        return
    inner: Iterable[tuple[Any, Any]] = ()
    if is_dataclass(value):
        inner = vars(value).items()
    elif isinstance(value, dict):
        inner = value.items()
    elif isinstance(value, list | tuple):
        inner = enumerate(value)
    for name, one in inner:
        yield from _numbers_in(one, f"{key}.{name}" if key else str(name))
