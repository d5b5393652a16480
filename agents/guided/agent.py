"""`nfap-prior` and `nfap-mcts`: the tree search with networks in it."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from agents.base import Agent, Decision
from agents.budget import Foresight, Meter
from agents.extras import require
from agents.guided.config import NfapMctsConfig, NfapPriorConfig
from agents.knowing import KnowingAgent, Known
from agents.search.mcts import MctsAgent
from agents.solution import Track
from autopoly_env.compute import n_threads
from autopoly_env.errors import ConfigError
from autopoly_env.operators import STOP
from autopoly_env.simulator import Simulator, State

if TYPE_CHECKING:
    from agents.guided.evaluator import NfapEvaluator


class NfapPriorAgent(KnowingAgent, MctsAgent):
    """Tree search with nFAP-Net's priors and exact refits."""

    name = "nfap-prior"

    def __init__(self, config: NfapPriorConfig, incumbents: Sequence[Agent], evaluator: "NfapEvaluator") -> None:
        super().__init__(config, incumbents, evaluator)
        self._nfap = evaluator

    @property
    def known(self) -> Known:
        return self._nfap.known


class NfapMctsAgent(KnowingAgent):
    """The paper's search with learning: a tree for every step, grown with the networks; the step itself is refitted."""

    name = "nfap-mcts"

    def __init__(self, config: NfapMctsConfig, evaluator: "NfapEvaluator") -> None:
        self._config, self._evaluator = config, evaluator
        self._searcher = MctsAgent(replace(config, seeds=()), (), evaluator)

    @property
    def known(self) -> Known:
        return self._evaluator.known

    def act(self, simulator: Simulator, state: State) -> Decision:
        """Search a tree of its own from `state`; STOP where nothing in it is better, fitted as in the tree."""
        self.known.check(simulator)
        return self._searcher.act(simulator, state)

    def _search(self, simulator: Simulator, track: Track, meter: Meter) -> Iterator[Track]:
        """Search, commit the step with an exact refit, and so on.

        Trees fit less well than whole refits, so one may hold nothing better although there is something: then the
        likeliest action is taken, until `patience` steps in a row have not improved the best shape.
        """
        best_total, failures = track.state.score.total, 0
        while not track.state.done and failures < self._config.patience and not meter.spent():
            n_before = simulator.n_refits
            following = self._step(simulator, track.state, meter)
            if following is None:
                return
            meter.add([following], simulator.n_refits - n_before)
            track = Track(following, track)
            yield track
            failures += 1
            if track.state.score.total > best_total:
                best_total, failures = track.state.score.total, 0

    def _step(self, simulator: Simulator, state: State, meter: Meter) -> State | None:
        """The state to go on from; None where nothing can be done. A tree takes no refits, but time and memory."""
        chosen = self._searcher.decide(simulator, state, Foresight(meter)).action
        candidates = [chosen]
        if chosen == STOP:
            legal = simulator.legal_actions(state)[1:]
            prior = self._evaluator.prior(simulator, state, legal) if legal else np.empty(0)
            candidates = [legal[k] for k in np.argsort(-prior, kind="stable")]
        return next((made for action in candidates for made in simulator.transition_all(state, [action])), None)


def nfap_prior(config: NfapPriorConfig, incumbents: Sequence[Agent] = ()) -> Agent:
    """The agent of a config; `incumbents` are the agents that it names as seeds. Raises ConfigError as `load_nfap`."""
    evaluator = nfap_evaluator("nfap-prior", config.nfap_weights, config.temperature, config.n)
    return NfapPriorAgent(config, incumbents, evaluator)


def nfap_evaluator(agent: str, weights: str, temperature: float, n: int | None = None) -> "NfapEvaluator":
    """nFAP-Net's priors for the agent of that name. Raises ConfigError as `load_nfap`, and where torch is missing."""
    _require_torch(agent)
    from agents.guided.evaluator import NfapEvaluator
    from agents.guided.weights import load_nfap

    net, meta = load_nfap(weights)
    _check_n(net.config.n if n is None else n, net.config.n)
    return NfapEvaluator(net, meta, temperature)


def nfap_mcts(config: NfapMctsConfig) -> Agent:
    """As `nfap_prior`; seeds it has none."""
    _require_torch("nfap-mcts")
    from agents.guided.evaluator import QuickEvaluator, WarpEvaluator
    from agents.guided.weights import load_nfap, load_warpnet

    net, meta = load_nfap(config.nfap_weights)
    _check_n(config.n, net.config.n)
    placed = config.start == "placed"
    if config.geometry == "quick":
        return NfapMctsAgent(config, QuickEvaluator(net, meta, config.temperature, placed))
    warp, _ = load_warpnet(config.warpnet_weights)
    return NfapMctsAgent(config, WarpEvaluator(net, meta, warp, config.temperature, placed))


def _require_torch(name: str) -> None:
    """Raise ConfigError where the packages that the networks need are missing; keep torch to this process's threads."""
    require("learn", f"agent {name!r}", "safetensors", "torch")
    import torch

    torch.set_num_threads(n_threads())


def _check_n(given: int, n: int) -> None:
    if given != n:
        raise ConfigError(f"n = {given}: the weights foresee {n} stages; give n={n} or the weights of another network")
