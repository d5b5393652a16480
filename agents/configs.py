"""Agents from files: `configs/agent/NAME.yaml` holds options of the agent NAME; those left out are at their default."""

import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import yaml
from pydantic import TypeAdapter, ValidationError

from agents.base import Agent
from agents.registry import AGENTS
from autopoly_env.errors import ConfigError


def load_agent(path: str | os.PathLike[str]) -> Agent:
    """The agent that a file describes. Raises ConfigError as `load_config`."""
    config = load_config(path)
    make, _ = AGENTS[Path(path).stem]
    return make(config)


def load_config(path: str | os.PathLike[str]) -> Any:
    """The config dataclass in a YAML file that is named after its agent.

    Raises ConfigError, in one line that begins with the file, if it cannot be read, is no YAML, is named after no
    agent, or has an option that the agent does not know or cannot take.
    """
    name = Path(path).stem
    if name not in AGENTS:
        raise ConfigError(f"{path}: no agent is called {name!r}; name the file after one of {', '.join(AGENTS)}")
    _, default = AGENTS[name]
    options = _read(path)
    known = default.__dataclass_fields__
    unknown = [key for key in options if key not in known]
    if unknown:
        allowed = ", ".join(known) or "none"
        raise ConfigError(f"{path}: unknown option {unknown[0]!r}; the options of {name} are {allowed}")
    try:
        return TypeAdapter(type(default)).validate_python(asdict(default) | options)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise ConfigError(f"{path}: option {where}: {first['msg']}, got {first['input']!r}") from None
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None


def _read(path: str | os.PathLike[str]) -> dict[Any, Any]:
    """The mapping in a YAML file; an empty file is an empty one."""
    try:
        options = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise ConfigError(f"cannot read {path} ({reason}); give a YAML file of options") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"{path}: not YAML ({reason}); write one 'option: value' a line") from None
    if options is None:
        return {}
    if not isinstance(options, dict):
        raise ConfigError(f"{path}: holds a {type(options).__name__}; write one 'option: value' a line")
    return options
