"""The random agent: its seed decides, and it plays by the rules."""

from dataclasses import replace

import numpy as np
import pytest

from agents.base import Decision
from agents.baselines.random_agent import RandomAgent, RandomConfig
from agents.registry import make_agent
from autopoly_env.operators import STOP
from tests.helpers.solving import simulator


def test_random__depends_on_its_seed_only() -> None:
    game = simulator("blobs")
    plays = [make_agent("random", seed=seed, n_steps=5).solve(game).stats.n_refits for seed in (1, 2, 3, 4, 5, 6)]
    again = [make_agent("random", seed=seed, n_steps=5).solve(game).stats.n_refits for seed in (1, 2, 3, 4, 5, 6)]
    assert plays == again and len(set(plays)) > 1


def test_random__plays_legal_actions_for_so_many_steps() -> None:
    game, agent = simulator("blobs", operators="paper"), RandomAgent(RandomConfig(seed=3, n_steps=6))
    state, played = game.initial(), set()
    for _ in range(6):
        decision = agent.act(game, state)
        assert decision.action in game.legal_actions(state)[1:]
        assert set(decision.policy) == set(game.legal_actions(state)[1:])
        assert sum(decision.policy.values()) == pytest.approx(1.0)
        by_operator = {a.operator: 0.0 for a in decision.policy}
        for action, share in decision.policy.items():
            by_operator[action.operator] += share
        assert np.ptp(list(by_operator.values())) < 1e-12
        played.add(decision.action.operator)
        state = game.transition(state, decision.action)
    assert len(played) > 1
    assert agent.act(game, state) == Decision(STOP)
    assert len({agent.act(game, replace(state, step=step)).action for step in range(6)}) > 1


def test_random__stops_where_it_is_over() -> None:
    game = simulator()
    assert make_agent("random").act(game, game.transition(game.initial(), STOP)) == Decision(STOP)
