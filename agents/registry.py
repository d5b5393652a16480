"""Agents by name: `make_agent("beam", width=4)`; and those from outside: `make_agent("my.module:MyAgent")`."""

from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

from agents.base import Agent
from agents.entry import AgentEntry, entry_of, outside_entry
from autopoly_env.errors import ConfigError

SUFFIXES = (".yaml", ".yml")  # of files of options


class _Entries(MutableMapping[str, AgentEntry]):
    """Entries by name, each made when it is first asked for: the modules of most agents are not needed."""

    def __init__(self, makers: Mapping[str, Callable[[], AgentEntry]]) -> None:
        self._makers, self._made = dict(makers), dict[str, AgentEntry]()

    def __getitem__(self, name: str) -> AgentEntry:
        if name not in self._made:
            self._made[name] = self._makers[name]()
        return self._made[name]

    def __setitem__(self, name: str, entry: AgentEntry) -> None:
        self._makers[name], self._made[name] = lambda: entry, entry

    def __delitem__(self, name: str) -> None:
        del self._makers[name]
        self._made.pop(name, None)

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


def _class(home: str, name: str) -> AgentEntry:
    """The agent of a class in a module of this package, as my.module:Agent is one of another."""
    module, _, class_name = home.partition(":")
    return entry_of(getattr(import_module(f"agents.{module}"), class_name), name)


def _mcts() -> AgentEntry:
    from agents.search.config import MctsConfig
    from agents.search.mcts import MctsAgent

    return AgentEntry("mcts", lambda config: MctsAgent(config, _seeds(config.seeds)), MctsConfig())


def _mcts_paper() -> AgentEntry:
    from agents.search.config import PAPER
    from agents.search.mcts import PaperMctsAgent

    return AgentEntry("mcts_paper", lambda config: PaperMctsAgent(config, _seeds(config.seeds)), PAPER)


def _nfap_prior() -> AgentEntry:
    from agents.guided.agent import nfap_prior
    from agents.guided.config import NfapPriorConfig

    return AgentEntry("nfap-prior", lambda config: nfap_prior(config, _seeds(config.seeds)), NfapPriorConfig())


def _choice_prior() -> AgentEntry:
    from agents.choice.agent import choice_prior
    from agents.choice.config import ChoicePriorConfig

    return AgentEntry("choice-prior", lambda config: choice_prior(config, _seeds(config.seeds)), ChoicePriorConfig())


def _nfap_mcts() -> AgentEntry:
    from agents.guided.agent import nfap_mcts
    from agents.guided.config import NfapMctsConfig

    return AgentEntry("nfap-mcts", nfap_mcts, NfapMctsConfig())


def _policy(name: str) -> AgentEntry:
    from agents.rl.agent import rl_agent
    from agents.rl.config import RlConfig

    return AgentEntry(name, partial(rl_agent, name), RlConfig())


def _rl_prior() -> AgentEntry:
    from agents.rl.agent import PRIOR, rl_prior
    from agents.rl.config import RlPriorConfig

    def made(config: RlPriorConfig) -> Agent:
        return rl_prior(config, _seeds(config.seeds, {PRIOR: {"weights": config.weights}}))

    return AgentEntry("rl-prior", made, RlPriorConfig())


def _dr_simple() -> AgentEntry:
    from agents.baselines.fixed_topology import DrSimpleConfig, dr_simple

    return AgentEntry("dr-simple", dr_simple, DrSimpleConfig())


def _dr_complex() -> AgentEntry:
    from agents.baselines.fixed_topology import DrComplexConfig, dr_complex

    return AgentEntry("dr-complex", dr_complex, DrComplexConfig())


def _seeds(names: Sequence[str], options: Mapping[str, Mapping[str, Any]] = MappingProxyType({})) -> list[Agent]:
    """The agents whose best a search goes on from."""
    return [make_agent(name, **options.get(name, {})) for name in names]


AGENTS: MutableMapping[str, AgentEntry] = _Entries(
    {
        "random": partial(_class, "baselines.random_agent:RandomAgent", "random"),
        "greedy": partial(_class, "baselines.beam:GreedyAgent", "greedy"),
        "beam": partial(_class, "baselines.beam:BeamAgent", "beam"),
        "trace": partial(_class, "trace.agent:TraceAgent", "trace"),
        "climb": partial(_class, "climb.agent:ClimbAgent", "climb"),
        "decimate": partial(_class, "climb.decimate:DecimateAgent", "decimate"),
        "quads": partial(_class, "quads.agent:QuadsAgent", "quads"),
        "mcts": _mcts,
        "mcts_paper": _mcts_paper,
        "nfap-prior": _nfap_prior,
        "nfap-mcts": _nfap_mcts,
        "choice-prior": _choice_prior,
        **{name: partial(_policy, name) for name in ("ppo", "maskable-ppo", "a2c", "dqn")},
        "rl-prior": _rl_prior,
        "oracle": partial(_class, "baselines.oracle:OracleAgent", "oracle"),
        "dr-simple": _dr_simple,
        "dr-complex": _dr_complex,
    }
)


def register_agent(name: str, made_by: Callable[..., Agent], default: Any = None) -> None:
    """Make an agent known by a name: a class or a function, and its config where that is not its `config_class`'s.

    Known are names in this process only: a worker of an evaluation finds an agent from outside by my.module:Agent.
    Raises ConfigError for a name that is taken or means a file or a module, and as `entry_of`.
    """
    if name in AGENTS or ":" in name or name.endswith(SUFFIXES):
        raise ConfigError(f"agent name {name!r}: expected one that is not taken, no file and no my.module:Agent")
    AGENTS[name] = entry_of(made_by, name) if default is None else AgentEntry(name, made_by, default)


def find_agent(agent: str | Callable[..., Agent]) -> AgentEntry:
    """The agent of a name; of a class or function, itself or by my.module:Agent; or of a YAML file of its options.

    The file is named after the agent. Raises ConfigError, in one line, where there is none, or it is not sound.
    """
    if not isinstance(agent, str):
        return entry_of(agent)
    if agent in AGENTS:
        return AGENTS[agent]
    if agent.endswith(SUFFIXES):
        path = Path(agent)
        if path.stem not in AGENTS:
            known = ", ".join(AGENTS)
            raise ConfigError(f"{agent}: no agent is called {path.stem!r}; name the file after one of {known}")
        return AGENTS[path.stem].from_file(path)
    if ":" in agent:
        return outside_entry(agent)
    raise ConfigError(f"agent {agent!r} is unknown; give one of {', '.join(AGENTS)}, my.module:Agent, or a YAML file")


def make_agent(agent: str | Callable[..., Agent], /, **options: Any) -> Agent:
    """The agent that `find_agent` finds, with these options of its config. Raises ConfigError for an unknown one."""
    return find_agent(agent).agent(**options)
