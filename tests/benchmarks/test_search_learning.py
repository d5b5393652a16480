"""What learning may add: the oracle follows what it was told, and the table holds each agent to the right other."""

from collections.abc import Iterable
from itertools import pairwise

import pytest

from agents.budget import Budget
from agents.registry import make_agent
from agents.search.evaluator import ResidualEvaluator
from benchmarks.foretold import TREE_ALONE, ForetoldEvaluator, solve_foretold, told
from benchmarks.search_cases import Case, Found, Results
from benchmarks.search_learning import LONG, MODELLER, PAPER, learning_rows
from tests.helpers.solving import simulator

TOTALS = {"mcts": 70.0, "foretold": 75.0, "quads": 80.0, "nfap-prior": 71.0, "nfap-mcts": 69.0, "beam": 74.0}


def known(cases: Iterable[Case]) -> Results:
    """Stands in for measuring: r_all by agent, five more for a long search."""
    return {
        case: Found(TOTALS.get(case.agent, 60.0) + 5.0 * (case.refits == LONG), 0.9, 10, 0, 50, 1.0, "refits")
        for case in cases
    }


def test_foretold__trusts_the_told_step_and_where_there_is_none_the_picture() -> None:
    game = simulator("blobs")
    states = told(game, 60)
    evaluator = ForetoldEvaluator(states)
    for before, after in pairwise(states):
        actions = game.legal_actions(before)[1:]
        prior = evaluator.prior(game, before, actions)
        assert actions[int(prior.argmax())] == after.action
        assert prior.max() > 0.99 and prior.sum() == pytest.approx(1.0)
    other = next(a for a in game.legal_actions(states[0])[1:] if a != states[1].action)
    state = game.transition(game.initial(), other)
    actions = game.legal_actions(state)[1:]
    assert (evaluator.prior(game, state, actions) == ResidualEvaluator().prior(game, state, actions)).all()


@pytest.mark.parametrize("faces", ["any", "quads"])
def test_foretold__finds_with_few_refits_what_long_searches_found(faces: str) -> None:
    rules = {"operators": "full" if faces == "any" else "modeller", "faces": faces}
    found, n_refits = solve_foretold(simulator("L", **rules), Budget(refits=12), {"long": 200})
    longest = make_agent("mcts", **TREE_ALONE).solve(simulator("L", **rules), Budget(refits=200))
    assert found.score.total >= longest.score.total - 1e-9 and n_refits < 30


@pytest.mark.parametrize(("faces", "learners", "whole"), [("any", PAPER, "mcts"), ("quads", MODELLER, "quads")])
def test_learning_rows__hold_each_to_its_plain_one_and_end_with_the_most(
    faces: str, learners: dict[str, object], whole: str
) -> None:
    rows = {row.name: row for row in learning_rows(known, {"set": ["a", "b"]}, 0.3, [50, 100], [], faces)}
    assert len([name for name in rows if name.startswith("set, 100 refits")]) == len(learners) + 1
    oracle = rows["set, 50 refits: oracle prior, tree alone"]
    assert (oracle.ours, oracle.against) == (75.0, 70.0) and oracle.note.startswith("+5.00")
    most = rows[f"set, 50 refits: what {whole} finds in 3,000 refits"]
    assert (most.ours, most.against) == (TOTALS[whole] + 5.0, TOTALS[whole])
