"""The work behind `training.evaluate`: every task that has no record yet, on any engine, each recorded as it comes."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from autopoly_env.arguments import is_count
from autopoly_env.errors import ConfigError, OutputError
from autopoly_env.files import write_atomically
from autopoly_env.shown import short
from training.evaluation.display import Display
from training.evaluation.folder import begin, claim
from training.evaluation.suite import GROUND_TRUTH, Suite, takes_seed
from training.evaluation.targets import SuiteTarget
from training.evaluation.tasks import EvalTask, solve_task
from training.parallel import check_engine, map_tasks
from training.records import target_path


@dataclass(frozen=True)
class Machines:
    """Where the work is done, as `map_tasks` takes it."""

    engine: str = "process"
    n_workers: int | None = None
    address: str | None = None


@dataclass(frozen=True)
class TargetShard:
    """Every n-th target, from the number k on, which counts from 1."""

    k: int = 1
    n: int = 1

    @classmethod
    def parse(cls, text: str) -> "TargetShard":
        """The shard "k/n". Raises ConfigError."""
        k, slash, n = text.partition("/")
        if not (slash and is_count(k) and is_count(n) and 1 <= int(k) <= int(n)):
            raise ConfigError(f"--shard {short(text)}: expected k/n with 1 <= k <= n, such as 1/4")
        return cls(int(k), int(n))

    def of(self, targets: Sequence[SuiteTarget]) -> Sequence[SuiteTarget]:
        """Its share of the targets."""
        return targets[self.k - 1 :: self.n]


def run_suite(
    suite: Suite,
    folder: Path,
    machines: Machines,
    *,
    only: set[str],
    shard: TargetShard,
    resume: bool,
    fresh: bool,
    quiet: bool,
) -> None:
    """Do all tasks of a suite (of the labels in `only`, if it has any) that the folder has no outcome of.

    Raises ConfigError for a suite that cannot be run, RunError for a folder that holds another run, OutputError where
    records cannot be written: those before are kept.
    """
    check_engine(machines.engine, machines.n_workers, machines.address)
    suite.check()
    missing = suite.missing()
    targets = suite.targets.targets()
    if not targets:
        raise ConfigError(f"suite {suite.name} has no targets; give it some, such as with --set targets.n=10")
    info, done = claim(folder, suite, [target.name for target in targets], resume=resume, fresh=fresh)
    keys = [(label, t, seed) for t in shard.of(targets) for label, seed in _players(suite, t, missing.keys(), only)]
    waiting = [key for key in keys if (key[0], key[1].name, key[2]) not in done]
    tasks = (EvalTask(label, t, seed, not target_path(folder, t.name).exists()) for label, t, seed in waiting)
    with Display(len(keys), len(keys) - len(waiting), quiet=quiet) as display:
        results = map_tasks(
            partial(solve_task, suite),
            tasks,
            engine=machines.engine,
            n_workers=machines.n_workers,
            address=machines.address,
            on_start=display.begun,
        )
        with closing(results), begin(folder, info, fresh=fresh) as writer:
            for result in results:
                record = result.value.record if result.value else result.task.failed(result.error or "no result")
                if result.value and result.value.picture and not target_path(folder, record.target).exists():
                    try:
                        write_atomically(target_path(folder, record.target), result.value.picture)
                    except OutputError as error:  # one name that the disk will not have is no reason to end the run
                        record = result.task.failed(str(error))
                writer.append(record)
                display.done(result.task, record)


def _players(suite: Suite, target: SuiteTarget, missing: Collection[str], only: set[str]) -> Iterator[tuple[str, int]]:
    """Label and seed of all who try a target; who does not draw tries it once."""
    if target.is_known and (not only or GROUND_TRUTH in only):
        yield GROUND_TRUTH, suite.seeds[0]
    for entry in suite.agents:
        if entry.label not in missing and (not only or entry.label in only):
            for seed in suite.seeds if takes_seed(entry) else suite.seeds[:1]:
                yield entry.label, seed
