"""How good trained policies are, and how fast training is: `python -m benchmarks.rl COMMAND`."""

import json
import os
import platform
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from agents.budget import Budget, Meter
from agents.commands.running import FAILURE, run_command
from agents.finish import finish
from agents.registry import make_agent
from agents.rl.player import Player
from agents.rl.weights import load_policy, read_policy_meta
from agents.solution import Track
from autopoly_env.arrays import FloatArray
from autopoly_env.errors import ConfigError
from autopoly_env.files import write_atomically
from autopoly_env.score import ScoreWeights
from autopoly_env.simulator import Simulator
from benchmarks.rl_curves import draw_learning, learning_curves
from benchmarks.search_cases import RESOLUTION, made, target_of
from training.parallel import map_tasks
from training.report import Interval, bootstrap_mean

PRICES = {"construction": 1.0, "objects": 0.3}  # w_sc of each kind of target, as the environments have it
N_RANDOM = 20  # random plays, the best of which counts
N_PLAYS = 16  # sampled plays of a policy, the best of which counts
RECTANGLE, GREEDY, RANDOM = "rectangle, refitted", "greedy", f"random, best of {N_RANDOM}"
ONE_PASS, PARED = "one pass", "one pass, pared"
BEST, EQUAL = f"best of {N_PLAYS}", "best at the refits of random"
PLAYS = (ONE_PASS, PARED, BEST, EQUAL)  # of a policy
_FILE_WIDTH = 150

HELP = """Measure trained policies on unseen targets, and the speed of training.

\b
Examples:
  python -m benchmarks.rl figures runs/a/policy.safetensors runs/b/policy.safetensors
  python -m benchmarks.rl figures runs/a/policy.safetensors --n 20 --workers 2 --play "one pass" --play "best of 16"
  python -m benchmarks.rl throughput runs/maskable_ppo
  python -m benchmarks.rl curves "from nothing=runs/a,runs/b" "cloned=runs/c" --picture docs/pictures/learning.svg

\b
Several policies of figures are seeds of one training: each target's r_all is the mean over them.
Results are kept in RECORDS, a line for each policy and target; a run that was stopped goes on.
"""

