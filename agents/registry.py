"""Agents by name: `make_agent("beam", width=4)`; and those from outside: `make_agent("my.module:MyAgent")`."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from agents.base import Agent
from agents.baselines.beam import BeamAgent, GreedyAgent
from agents.baselines.fixed_topology import DrComplexConfig, DrSimpleConfig, dr_complex, dr_simple
from agents.baselines.oracle import OracleAgent
from agents.baselines.random_agent import RandomAgent
from agents.climb.agent import ClimbAgent
from agents.climb.decimate import DecimateAgent
from agents.entry import AgentEntry, entry_of, outside_entry
from agents.guided.agent import nfap_mcts, nfap_prior
from agents.guided.config import NfapMctsConfig, NfapPriorConfig
from agents.quads.agent import QuadsAgent
from agents.rl.agent import PRIOR, rl_agent, rl_prior
from agents.rl.config import RlConfig, RlPriorConfig
from agents.search.config import PAPER, MctsConfig
from agents.search.mcts import MctsAgent, PaperMctsAgent
from agents.trace.agent import TraceAgent
from autopoly_env.errors import ConfigError

SUFFIXES = (".yaml", ".yml")  # of files of options


def _mcts(config: MctsConfig) -> Agent:
    return MctsAgent(config, [make_agent(name) for name in config.seeds])


def _mcts_paper(config: MctsConfig) -> Agent:
    return PaperMctsAgent(config, [make_agent(name) for name in config.seeds])


def _nfap_prior(config: NfapPriorConfig) -> Agent:
    return nfap_prior(config, [make_agent(name) for name in config.seeds])


def _rl_prior(config: RlPriorConfig) -> Agent:
    options = {PRIOR: {"weights": config.weights}}
    return rl_prior(config, [make_agent(name, **options.get(name, {})) for name in config.seeds])


AGENTS: dict[str, AgentEntry] = {}


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


register_agent("random", RandomAgent)
register_agent("greedy", GreedyAgent)
register_agent("beam", BeamAgent)
register_agent("trace", TraceAgent)
register_agent("climb", ClimbAgent)
register_agent("decimate", DecimateAgent)
register_agent("quads", QuadsAgent)
register_agent("mcts", _mcts, MctsConfig())
register_agent("mcts_paper", _mcts_paper, PAPER)
register_agent("nfap-prior", _nfap_prior, NfapPriorConfig())
register_agent("nfap-mcts", nfap_mcts, NfapMctsConfig())
for _name in ("ppo", "maskable-ppo", "a2c", "dqn"):
    register_agent(_name, partial(rl_agent, _name), RlConfig())
register_agent("rl-prior", _rl_prior, RlPriorConfig())
register_agent("oracle", OracleAgent)
register_agent("dr-simple", dr_simple, DrSimpleConfig())
register_agent("dr-complex", dr_complex, DrComplexConfig())
