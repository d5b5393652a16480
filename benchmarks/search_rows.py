"""What each search benchmark measures, and the rows of its table. Differences are shape by shape, so that a hard shape
that is hard for all does not count; intervals are bootstrapped over shapes (95 %)."""

import contextlib
import json
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict
from types import ModuleType
from typing import Any

import numpy as np

from agents.budget import Budget
from agents.registry import AGENTS, make_agent
from agents.search.config import MctsConfig
from autopoly_env.arrays import FloatArray
from autopoly_env.compute import set_threads
from autopoly_env.refit import refit_kernels, tuning
from benchmarks.report import Must, Row, not_measured
from benchmarks.search_cases import Case, Results, made, measure, simulator_of, with_options
from training.report import Interval, bootstrap_mean

WEIGHTS = (0.3, 1.0)  # w_sc
BUDGETS = (50, 100, 200, 400, 1000, 5000)  # refits
RACERS = ("mcts_paper", "mcts", "greedy", "beam", "random")
END_BY_THEMSELVES = ("greedy", "beam")  # and then find the same with any larger budget
RIVALS = ("greedy", "beam", "trace", "decimate")
LOWER = 0.1  # r_all by which a shape counts as lost
OUTSIDE_REFITS = Must("<=", 0.25)
NONE_LOST = Must("<=", 0.0)
VARIANTS: dict[str, tuple[Any, ...]] = {
    "formula": ("puct", "uct"),
    "exploration": (0.02, 0.2, 1.0),
    "backup": ("max", "mean"),
    "prior": ("residual", "uniform"),
    "n_expanded": (1, 4, 16),
    "widening": (0.5, 1.0),
    "halving": (False, True),
    "reuse_tree": (True, False),
    "merge": (True, False),
    "seeds": ((), ("trace",), ("climb",), ("trace", "climb", "decimate", "quads")),
    "hop_patience": (0, 60, 1000),
}

Complete = Callable[[Iterable[Case]], Results]  # gets results for cases; those that failed are left out
OnDone = Callable[[Case, str], None]  # told of each case that is over, and what was wrong with it
Totals = dict[tuple[str, float, int], Interval]  # (agent, w_sc, refits) -> mean r_all


def gap_rows(
    complete: Complete, oracle: Complete, limit: int, refits: int, width: int, faces: str = "any"
) -> Iterator[Row]:
    """How far `mcts`, under a rule of faces `quads`, stays below the oracle on constructions, w_sc 1."""
    agent, targets = "mcts" if faces == "any" else "quads", made("construction", limit)
    best = [with_options(Case(target, "oracle", 1.0, faces=faces), width=width) for target in targets]
    ours = [Case(target, agent, 1.0, refits=refits, faces=faces) for target in targets]
    reached, found = totals_of(best, oracle(best)), totals_of(ours, complete(ours))
    both = [target for target in found if target in reached]
    if not both:
        yield not_measured("gap", "there is no shape that both have solved")
        return
    gaps = np.array([reached[target] - found[target] for target in both])
    mean = bootstrap_mean(gaps)
    first, second = (mean_of(totals[target] for target in both) for totals in (found, reached))
    yield Row(f"{agent}, {refits} refits: mean r_all", first, second, note=f"against the oracle of width {width}")
    yield Row("mean gap to the oracle", mean.mean, note=_interval(mean, len(both)))
    worst = both[int(gaps.argmax())]
    yield Row("largest gap", float(gaps.max()), note=worst)
    yield Row("shapes at most 0.1 below", float((gaps <= LOWER).mean()), note="share of all")


def anytime_results(complete: Complete, targets: Sequence[str], budgets: Sequence[int]) -> Totals:
    """Mean r_all of every agent at each budget of refits, both weights."""
    known: dict[tuple[str, float, str], dict[int, float]] = {}
    settled: set[tuple[str, float, str]] = set()
    for refits in sorted(budgets):
        keys = [(agent, w_sc, target) for w_sc in WEIGHTS for agent in RACERS for target in targets]
        cases = {key: Case(key[2], key[0], key[1], refits=refits) for key in keys if key not in settled}
        results = complete(cases.values())
        for key in keys:
            curve = known.setdefault(key, {})
            if key in settled:
                curve[refits] = list(curve.values())[-1]
            elif cases[key] in results:
                curve[refits] = results[cases[key]].total
                if key[0] in END_BY_THEMSELVES and results[cases[key]].stopped_by == "finished":
                    settled.add(key)
    totals = {}
    for w_sc in WEIGHTS:
        for agent in RACERS:
            for refits in sorted(budgets):
                curves = [known[agent, w_sc, target] for target in targets]
                values = np.array([curve[refits] for curve in curves if refits in curve])
                totals[agent, w_sc, refits] = bootstrap_mean(values)
    return totals


def anytime_rows(totals: Totals, n_targets: int) -> Iterator[Row]:
    """A row for each point of the curves."""
    for (agent, w_sc, refits), mean in totals.items():
        yield Row(f"w_sc {w_sc:g}: {agent}, {refits} refits", mean.mean, note=_interval(mean, n_targets))


