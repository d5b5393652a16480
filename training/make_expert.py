"""The command `python -m training.make_expert`: labelled constructions in shards, for the networks to learn from."""

import json
import sys
import time
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.commands.pulse import Pulse
from agents.commands.running import GOES_ON, run_command
from autopoly_env.errors import ConfigError, RunError
from autopoly_env.files import write_atomically
from autopoly_env.shown import counted
from training.networks.labelling import SourceConfig, build_trajectory
from training.networks.trajectories import VERSION, Shard
from training.options import plain, read_config
from training.parallel import map_tasks, n_cores
from training.telling import duration, show_config_option

SHARD_SIZE = 64  # constructions

HELP = """Label constructions for the networks to learn from, and write them to shards.

\b
Examples:
  python -m training.make_expert runs/expert                               # teacher's labels: about 0.4 s each and core
  python -m training.make_expert runs/held_out --held-out --n 256          # other targets, to measure with
  python -m training.make_expert runs/modeller operators=modeller faces=quads w_sc=[0.1,1.5]   # the modeller's style
  python -m training.make_expert runs/paper source=simulator               # the paper's labels: about 30 ms each
  python -m training.make_expert runs/climbs source=search agent=climb     # what an agent did

What is in shard k depends on the settings and k alone, not on the engine or the number of workers. Shards that are
there are kept: the same command goes on with a run that was stopped, and a larger --n adds to it.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command(help=HELP)
def make(
    folder: Annotated[Path, typer.Argument(help="For the shards; made if it is not there.")],
    overrides: Annotated[list[str] | None, typer.Argument(metavar="KEY=VALUE", help="Options of the source.")] = None,
    config: Annotated[Path | None, typer.Option(help="A YAML file of such options.")] = None,
    n: Annotated[int, typer.Option("--n", min=1, help="Constructions, rounded up to whole shards of 64.")] = 4096,
    held_out: Annotated[bool, typer.Option("--held-out", help="Of targets kept for measuring.")] = False,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes.", show_default="as many as cores")] = None,
    engine: Annotated[str, typer.Option(help="serial, process or ray.")] = "process",
    ray_address: Annotated[str | None, typer.Option(help="Of a Ray cluster.")] = None,
    show_config: Annotated[bool, show_config_option(SourceConfig(), "KEY with its default")] = False,
) -> int:
    source = read_config(config, overrides or [], SourceConfig())
    _claim(folder, {"version": VERSION, "held_out": held_out, "source": plain(source)})
    wanted = range(-(-n // SHARD_SIZE))
    numbers = [k for k in wanted if not _path(folder, k).exists()]
    print(_banner(folder, n, len(numbers), len(wanted), engine, workers), flush=True)
    began, n_failed, n_done = time.perf_counter(), 0, 0
    work = partial(make_shard, source, held_out, folder)
    tasks = map_tasks(work, numbers, engine=engine, n_workers=workers, address=ray_address)
    with Pulse(lambda: f"{n_done} of {len(numbers)} shards, {duration(time.perf_counter() - began)}") as pulse:
        for done in tasks:
            n_done += 1
            left = (time.perf_counter() - began) / n_done * (len(numbers) - n_done)
            outcome = f"{done.value} states" if done.error is None else f"failed: {done.error}"
            pulse.say(f"shard {done.task}: {outcome}; {n_done} of {len(numbers)}, {duration(left)} left")
            n_failed += done.error is not None
    if n_failed:
        raise RunError(f"{n_failed} of {len(numbers)} shards failed; the same command tries them again")
    print(f"{folder}: {counted(len(list(folder.glob('*.npz'))), 'shard')} of {SHARD_SIZE} constructions")
    return 0


def _banner(folder: Path, n: int, n_missing: int, n_shards: int, engine: str, workers: int | None) -> str:
    """What is about to happen."""
    n_made = n_shards * SHARD_SIZE
    why = "" if n == n_made else f" (not {n}: a shard has {SHARD_SIZE}, always the same, so that runs can go on)"
    hands = engine if engine == "serial" else f"{engine}, {counted(workers or n_cores(), 'worker')}"
    known = f", {n_shards - n_missing} of them there already" if n_missing < n_shards else ""
    return f"{folder}: {n_made} constructions{why} in {counted(n_shards, 'shard')}{known}; {hands}"


def make_shard(source: SourceConfig, held_out: bool, folder: Path, number: int) -> int:
    """Make and write one shard; returns how many states it has."""
    numbers = range(number * SHARD_SIZE, (number + 1) * SHARD_SIZE)
    trajectories = [build_trajectory(source, k, held_out) for k in numbers]
    Shard.pack(trajectories).save(_path(folder, number))
    return sum(len(trajectory.states) for trajectory in trajectories)


def _path(folder: Path, number: int) -> Path:
    return folder / f"shard_{number:05d}.npz"


def _claim(folder: Path, meta: dict[str, Any]) -> None:
    """Note in the folder what its shards are. Raises ConfigError if they are something else already."""
    path = folder / "meta.json"
    try:
        known = json.loads(path.read_text(encoding="utf-8"))
        known["source"].setdefault("faces", "any")  # which older shards do not note
    except FileNotFoundError:
        if any(folder.glob("*.npz")):
            raise ConfigError(f"{folder} has shards but no meta.json; give another folder") from None
        write_atomically(path, json.dumps(meta, indent=2) + "\n")
        return
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise ConfigError(f"cannot read {path}; give another folder, or delete this one") from None
    if known != meta:
        raise ConfigError(f"{folder} holds shards made with other settings (meta.json); give another folder")


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_command(
        app,
        arguments,
        "python -m training.make_expert",
        stopped=GOES_ON,
    )


if __name__ == "__main__":
    sys.exit(main())
