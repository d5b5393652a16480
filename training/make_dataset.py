"""The command `python -m training.make_dataset`: targets by the thousand, on disk, for training and tests."""

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.commands.progress import TASK, progress_bar
from agents.commands.running import FAILURE, TOLD, run_command
from agents.commands.screen import say
from autopoly_env.arguments import is_count
from autopoly_env.errors import ConfigError

HELP = """Make data sets of targets, check them, draw silhouettes of 3-D models.

\b
Examples:
  python -m training.make_dataset constructions --n 100000 --out data/train
  python -m training.make_dataset constructions --n 1000 --split validation --difficulty 3-5 --out data/validation
  python -m training.make_dataset objects --n 5000 --resolution 256 --out data/objects
  python -m training.make_dataset minari --n 100 --agent mcts --name autopoly/mcts-v0 --out data/minari
  python -m training.make_dataset verify data/train
  python -m training.make_dataset silhouettes chair.obj lamp.glb --view front --out data/models
  python -m training.make_dataset silhouettes ShapeNetCore.v2 --categories chair,lamp --split test --out data/shapenet

What was killed goes on with --resume. Target number i depends on --seed and i alone: neither --workers nor
--shard-size nor --n changes it. No two seeds or splits share a target. Read with training.datasets.read_shards.

Exit codes: 0 all is well, 1 something failed, 2 wrong usage, 130 Ctrl-C.
"""

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help=HELP,
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Number = Annotated[int, typer.Option("--n", help="How many targets.")]
Out = Annotated[Path, typer.Option(help="Folder of the data set.")]
Split = Annotated[str, typer.Option(help="train, validation or test.")]
Seed = Annotated[int, typer.Option(help="0 to 255; every seed has targets of its own.")]
Resolution = Annotated[int, typer.Option(help="Pixels a side.")]
ShardSize = Annotated[int, typer.Option(help="Targets a file.")]
Engine = Annotated[str, typer.Option(help="serial, process or ray.")]
Workers = Annotated[int | None, typer.Option(help="How many at once.", show_default="the cores there are")]
RayAddress = Annotated[
    str | None, typer.Option(help="Of a Ray cluster: auto or host:port.", show_default="one is started here")
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with the data set in OUT, if there is one.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Replace the data set in OUT.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress.")]


@app.command()
def constructions(
    n: Number,
    out: Out,
    difficulty: Annotated[str, typer.Option(help="Changes of the outline: a number or a range.")] = "1-5",
    operators: Annotated[str, typer.Option(help="paper, full, or operators, separated by commas.")] = "paper",
    split: Split = "train",
    seed: Seed = 0,
    resolution: Resolution = 128,
    shard_size: ShardSize = 512,
    engine: Engine = "process",
    workers: Workers = None,
    ray_address: RayAddress = None,
    resume: Resume = False,
    fresh: Fresh = False,
    quiet: Quiet = False,
) -> int:
    """Shapes of the random construction simulator, with the sequences that made them."""
    from training.datasets.build import DatasetSettings

    settings = DatasetSettings("constructions", split, seed, resolution, _range(difficulty), operators)
    machines = {"engine": engine, "n_workers": workers, "address": ray_address}
    return _build(settings, out, n, shard_size, machines, resume, fresh, quiet)


@app.command()
def objects(
    n: Number,
    out: Out,
    families: Annotated[str | None, typer.Option(help="Some of them, by commas.", show_default="all")] = None,
    split: Split = "train",
    seed: Seed = 0,
    resolution: Resolution = 256,
    shard_size: ShardSize = 512,
    engine: Engine = "process",
    workers: Workers = None,
    ray_address: RayAddress = None,
    resume: Resume = False,
    fresh: Fresh = False,
    quiet: Quiet = False,
) -> int:
    """Drawings of man-made things; how to construct them is not known."""
    from training.datasets.build import DatasetSettings

    settings = DatasetSettings("objects", split, seed, resolution, families=families)
    machines = {"engine": engine, "n_workers": workers, "address": ray_address}
    return _build(settings, out, n, shard_size, machines, resume, fresh, quiet)


@app.command()
def minari(
    n: Annotated[int, typer.Option("--n", help="How many episodes.")],
    out: Annotated[Path, typer.Option(help="Folder of Minari's data sets.")],
    name: Annotated[str, typer.Option(help="Of the data set, NAMESPACE/NAME-vN.")] = "autopoly/play-v0",
    agent: Annotated[str, typer.Option(help="Who plays.")] = "greedy",
    option: Annotated[list[str] | None, typer.Option(help="KEY=VALUE of the agent.")] = None,
    env: Annotated[str, typer.Option(help="AutoPoly-v0, AutoPolyObjects-v0 or AutoPolyFolder-v0.")] = "AutoPoly-v0",
    env_option: Annotated[list[str] | None, typer.Option(help="KEY=VALUE of the environment.")] = None,
    seed: Annotated[int, typer.Option(help="Of the first episode; the others follow.")] = 0,
    quiet: Quiet = False,
) -> int:
    """Record an agent's play in an environment, with the masks, as a data set of Minari."""
    from agents.options import put_override
    from agents.registry import make_agent
    from training.datasets.plays import PlaySettings, record_plays

    arguments: dict[Any, Any] = {}
    for text in env_option or []:
        put_override(arguments, text, f"--env-option {text}", "resolution=64")
    options: dict[Any, Any] = {}
    for text in option or []:
        put_override(options, text, f"--option {text}", "width=4")
    settings = PlaySettings(name, n, env, tuple(arguments.items()), seed)
    player = make_agent(agent, **options)
    with progress_bar(n, is_hidden=quiet, shows_left=True) as bar:
        record_plays(out, settings, player, lambda: bar.advance(TASK))
    print(f"{out}: {n} episodes of {agent} as {name}; read them with minari.load_dataset({name!r})")
    return 0


@app.command()
def verify(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A data set.")],
    quiet: Quiet = False,
) -> int:
    """Check every shard's checksum and content, and replay every construction sequence."""
    from training.datasets.build import check_dataset
    from training.datasets.shards import read_manifest

    manifest = read_manifest(folder)
    n_wrong = 0
    with progress_bar(len(manifest.names), is_hidden=quiet, shows_left=True) as bar:
        for _, problem in check_dataset(folder):
            n_wrong += problem is not None
            if problem is not None:
                say(bar.console, f"error: {problem}")
            bar.advance(TASK)
    n_right = len(manifest.names) - n_wrong
    print(f"{folder}: {n_right} of {len(manifest.names)} shards are as they should be ({manifest.n} targets)")
    return FAILURE if n_wrong else 0


@app.command()
def silhouettes(
    models: Annotated[list[Path], typer.Argument(metavar="MODEL", help="Files, or folders of ShapeNet models.")],
    out: Annotated[Path, typer.Option(help="Folder of the pictures.")],
    view: Annotated[str, typer.Option(help="side, front or top; models have +y up and face -z.")] = "side",
    resolution: Resolution = 256,
    categories: Annotated[
        str | None, typer.Option(help="Of ShapeNet: names or synset ids, by commas.", show_default="all")
    ] = None,
    split: Annotated[
        str | None, typer.Option(help="Of ShapeNet: train, validation or test.", show_default="all")
    ] = None,
    engine: Engine = "process",
    workers: Workers = None,
    quiet: Quiet = False,
) -> int:
    """Draw the silhouette of every model as OUT/NAME.png; OUT/silhouettes.jsonl says what became of each."""
    from autopoly_env.files import write_atomically
    from training.datasets.models import draw_model, needs_trimesh, tasks_of, write_index
    from training.parallel import map_tasks

    tasks = tasks_of(models, view, resolution, categories, split)
    needs_trimesh(tasks)
    engine = "serial" if len(tasks) == 1 and engine == "process" else engine
    records: dict[str, dict[str, str | None]] = {}
    with progress_bar(len(tasks), is_hidden=quiet, shows_left=True) as bar:
        for done in map_tasks(draw_model, tasks, engine=engine, n_workers=workers):
            picture = None if done.value is None else write_atomically(out / f"{done.task.name}.png", done.value).name
            records[done.task.name] = {"model": str(done.task.model), "picture": picture, "error": done.error}
            if done.error is not None:
                say(bar.console, f"error: {done.error}")
            bar.advance(TASK)
    write_index(out, [records[task.name] for task in tasks])
    n_failed = sum(record["error"] is not None for record in records.values())
    print(f"{out}: {len(tasks) - n_failed} of {len(tasks)} silhouettes")
    return FAILURE if n_failed else 0


def _build(
    settings: Any, out: Path, n: int, shard_size: int, machines: dict[str, Any], resume: bool, fresh: bool, quiet: bool
) -> int:
    """Make the data set and tell of it; returns the exit code."""
    from training.datasets.build import begin_dataset, build_dataset
    from training.datasets.shards import ShardInfo

    if resume and fresh:
        raise ConfigError("--resume and --fresh: give one of them")
    manifest = begin_dataset(out, settings, n, shard_size, resume=resume, fresh=fresh)
    n_done, n_shards = len(manifest.shards), len(manifest.names)
    try:
        with progress_bar(n_shards, n_done=n_done, is_hidden=quiet, shows_left=True) as bar:

            def on_shard(_: ShardInfo | None, problem: str | None) -> None:
                if problem is not None:
                    say(bar.console, f"error: {problem}")
                bar.advance(TASK)

            manifest = build_dataset(out, settings, manifest, **machines, on_shard=on_shard)
    except KeyboardInterrupt:
        print(f"stopped by Ctrl-C; what was done is in {out}: go on with --resume", file=sys.stderr)
        return TOLD
    n_there = sum(shard.n for shard in manifest.shards)
    print(f"{out}: {n_there} of {n} targets in {len(manifest.shards)} of {n_shards} shards")
    return 0 if n_there == n else FAILURE


def _range(text: str) -> tuple[int, int]:
    """ "3" or "1-5" as the least and the most."""
    least, _, most = text.partition("-")
    if not is_count(least) or not is_count(most or least):
        raise ConfigError(f"--difficulty {text}: expected a number or a range, such as 3 or 1-5")
    return int(least), int(most or least)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    return run_command(app, arguments, "python -m training.make_dataset")


if __name__ == "__main__":
    sys.exit(main())
