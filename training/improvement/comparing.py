"""Is a round's search better than that of the round before? The same tree on held-out targets, at equal refits."""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agents.budget import Budget
from agents.choice.config import ChoicePriorConfig
from agents.choice.evaluator import ChoiceEvaluator
from agents.choice.weights import load_choice
from agents.search.evaluator import Evaluator, ResidualEvaluator
from agents.search.mcts import MctsAgent
from autopoly_env.arguments import at_least
from autopoly_env.errors import OutputError
from autopoly_env.files import write_atomically
from training.improvement.playing import check_mixture, made_target
from training.improvement.plays import Style, simulator_of, target_of
from training.report import Interval, bootstrap_mean


@dataclass(frozen=True)
class CompareConfig:
    """By what rounds are compared."""

    n_targets: int = 48  # held-out ones
    modeller: float = 0.75  # share of them in the modeller's style
    w_sc: tuple[float, float] = (0.1, 1.5)  # price of an element
    refits: int = 100

    def __post_init__(self) -> None:
        at_least(1, n_targets=self.n_targets, refits=self.refits)
        check_mixture(self.modeller, self.w_sc)


def evaluator_of(weights: str) -> Evaluator:
    """That of a file of weights; of none the residual prior."""
    return ChoiceEvaluator(load_choice(weights)) if weights else ResidualEvaluator()


def held_out_total(config: CompareConfig, weights: str, seed: int, number: int) -> float:
    """r_all of the tree alone on the held-out target of this number; no `weights`: with the residual prior."""
    rng = np.random.default_rng((seed, number))
    target = target_of(made_target(number, rng, held_out=True))
    style: Style = "modeller" if rng.random() < config.modeller else "paper"
    w_sc = float(np.exp(rng.uniform(*np.log(config.w_sc))))
    agent = MctsAgent(ChoicePriorConfig(seeds=(), hop_patience=0), (), evaluator_of(weights))
    return agent.solve(simulator_of(target, style, w_sc), Budget(config.refits)).score.total


class Totals:
    """What was reached by round and target: a file of lines, written as they come; half a line counts as none."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.known: dict[tuple[int, int], float] = dict(self._read())
        if path.exists():  # a line that was cut off must not run into the next
            write_atomically(path, "".join(map(self._line, self.known)))

    def add(self, round_: int, number: int, total: float) -> None:
        """Note a total, at once. Raises OutputError."""
        self.known[round_, number] = total
        try:
            with self._path.open("a", encoding="utf-8") as stream:
                stream.write(self._line((round_, number)))
        except OSError as error:
            raise OutputError(f"cannot write {self._path} ({error.strerror})") from None

    def lead(self, round_: int, n_targets: int) -> Interval:
        """The mean lead of a round over the one before it, and its interval over targets."""
        known = [n for n in range(n_targets) if (round_, n) in self.known and (round_ - 1, n) in self.known]
        return bootstrap_mean(np.array([self.known[round_, n] - self.known[round_ - 1, n] for n in known]))

    def mean(self, round_: int) -> float:
        """The mean of a round."""
        totals = [total for (other, _), total in self.known.items() if other == round_]
        return float(np.mean(totals)) if totals else math.nan

    def _line(self, key: tuple[int, int]) -> str:
        return json.dumps({"round": key[0], "target": key[1], "total": self.known[key]}) + "\n"

    def _read(self) -> Iterator[tuple[tuple[int, int], float]]:
        if not self._path.exists():
            return
        for line in self._path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                entry = json.loads(line)
                yield (int(entry["round"]), int(entry["target"])), float(entry["total"])
            except (ValueError, KeyError, TypeError):
                continue
