"""Expert iteration in one command: search plays, ChoiceNet learns what it found, and the search plays on with it.

    python -m training.improve --config configs/train/improve.yaml                          # all cores of this machine
    python -m training.improve --config configs/train/improve.yaml --engine ray --ray-address auto   # a Ray cluster

The same command goes on with a run that was stopped, at any moment: every play, every comparison and every round is
on disk when it is done. At the end the folder has report.json and choice.safetensors; --export makes these the weights
that come with the project.
"""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from agents.commands.running import GOES_ON, run_command
from training.improvement.rounds import ImproveConfig, Workers, improve
from training.options import claim_run, plain, read_config
from training.telling import show_config_option

HELP = """Improve the prior of the tree search by what the search itself finds, round by round.

\b
Examples:
  python -m training.improve --config configs/train/improve.yaml
  python -m training.improve play.n_first=1000 run.n_rounds=5 --out runs/more
  python -m training.improve --engine ray --ray-address auto

A round plays the tree in both styles on fresh targets, trains prior and value on what was found, and is compared with
the round before on held-out targets. It ends with the first round that gains nothing. The same command goes on with a
run that was stopped. See docs/learning.md.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command(help=HELP)
def main_command(
    overrides: Annotated[list[str] | None, typer.Argument(metavar="SECTION.KEY=VALUE")] = None,
    config: Annotated[Path | None, typer.Option(help="A YAML file; what it leaves out is at its default.")] = None,
    out: Annotated[Path, typer.Option(help="The run's folder.")] = Path("runs/improve"),
    export: Annotated[bool, typer.Option("--export", help="Make the result the project's own weights.")] = False,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes.", show_default="as many as cores")] = None,
    engine: Annotated[str, typer.Option(help="serial, process or ray.")] = "process",
    ray_address: Annotated[str | None, typer.Option(help="Of a Ray cluster.")] = None,
    show_config: Annotated[bool, show_config_option(ImproveConfig(), "SECTION.KEY with its value")] = False,
) -> int:
    settings = read_config(config, overrides or [], ImproveConfig())
    claim_run(out, plain(settings), ())
    path = improve(settings, out, Workers(engine, workers, ray_address))
    print(f"{path}: the weights of the best round; report.json has what each reached")
    if export:
        from training.improvement.card import export_choice

        print(f"exported to {export_choice(path, f'python -m training.improve {shlex.join(sys.argv[1:])}')}")
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    return run_command(app, arguments, "python -m training.improve", stopped=GOES_ON)


if __name__ == "__main__":
    sys.exit(main())
