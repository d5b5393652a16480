"""Expert iteration, round by round: play, learn, compare; whatever is done is on disk at once, and not done again."""

import json
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeVar

from agents.choice.config import ChoiceConfig
from agents.choice.weights import load_choice, save_choice
from agents.commands.pulse import Pulse
from autopoly_env.arguments import at_least
from autopoly_env.errors import RunError
from autopoly_env.files import write_atomically
from training.improvement.comparing import CompareConfig, Totals, evaluator_of, held_out_total
from training.improvement.learning import LearnConfig, learn
from training.improvement.lessons import LabelConfig, Lesson, lessons_of
from training.improvement.playing import PlayConfig, play
from training.improvement.plays import Play
from training.options import plain
from training.parallel import Done, map_tasks
from training.report import Interval
from training.telling import duration, table_of

_Task = TypeVar("_Task")


@dataclass(frozen=True)
class RoundsConfig:
    """How many rounds, and how they are drawn."""

    n_rounds: int = 3  # at most: it ends with the first that gains nothing
    seed: int = 0

    def __post_init__(self) -> None:
        at_least(1, n_rounds=self.n_rounds)
        at_least(0, seed=self.seed)


@dataclass(frozen=True)
class ImproveConfig:
    """Everything that can be set."""

    net: ChoiceConfig = field(default_factory=ChoiceConfig)
    play: PlayConfig = field(default_factory=PlayConfig)
    labels: LabelConfig = field(default_factory=LabelConfig)
    learn: LearnConfig = field(default_factory=LearnConfig)
    compare: CompareConfig = field(default_factory=CompareConfig)
    run: RoundsConfig = field(default_factory=RoundsConfig)


@dataclass(frozen=True)
class Workers:
    """On which machines, see `map_tasks`."""

    engine: str = "process"
    n_workers: int | None = None
    address: str | None = None


def improve(config: ImproveConfig, folder: Path, workers: Workers) -> Path:
    """Play rounds until one gains nothing, or go on with what `folder` holds; the best round's weights.

    Raises RunError where plays failed or are damaged, or the loss is not a number: the same command goes on.
    """
    rounds = _Rounds(config, folder, workers)
    best = 0
    rounds.compare(0)
    for number in range(1, config.run.n_rounds + 1):
        rounds.play(number)
        rounds.learn(number)
        lead = rounds.compare(number)
        if not lead.mean > 0.0:
            print(f"round {number} gains nothing: it ends here, with round {best}", flush=True)
            break
        best = number
    if not best:
        raise RunError(f"{folder}: the first round gained nothing; give it more plays (play.n_first)")
    return rounds.kept(best)


