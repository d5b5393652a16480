"""`AgentEntry`: how an agent is made, and which options it takes; of ours, of a class, of a function, of a file."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields, is_dataclass, make_dataclass, replace
from pathlib import Path
from typing import Any

from agents.base import Agent
from agents.options import read_yaml, validated
from autopoly_env import outside
from autopoly_env.errors import ConfigError

CONTRACT = "expected a subclass of agents.base.Agent, or a function that returns an agent"


@dataclass(frozen=True)
class NoOptions:
    """The options of an agent that has none."""


@dataclass(frozen=True)
class AgentEntry:
    """An agent that can be made."""

    name: str
    make: Callable[[Any], Agent]  # of a config as `default` is one
    default: Any = field(default_factory=NoOptions)  # a config dataclass
    given: Mapping[str, Any] = field(default_factory=dict)  # options that are not as in `default`, as a file gives them

    @property
    def options(self) -> tuple[str, ...]:
        """The names of the options that the agent takes."""
        return tuple(one.name for one in fields(self.default) if one.init)

    def config(self, **options: Any) -> Any:
        """The config with these options, checked. Raises ConfigError for an option that there is not, or not so."""
        unknown = [name for name in options if name not in self.options]
        if unknown:
            known = ", ".join(self.options) or "none"
            raise ConfigError(f"agent {self.name!r} has no option {unknown[0]!r}; its options are {known}")
        values = {name: getattr(self.default, name) for name in self.options} | dict(self.given) | options
        return validated(type(self.default), values, f"agent {self.name!r}, option ")

    def agent(self, **options: Any) -> Agent:
        """An agent with these options. Raises ConfigError as `config`, and for what is no agent."""
        agent = self.make(self.config(**options))
        if not isinstance(agent, Agent):
            raise ConfigError(f"agent {self.name!r}: {agent!r} came out of it; {CONTRACT}")
        return agent

    def from_file(self, path: Path) -> "AgentEntry":
        """The agent with the options in a YAML file. Raises ConfigError, in one line that begins with the file."""
        options = read_yaml(path)
        unknown = [key for key in options if key not in self.options]
        if unknown:
            known = ", ".join(self.options) or "none"
            raise ConfigError(f"{path}: unknown option {unknown[0]!r}; the options of {self.name} are {known}")
        entry = replace(self, given=options)
        try:
            entry.config()
        except ConfigError as error:
            raise ConfigError(f"{path}: {error}") from None
        return entry


class _OutsideEntry(AgentEntry):
    """An agent that somebody else has written: whatever goes wrong in making it is told in one line."""

    def agent(self, **options: Any) -> Agent:
        with outside.told(f"agent {self.name!r}", self.name.partition(":")[0]):
            return super().agent(**options)


def entry_of(made_by: object, name: str = "") -> AgentEntry:
    """The agent that a class or a function makes.

    One that has a `config_class`, a dataclass with a default for every field, is called with one of that. Without, a
    class is called without arguments, and a function's parameters are the options. Raises ConfigError.
    """
    name = name or f"{getattr(made_by, '__module__', '')}:{getattr(made_by, '__qualname__', made_by)}"
    if not callable(made_by) or (isinstance(made_by, type) and not issubclass(made_by, Agent)):
        raise ConfigError(f"agent {name!r} is {made_by!r}; {CONTRACT}")
    config_class = getattr(made_by, "config_class", None)
    if config_class is not None:
        return AgentEntry(name, made_by, _default_of(config_class, name))
    if isinstance(made_by, type):
        return AgentEntry(name, lambda _: made_by())
    return AgentEntry(name, lambda config: made_by(**vars(config)), _default_of(_parameters_of(made_by), name))


def outside_entry(text: str) -> AgentEntry:
    """The agent that my.module:Agent names. Raises ConfigError, in one line, for whatever is wrong with it."""
    made_by = outside.load(text, "agent")
    with outside.told(f"agent {text!r}", text.partition(":")[0]):
        entry = entry_of(made_by, text)
    return _OutsideEntry(entry.name, entry.make, entry.default)


def _default_of(config_class: Any, name: str) -> Any:
    if not (isinstance(config_class, type) and is_dataclass(config_class)):
        raise ConfigError(f"agent {name!r}: its config_class is {config_class!r}; expected a dataclass")
    needed = [
        one.name
        for one in fields(config_class)
        if one.init and one.default is MISSING and one.default_factory is MISSING
    ]
    if needed:
        raise ConfigError(f"agent {name!r}: its option {needed[0]!r} has no default; give it one")
    return config_class()


def _parameters_of(function: Callable[..., Any]) -> type:
    """A function's parameters as a dataclass."""
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    parameters = [p for p in inspect.signature(function, eval_str=True).parameters.values() if p.kind in kinds]
    described = []
    for p in parameters:
        kind = Any if p.annotation is p.empty else p.annotation
        described.append((p.name, kind) if p.default is p.empty else (p.name, kind, _plain_field(p.default)))
    return make_dataclass("Parameters", described, kw_only=True, frozen=True)


def _plain_field(default: Any) -> Any:
    return field(default_factory=lambda: default)
