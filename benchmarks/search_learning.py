"""What networks add to the search, at equal budgets, and the most that they could: the rows of `learning`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from benchmarks.foretold import ONE_BY_ONE, TREE_ALONE
from benchmarks.report import Row
from benchmarks.search_cases import Case, with_options
from benchmarks.search_rows import Complete, against, mean_of, totals_of

LONG = 3000  # refits of a long search of a whole agent
TOLD = 1000  # refits of each of the trees that tell an oracle


@dataclass(frozen=True)
class Learner:
    """Who searches, and whom he is held to."""

    agent: str
    options: dict[str, Any] = field(default_factory=dict)
    plain: str = ""  # name of the other; empty where it is he whom others are held to
    ends_by_itself: bool = False  # and so is asked with the largest budget only
    takes_what_it_needs: bool = False  # the same without any budget


_TREE, _BY_ONE, _TOLD = "mcts, tree alone", "mcts, tree alone, one by one", "oracle prior, tree alone"
_CHOICE = ONE_BY_ONE | {"n_simulations": 8, "exploration": 1.0}  # as `choice-prior` has it
_SAME = "mcts, tree alone, as choice-prior"
_ONE_PASS = TREE_ALONE | {"n_simulations": 1}
_OURS = {
    _TREE: Learner("mcts", TREE_ALONE),
    _BY_ONE: Learner("mcts", ONE_BY_ONE, _TREE),
    _SAME: Learner("mcts", _CHOICE, _TREE),
    _TOLD: Learner("foretold", {"long": TOLD}, _BY_ONE),
    "nfap-prior, tree alone": Learner("nfap-prior", TREE_ALONE, _BY_ONE),
    "choice-prior, tree alone": Learner("choice-prior", TREE_ALONE, _SAME),
    "choice-prior, tree alone, on the plain tree": Learner("choice-prior", TREE_ALONE, _TREE),
    "choice-prior with nfap, tree alone": Learner("choice-prior", TREE_ALONE | {"with_nfap": True}, _SAME),
}
PAPER = _OURS | {
    "nfap-mcts": Learner("nfap-mcts", {}, _TREE, ends_by_itself=True),
    "mcts": Learner("mcts"),
    "nfap-prior": Learner("nfap-prior", {}, "mcts"),
    "choice-prior": Learner("choice-prior", {}, "mcts"),
    "oracle prior, whole agent": Learner("foretold", {"long": TOLD, "whole": True}, "mcts"),
}
MODELLER = _OURS | {
    "beam, as long as it takes": Learner("beam", {"width": 8}, takes_what_it_needs=True, ends_by_itself=True),
    "nfap-prior, tree alone, as choice-prior": Learner("nfap-prior", _CHOICE, _SAME),
    "choice-prior, one pass": Learner("choice-prior", _ONE_PASS, "beam, as long as it takes", ends_by_itself=True),
    "quads": Learner("quads"),
    "choice-prior": Learner("choice-prior", {}, "quads"),
}


def learning_rows(
    complete: Complete,
    sets: dict[str, list[str]],
    w_sc: float,
    refits: Sequence[int],
    seconds: Sequence[float],
    faces: str = "any",
) -> Iterator[Row]:
    """For each set of targets; under a rule of faces in the modeller's style, else in the paper's.

    The last rows of a set are what whole agents find in `LONG` refits: no prior is better than knowing that.
    """
    learners = PAPER if faces == "any" else MODELLER
    budgets: list[dict[str, Any]] = [*({"refits": n} for n in refits), *({"seconds": n} for n in seconds)]
    cases = cases_of(learners, sets, w_sc, budgets, len(refits) - 1, faces)
    whole = "mcts" if faces == "any" else "quads"
    longest = {name: [Case(target, whole, w_sc, refits=LONG, faces=faces) for target in sets[name]] for name in sets}
    results = complete(case for those in (*cases.values(), *longest.values()) for case in those)
    for name in sets:
        for n, budget in enumerate(budgets):
            [(unit, amount)] = budget.items()
            found = {who: totals_of(cases[name, n, who], results) for who in learners if (name, n, who) in cases}
            for who, reached in found.items():
                label, plain = f"{name}, {amount:g} {unit}: {who}", learners[who].plain
                if plain:
                    yield against(label, reached, found[plain])
                else:
                    yield Row(label, mean_of(reached.values()), note=f"mean r_all, {len(reached)} shapes")
            label = f"{name}, {amount:g} {unit}: what {whole} finds in {LONG:,} refits"
            yield against(label, totals_of(longest[name], results), found[whole])


def cases_of(
    learners: dict[str, Learner],
    sets: dict[str, list[str]],
    w_sc: float,
    budgets: Sequence[dict[str, Any]],
    last: int,
    faces: str,
) -> dict[tuple[str, int, str], list[Case]]:
    """By set, number of the budget and learner; `last`: the budget of those that end by themselves."""
    return {
        (name, n, who): [
            with_options(
                Case(target, learner.agent, w_sc, faces=faces, **({} if learner.takes_what_it_needs else budgets[n])),
                **learner.options,
            )
            for target in sets[name]
        ]
        for name in sets
        for n in range(len(budgets))
        for who, learner in learners.items()
        if n == last or not learner.ends_by_itself
    }