def ablation_rows(complete: Complete, targets: Sequence[str], refits: int) -> Iterator[Row]:
    """`mcts` with one option changed at a time, against its default, at equal refits."""
    variants = [(name, value) for name, values in VARIANTS.items() for value in values if not _is_default(name, value)]
    plain = {w_sc: [Case(target, "mcts", w_sc, refits=refits) for target in targets] for w_sc in WEIGHTS}
    changed = {
        (w_sc, *variant): [with_options(case, **dict([variant])) for case in plain[w_sc]]
        for w_sc in WEIGHTS
        for variant in variants
    }
    results = complete(case for cases in (*plain.values(), *changed.values()) for case in cases)
    for w_sc in WEIGHTS:
        usual = totals_of(plain[w_sc], results)
        yield Row(f"w_sc {w_sc:g}: default", mean_of(usual.values()), note=f"mean r_all, {len(usual)} shapes")
        for name, value in variants:
            totals = totals_of(changed[w_sc, name, value], results)
            yield against(f"w_sc {w_sc:g}: {name} {_shown(value)}", totals, usual)


def overhead_rows(targets: Sequence[str], refits: int) -> Iterator[Row]:
    """The share of a solve that is not spent in refits, on one thread: the tree, priors, placement, scores, the end."""
    set_threads(1)
    try:
        measure(Case(targets[0], "mcts", WEIGHTS[0], refits=30))  # warm up
        for part, options in (("whole solve", {}), ("tree alone", {"seeds": [], "hop_patience": 0})):
            for w_sc in WEIGHTS:
                cases = [with_options(Case(target, "mcts", w_sc, refits=refits), **options) for target in targets]
                whole, refitting, tuned = np.sum([_solve_timed(case) for case in cases], axis=0)
                note = f"{whole:.1f} s in all, {refits} refits a shape; tuning of finished meshes {tuned / whole:.1%}"
                share = float(1.0 - refitting / whole)
                yield Row(f"w_sc {w_sc:g}, {part}: outside refits", share, must=OUTSIDE_REFITS, note=note)
    finally:
        set_threads(None)


def dominance_rows(complete: Complete, targets: Sequence[str], seconds: float) -> Iterator[Row]:
    """`mcts` with some seconds a shape against agents that end by themselves: each shape where it is clearly lower."""
    cases = {
        (agent, w_sc): [Case(t, agent, w_sc, seconds=seconds if agent == "mcts" else None) for t in targets]
        for w_sc in WEIGHTS
        for agent in ("mcts", *RIVALS)
    }
    results = complete(case for those in cases.values() for case in those)
    n_lost = 0
    for w_sc in WEIGHTS:
        found = totals_of(cases["mcts", w_sc], results)
        for rival in RIVALS:
            theirs = totals_of(cases[rival, w_sc], results)
            yield against(f"w_sc {w_sc:g}: mcts against {rival}", found, theirs)
            for target in found:
                if target in theirs and found[target] < theirs[target] - LOWER:
                    n_lost += 1
                    yield Row(f"  lower on {target}", found[target], theirs[target])
    yield Row(f"shapes lower by more than {LOWER:g}", float(n_lost), must=NONE_LOST, note="of all the above")


def totals_of(cases: Sequence[Case], results: Results) -> dict[str, float]:
    """r_all by target."""
    return {case.target: results[case].total for case in cases if case in results}


def against(name: str, ours: dict[str, float], others: dict[str, float]) -> Row:
    """Both means over the shapes that both have, and the interval of their difference."""
    both = [target for target in ours if target in others]
    if not both:
        return not_measured(name, "there is no shape that both have solved")
    lead = bootstrap_mean(np.array([ours[target] - others[target] for target in both]))
    first, second = (mean_of(totals[target] for target in both) for totals in (ours, others))
    return Row(name, first, second, note=f"{lead.mean:+.2f}, 95 %: {lead.low:+.2f} to {lead.high:+.2f}")


def mean_of(values: Iterable[float]) -> float:
    numbers: FloatArray = np.fromiter(values, np.float64)
    return float(numbers.mean()) if numbers.size else float("nan")


def _interval(mean: Interval, n: int) -> str:
    return f"95 %: {mean.low:.2f} to {mean.high:.2f}, {n} shape{'' if n == 1 else 's'}"


def _is_default(name: str, value: Any) -> bool:
    default = AGENTS["mcts"].default
    assert isinstance(default, MctsConfig)
    return bool(asdict(default)[name] == value)


def _shown(value: Any) -> str:
    return (", ".join(value) or "none") if isinstance(value, tuple) else str(value)


def _solve_timed(case: Case) -> tuple[float, float, float]:
    """Seconds of a solve, of its refits, and of the tuning of finished meshes."""
    simulator, agent = simulator_of(case), make_agent(case.agent, **json.loads(case.options))
    with _clock(refit_kernels, "refit") as refitting, _clock(tuning, "tune_in_place") as tuned:
        began = time.perf_counter()
        solution = agent.solve(simulator, Budget(case.refits, case.seconds))
        whole = time.perf_counter() - began
    if solution.stats.stopped_by == "interrupted":
        raise KeyboardInterrupt
    return whole, sum(refitting), sum(tuned)


@contextlib.contextmanager
def _clock(module: ModuleType, name: str) -> Iterator[list[float]]:
    """The seconds of each call, within the block, of a function that is looked up in its module when it is called."""
    function, seconds = getattr(module, name), []

    def timed(*arguments: Any) -> Any:
        began = time.perf_counter()
        try:
            return function(*arguments)
        finally:
            seconds.append(time.perf_counter() - began)

    setattr(module, name, timed)
    try:
        yield seconds
    finally:
        setattr(module, name, function)