class _Rounds:
    """The steps of a run in a folder."""

    def __init__(self, config: ImproveConfig, folder: Path, workers: Workers) -> None:
        self._config, self._folder, self._workers = config, folder, workers
        self._totals = Totals(folder / "compared.jsonl")
        self._lessons: dict[int, list[Lesson]] = {}

    def play(self, number: int) -> None:
        """Play what is missing of a round with the weights of the one before; each play is a file once it is over."""
        config = self._config
        paths = {k: self._play_path(number, k) for k in range(config.play.n_of(number))}
        missing = [k for k, path in paths.items() if not path.exists()]
        work = partial(_played, config.play, config.run.seed, number, self._weights(number - 1), self._folder)
        self._mapped(work, missing, f"round {number}, plays", lambda done: None)

    def learn(self, number: int) -> None:
        """Train on all plays so far, unless it has been done."""
        path = self._path(number)
        if path.with_suffix(".json").exists():
            load_choice(path)
            return
        lessons = [lesson for k in range(1, number + 1) for lesson in self._lessons_of(k)]
        stands = "its lessons"
        config, began = self._config, time.perf_counter()

        def report(step: int, loss: float) -> None:
            nonlocal stands
            stands = f"step {step} of {config.learn.n_steps}, loss {loss:.3g}"

        with Pulse(lambda: f"round {number} learns: {stands}") as pulse:
            tensors, metrics = learn(lessons, config.net, config.learn, config.run.seed, report)
            seconds = time.perf_counter() - began
            pulse.say(f"round {number} has learnt from {len(lessons)} states in {duration(seconds)}; on others:")
            pulse.say(table_of(metrics))
        settings = plain(config) | {"round": number}
        save_choice(path, config.net, tensors, settings, metrics)

    def compare(self, number: int) -> Interval:
        """What the round gains on the one before it, on held-out targets; round 0 is the search without a network."""
        config, known = self._config.compare, self._totals.known
        missing = [k for k in range(config.n_targets) if (number, k) not in known]
        work = partial(held_out_total, config, self._weights(number), self._config.run.seed)
        self._mapped(work, missing, f"round {number}, held-out targets", partial(self._note, number))
        lead = self._totals.lead(number, config.n_targets)
        said = f"round {number}: mean r_all {self._totals.mean(number):.2f} on {config.n_targets} held-out targets"
        if number:
            said += f", {lead.mean:+.2f} (95 %: {lead.low:+.2f} to {lead.high:+.2f}) on the round before"
        print(said, flush=True)
        return lead

    def kept(self, best: int) -> Path:
        """Copy a round's weights to choice.safetensors, with what all rounds reached."""
        weights = load_choice(self._path(best))
        meta = json.loads(self._path(best).with_suffix(".json").read_text(encoding="utf-8"))
        n_targets = self._config.compare.n_targets
        rounds = {
            f"round {k}": {"mean": self._totals.mean(k), "lead": list(self._totals.lead(k, n_targets)) if k else None}
            for k in sorted({number for number, _ in self._totals.known})
        }
        write_atomically(self._folder / "report.json", json.dumps({"best": best, "rounds": rounds}, indent=2) + "\n")
        path = self._folder / "choice.safetensors"
        training = meta["training"] | {"rounds": rounds}
        return save_choice(path, weights.config, weights.tensors, training, meta["metrics"])

    def _note(self, number: int, done: Done[int, float]) -> None:
        if done.value is not None:
            self._totals.add(number, done.task, done.value)

    def _lessons_of(self, number: int) -> list[Lesson]:
        """All that a round's plays teach. Raises RunError, which names the file, for one that is torn or illegal."""
        if number not in self._lessons:
            paths = [self._play_path(number, k) for k in range(self._config.play.n_of(number))]
            made = [lessons_of(Play.load(path), self._config.net, self._config.labels) for path in paths]
            self._lessons[number] = [lesson for some in made for lesson in some]
        return self._lessons[number]

    def _mapped(
        self, work: Callable[[int], _Task], numbers: Iterable[int], what: str, note: Callable[[Done[int, _Task]], None]
    ) -> None:
        """Apply `work` to all numbers. Raises RunError where some failed, once the others are done."""
        numbers, began, n_done, failed = list(numbers), time.perf_counter(), 0, list[str]()
        engine = self._workers
        tasks = map_tasks(work, numbers, engine=engine.engine, n_workers=engine.n_workers, address=engine.address)
        with Pulse(lambda: f"{what}: {n_done} of {len(numbers)}, {duration(time.perf_counter() - began)}") as pulse:
            for done in tasks:
                n_done += 1
                note(done)
                if done.error is not None:
                    failed.append(done.error)
                    pulse.say(f"{what}: number {done.task} failed: {done.error}")
            if n_done:
                pulse.say(f"{what}: {n_done - len(failed)} in {duration(time.perf_counter() - began)}")
        if failed:
            raise RunError(f"{what}: {len(failed)} of {len(numbers)} failed; the same command tries them again")

    def _weights(self, number: int) -> str:
        return str(self._path(number)) if number else ""

    def _path(self, number: int) -> Path:
        return self._folder / f"round_{number}.safetensors"

    def _play_path(self, number: int, k: int) -> Path:
        return _play_path(self._folder, number, k)


def _play_path(folder: Path, number: int, k: int) -> Path:
    return folder / "plays" / f"round_{number}" / f"{k:05d}.json"


def _played(config: PlayConfig, seed: int, number: int, weights: str, folder: Path, k: int) -> None:
    """Play number k of a round, and write it."""
    evaluator = evaluator_of(weights) if weights else None
    play(config, seed, number, k, evaluator).save(_play_path(folder, number, k))
