"""Agents from files: `configs/agent/NAME.yaml` holds options of the agent NAME; those left out are at their default."""

import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from agents.base import Agent
from agents.options import read_yaml, validated
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
    options = read_yaml(path)
    known = default.__dataclass_fields__
    unknown = [key for key in options if key not in known]
    if unknown:
        allowed = ", ".join(known) or "none"
        raise ConfigError(f"{path}: unknown option {unknown[0]!r}; the options of {name} are {allowed}")
    try:
        return validated(type(default), asdict(default) | options, "option ")
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None
