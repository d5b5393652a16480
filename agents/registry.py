"""Agents by name: `make_agent("beam", width=4)`."""

from collections.abc import Callable
from functools import partial
from typing import Any

from agents.base import Agent
from agents.baselines.beam import BeamAgent, BeamConfig
from agents.baselines.fixed_topology import DrComplexConfig, DrSimpleConfig, dr_complex, dr_simple
from agents.baselines.oracle import OracleAgent, OracleConfig
from agents.baselines.random_agent import RandomAgent, RandomConfig
from agents.climb.agent import ClimbAgent, ClimbConfig
from agents.climb.decimate import DecimateAgent, DecimateConfig
from agents.guided.agent import nfap_mcts, nfap_prior
from agents.guided.config import NfapMctsConfig, NfapPriorConfig
from agents.options import validated
from agents.rl.agent import PRIOR, rl_agent, rl_prior
from agents.rl.config import RlConfig, RlPriorConfig
from agents.search.config import PAPER, MctsConfig
from agents.search.mcts import MctsAgent, PaperMctsAgent
from agents.trace.agent import TraceAgent, TraceConfig
from autopoly_env.errors import ConfigError


class _Greedy(BeamAgent):
    name = "greedy"


def _mcts(config: MctsConfig) -> Agent:
    return MctsAgent(config, [make_agent(name) for name in config.seeds])


def _mcts_paper(config: MctsConfig) -> Agent:
    return PaperMctsAgent(config, [make_agent(name) for name in config.seeds])


def _nfap_prior(config: NfapPriorConfig) -> Agent:
    return nfap_prior(config, [make_agent(name) for name in config.seeds])


def _rl_prior(config: RlPriorConfig) -> Agent:
    options = {PRIOR: {"weights": config.weights}}
    return rl_prior(config, [make_agent(name, **options.get(name, {})) for name in config.seeds])


AGENTS: dict[str, tuple[Callable[[Any], Agent], Any]] = {
    "random": (RandomAgent, RandomConfig()),
    "greedy": (_Greedy, BeamConfig(width=1)),
    "beam": (BeamAgent, BeamConfig()),
    "trace": (TraceAgent, TraceConfig()),
    "climb": (ClimbAgent, ClimbConfig()),
    "decimate": (DecimateAgent, DecimateConfig()),
    "mcts": (_mcts, MctsConfig()),
    "mcts_paper": (_mcts_paper, PAPER),
    "nfap-prior": (_nfap_prior, NfapPriorConfig()),
    "nfap-mcts": (nfap_mcts, NfapMctsConfig()),
    "ppo": (partial(rl_agent, "ppo"), RlConfig()),
    "maskable-ppo": (partial(rl_agent, "maskable-ppo"), RlConfig()),
    "a2c": (partial(rl_agent, "a2c"), RlConfig()),
    "dqn": (partial(rl_agent, "dqn"), RlConfig()),
    "rl-prior": (_rl_prior, RlPriorConfig()),
    "oracle": (OracleAgent, OracleConfig()),
    "dr-simple": (dr_simple, DrSimpleConfig()),
    "dr-complex": (dr_complex, DrComplexConfig()),
}


def make_agent(name: str, /, **options: Any) -> Agent:
    """The agent of that name with these options of its config class. Raises ConfigError for an unknown one."""
    if name not in AGENTS:
        raise ConfigError(f"agent {name!r} is unknown; give one of {', '.join(AGENTS)}")
    make, default = AGENTS[name]
    unknown = sorted(set(options) - set(default.__dataclass_fields__))
    if unknown:
        known = ", ".join(default.__dataclass_fields__)
        raise ConfigError(f"agent {name!r} has no option {unknown[0]!r}; its options are {known}")
    values = {field: getattr(default, field) for field in default.__dataclass_fields__} | options
    return make(validated(type(default), values, f"agent {name!r}, option "))