app = typer.Typer(help=HELP, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@dataclass(frozen=True)
class Case:
    """What is to be built, and by whom."""

    target: str  # "construction:INDEX" or "objects:INDEX", of the split "test"
    method: str
    weights: str = ""  # file of the policy
    sha256: str = ""  # of the weights
    refits: int | None = None  # budget


@dataclass(frozen=True)
class Found:
    """What came of it, scored at the target's own resolution."""

    r_all: float
    iou: float
    complexity: int
    self_intersections: int
    n_refits: int
    n_steps: int


def measure(case: Case) -> Found:
    """Build one target."""
    kind = case.target.partition(":")[0]
    weights = ScoreWeights(w_sc=PRICES[kind])
    simulator = Simulator(target_of(case.target), operators="full", resolution=RESOLUTION, weights=weights)
    track, meter = _METHODS[case.method](simulator, case)
    if track is None:
        solution = make_agent("greedy").solve(simulator, Budget())
    else:
        solution = finish(simulator, track.states(), meter, keep_steps=case.method != PARED)
    score, n_refits, n_steps = solution.score, solution.stats.n_refits, len(solution.sequence.steps)
    return Found(score.total, score.iou, score.complexity, score.self_intersections, n_refits, n_steps)


_Played = tuple[Track | None, Meter]


def _rectangle(simulator: Simulator, _case: Case) -> _Played:
    meter = Meter(Budget())
    start = Track(simulator.initial())
    meter.add([start.state])
    return start, meter


def _greedy(_simulator: Simulator, _case: Case) -> _Played:
    return None, Meter(Budget())


def _random(simulator: Simulator, _case: Case) -> _Played:
    start, meter = _rectangle(simulator, _case)
    assert start is not None
    best = start
    for seed in range(N_RANDOM):
        agent, track = make_agent("random", seed=seed), start
        while not track.state.done:
            state = simulator.transition(track.state, agent.act(simulator, track.state).action)
            meter.add([state])
            track = Track(state, track)
            best = max(best, track, key=_total)
    return best, meter


def _plays(n: int | None) -> Callable[[Simulator, Case], _Played]:
    """The best of n plays, the first of which is not sampled; as many as the case's refits allow if n is None."""

    def played(simulator: Simulator, case: Case) -> _Played:
        player, meter = _player(case.weights), Meter(Budget(case.refits))
        start = Track(simulator.initial())
        meter.add([start.state])
        best, number = start, 0
        while not meter.spent() and (n is None or number < n):
            rng = np.random.default_rng((0, number)) if number else None
            steps = list(player.play(simulator, start, meter, rng))
            best = max([best, *steps], key=_total)
            number += 1
            if not steps and n is None:
                meter.add_refits(1)  # so that a policy that always stops comes to an end
        return best, meter

    return played


_METHODS: dict[str, Callable[[Simulator, Case], _Played]] = {
    RECTANGLE: _rectangle,
    GREEDY: _greedy,
    RANDOM: _random,
    ONE_PASS: _plays(1),
    PARED: _plays(1),
    BEST: _plays(N_PLAYS),
    EQUAL: _plays(None),
}


def _total(track: Track) -> float:
    return track.state.score.total


@cache
def _player(weights: str) -> Player:
    import torch

    torch.set_num_threads(1)
    return Player(load_policy(Path(weights))[0])


# --- records ---


class Records:
    """A file of results, a line of JSON each; a line that is none, such as one that was cut off, is left out."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.results: dict[Case, Found] = {}
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        for line in lines:
            try:
                record = json.loads(line)
                self.results[Case(**record["case"])] = Found(**record["found"])
            except (ValueError, TypeError, KeyError):
                continue
        if lines:
            write_atomically(path, "".join(f"{_line(case, found)}\n" for case, found in self.results.items()))

    def complete(self, cases: Iterable[Case], n_workers: int, tell: Callable[[str], None]) -> bool:
        """Measure the cases that are missing; whether all went well."""
        missing = [case for case in dict.fromkeys(cases) if case not in self.results]
        engine, workers = ("serial", None) if n_workers == 1 else ("process", n_workers)
        failed = 0
        for number, done in enumerate(map_tasks(measure, missing, engine=engine, n_workers=workers), 1):
            if done.value is None:
                failed += 1
                tell(f"{done.task.method} on {done.task.target}: {done.error}")
                continue
            self.results[done.task] = done.value
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("a", encoding="utf-8") as stream:
                stream.write(_line(done.task, done.value) + "\n")
            if number % 50 == 0 or number == len(missing):
                tell(f"{number} of {len(missing)}")
        return not failed


def _line(case: Case, found: Found) -> str:
    return json.dumps({"case": asdict(case), "found": asdict(found)})


# --- figures ---


@dataclass(frozen=True)
class Row:
    """A method on the targets of a kind."""

    kind: str
    method: str
    r_all: Interval
    iou: float
    complexity: float
    refits: float
    gap: Interval | None  # share of the way from the rectangle to greedy
    gaps: list[float]  # that of each policy, in their order
    above_greedy: Interval | None


_ByTarget = dict[str, list[float]]  # what is shown, by target


def rows_of(results: dict[Case, Found], cases: Sequence[Case]) -> list[Row]:
    """The table; several policies' results on a target are averaged."""
    rows = []
    for kind in dict.fromkeys(case.target.partition(":")[0] for case in cases):
        mine = [case for case in cases if case.target.startswith(f"{kind}:")]
        values = {method: _means(results, mine, method) for method in dict.fromkeys(case.method for case in mine)}
        common = sorted(set.intersection(*(set(by_target) for by_target in values.values())))
        if not common:
            continue
        arrays = {method: np.array([found[target] for target in common]) for method, found in values.items()}
        low, high = arrays[RECTANGLE][:, 0], arrays[GREEDY][:, 0]
        for method, array in arrays.items():
            total, iou, complexity, refits = array.T
            ends = method in (RECTANGLE, GREEDY)
            rows.append(
                Row(
                    kind,
                    method,
                    bootstrap_mean(total),
                    float(iou.mean()),
                    float(complexity.mean()),
                    float(refits.mean()),
                    None if ends else _share(total, low, high),
                    _gaps(results, mine, method, values[RECTANGLE], values[GREEDY]),
                    None if ends else bootstrap_mean(total - high),
                )
            )
    return rows


def _gaps(
    results: dict[Case, Found], cases: Sequence[Case], method: str, low: _ByTarget, high: _ByTarget
) -> list[float]:
    """The share of the gap of each policy, over the targets that it was measured on."""
    gaps = []
    for weights in dict.fromkeys(case.weights for case in cases if case.weights and case.method == method):
        found = _means(results, [case for case in cases if case.weights == weights], method)
        rows = np.array([(found[t][0], low[t][0], high[t][0]) for t in found if t in low and t in high])
        if len(rows):
            gaps.append(float(_share_of_gap(*rows.mean(0))))
    return gaps


def _means(results: dict[Case, Found], cases: Sequence[Case], method: str) -> _ByTarget:
    """By target: means over the policies of r_all, IoU, complexity and refits."""
    found: dict[str, list[Found]] = {}
    for case in cases:
        if case.method == method and case in results:
            found.setdefault(case.target, []).append(results[case])
    return {
        target: [float(np.mean([getattr(one, name) for one in many])) for name in _SHOWN]
        for target, many in found.items()
    }


_SHOWN = ("r_all", "iou", "complexity", "n_refits")


def _share(total: FloatArray, low: FloatArray, high: FloatArray) -> Interval:
    """Mean (total - low) over mean (high - low), with the bootstrap's interval: targets are drawn, not their shares."""
    rng = np.random.default_rng(0)
    draws = rng.integers(len(total), size=(2000, len(total)))
    shares = _share_of_gap(total[draws].mean(1), low[draws].mean(1), high[draws].mean(1))
    share = _share_of_gap(total.mean(), low.mean(), high.mean())
    return Interval(float(share), *(float(end) for end in np.quantile(shares, (0.025, 0.975))))


def _share_of_gap(total: Any, low: Any, high: Any) -> Any:
    return (total - low) / (high - low)


def cases_of(
    policies: Sequence[Path], n: int, results: dict[Case, Found], plays: Collection[str] = PLAYS
) -> Iterator[list[Case]]:
    """What is to be measured: first what needs nothing else, then what gets the refits that random took."""
    targets = [target for kind in PRICES for target in made(kind, n)]
    plain = [Case(target, method) for method in (RECTANGLE, GREEDY, RANDOM) for target in targets]
    hashes = {str(path): read_policy_meta(path).sha256 for path in policies}
    methods = [play for play in PLAYS if play in plays and play != EQUAL]
    first = [*plain, *(Case(t, m, p, h) for p, h in hashes.items() for m in methods for t in targets)]
    yield first
    if EQUAL not in plays:
        return
    spent = {t: results[Case(t, RANDOM)].n_refits for t in targets if Case(t, RANDOM) in results}
    yield [*first, *(Case(t, EQUAL, p, h, spent[t]) for p, h in hashes.items() for t in targets if t in spent)]


@app.command()
def figures(
    policies: Annotated[list[Path], typer.Argument(metavar="POLICY", help=".safetensors, one for each seed.")],
    n: Annotated[int, typer.Option("--n", min=1, help="Targets of each kind.")] = 200,
    play: Annotated[
        list[str] | None, typer.Option(help="How the policies play; may be given again.", show_default="all ways")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    records: Annotated[Path, typer.Option(help="File of results.")] = Path("out/rl/figures.jsonl"),
    as_json: Annotated[bool, typer.Option("--json", help="Rows as JSON, and no table.")] = False,
) -> int:
    """r_all on unseen targets: the rectangle, greedy, random, and the policies, played in several ways."""
    console, plays = _console(), play or PLAYS
    unknown = set(plays) - set(PLAYS)
    if unknown:
        raise ConfigError(f"--play {min(unknown)!r}: expected one of {', '.join(map(repr, PLAYS))}")
    known, well, cases = Records(records), True, []
    for cases in cases_of(policies, n, known.results, plays):
        well &= known.complete(cases, workers, lambda text: print(text, file=sys.stderr, flush=True))
    rows = rows_of(known.results, cases)
    if as_json:
        for row in rows:
            print(json.dumps(asdict(row)))
    else:
        title = f"mean r_all and 95 % interval, {n} targets of each kind, {len(policies)} seeds"
        table = Table(
            *("targets", "method", "r_all", "IoU", "V+E+F", "refits", "share of the gap", "of each", "above greedy"),
            title=title,
        )
        for row in rows:
            table.add_row(
                f"{row.kind}, w_sc {PRICES[row.kind]:g}",
                row.method,
                _shown(row.r_all, ".1f"),
                f"{row.iou:.3f}",
                f"{row.complexity:.1f}",
                f"{row.refits:.0f}",
                "" if row.gap is None else _shown(row.gap, ".0%"),
                " ".join(f"{100.0 * share:.0f}" for share in row.gaps),
                "" if row.above_greedy is None else _shown(row.above_greedy, "+.2f"),
            )
        console.print(table)
        console.print(_machine(), highlight=False)
    return 0 if well else FAILURE


@app.command()
def throughput(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN", help="Folders of training.train_rl.")],
) -> int:
    """Steps a second of whole trainings, and where their time went: environments, inference, updates."""
    table = Table("run", "steps/s", "env", "inference", "update", "steps", "minutes")
    for run in runs:
        lines = [line for line in _log(run) if "train/steps_per_second" in line]
        if not lines:
            raise ConfigError(f"{run}: no lines of a training in log.jsonl; give a folder of training.train_rl")
        last = lines[-1]
        shares = [np.median([line.get(f"train/share_{part}", np.nan) for line in lines]) for part in _PARTS]
        speed = last["step"] / max(60.0 * last["train/minutes"], 1e-9)
        table.add_row(
            str(run),
            f"{speed:.0f}",
            *(f"{share:.0%}" for share in shares),
            f"{last['step']:.0f}",
            f"{last['train/minutes']:.1f}",
        )
    _console().print(table)
    _console().print(_machine(), highlight=False)
    return 0


_PARTS = ("env", "inference", "update")


@app.command()
def curves(
    groups: Annotated[
        list[str], typer.Argument(metavar="NAME=RUN,RUN,...", help="Runs that differ by the seed alone.")
    ],
    picture: Annotated[Path, typer.Option(help="An SVG.")] = Path("docs/pictures/learning.svg"),
) -> int:
    """Draw r_all of unseen targets against minutes of training: median and range over the seeds."""
    named: dict[str, list[list[dict[str, float]]]] = {}
    for group in groups:
        name, equals, folders = group.partition("=")
        if not (name and equals and folders):
            raise ConfigError(f"{group}: expected NAME=RUN,RUN, such as cloned=runs/a,runs/b")
        named[name] = [[line for line in _log(Path(folder)) if "eval/final" in line] for folder in folders.split(",")]
    path = write_atomically(picture, draw_learning(learning_curves(named)))
    print(f"Open {path}")
    return 0


def _log(run: Path) -> list[dict[str, Any]]:
    try:
        lines = (run / "log.jsonl").read_text(encoding="utf-8").splitlines()
        return [_renamed(json.loads(line)) for line in lines]
    except (OSError, ValueError):
        raise ConfigError(f"cannot read {run / 'log.jsonl'}; give a folder of training.train_rl") from None


def _renamed(line: dict[str, Any]) -> dict[str, Any]:
    """A line of a log, whose evaluations older runs call exams."""
    return {f"eval/{key.removeprefix('exam/')}" if key.startswith("exam/") else key: line[key] for key in line}


def _shown(interval: Interval, form: str) -> str:
    mean, low, high = (format(value, form) for value in interval)
    return f"{mean} ({low} to {high})"


def _console() -> Console:
    return Console() if sys.stdout.isatty() else Console(width=_FILE_WIDTH)


def _machine() -> str:
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{platform.machine()}, {os.cpu_count()} cores{load}; Python {platform.python_version()}"


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_command(
        app, arguments, "python -m benchmarks.rl", stopped="stopped by Ctrl-C; what was measured is kept"
    )


if __name__ == "__main__":
    sys.exit(main())
