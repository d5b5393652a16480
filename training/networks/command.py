"""The command that trains a network with `training.networks.trainer`: its options, resuming, the end.

Each script hands in what is its own: the settings and their defaults, what is trained, and what is kept of it.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Annotated, Any, Protocol, TypeVar

import torch
import typer

from agents.commands.pulse import Pulse
from agents.commands.running import GOES_ON, run_command
from training.networks.trainer import OptimConfig, Process, RunConfig, TrainingTask, process_of, train
from training.options import plain, read_config
from training.telling import settings_of

Overrides = Annotated[list[str] | None, typer.Argument(metavar="SECTION.KEY=VALUE")]
ConfigFile = Annotated[Path | None, typer.Option(help="A YAML file; what it leaves out is at its default.")]
Folder = Annotated[Path, typer.Option(help="The run's folder.")]
Export = Annotated[bool, typer.Option("--export", help="Make the result the project's own weights.")]


ShowConfig = Annotated[
    bool, typer.Option("--show-config", help="Print every SECTION.KEY with its value and meaning, and do no more.")
]


class TrainingConfig(Protocol):
    """Settings of a training: a dataclass with these two sections and its own."""

    @property
    def optim(self) -> OptimConfig: ...

    @property
    def run(self) -> RunConfig: ...


_Config = TypeVar("_Config", bound=TrainingConfig)
_Task = TypeVar("_Task", bound=TrainingTask)


def new_app() -> typer.Typer:
    """A command without completion and without drawings of tracebacks."""
    return typer.Typer(add_completion=False, pretty_exceptions_enable=False)


def print_config(settings: Any) -> int:
    """Print all settings with what they mean; returns the exit code."""
    print("\n".join(settings_of(settings)))
    return 0


def train_network(
    default: _Config,
    overrides: list[str] | None,
    config: Path | None,
    folder: Path,
    make_task: Callable[[_Config], _Task],
    finish: Callable[[_Task, dict[str, Any], Path, torch.device], object],
    show_config: bool = False,
) -> int:
    """Train what `make_task` makes of the settings, or go on with what `folder` holds; then one process finishes it.

    The settings are the defaults, with what the file `config` says and then with the overrides. `finish` takes task,
    settings, folder and device. Raises ConfigError for settings that do not fit, RunError if the folder belongs to
    another run or the loss is not a number. Returns the exit code; with `show_config` the settings are only printed.
    """
    settings = read_config(config, overrides or [], default)
    if show_config:
        return print_config(settings)
    with process_of(settings.run) as process:
        with _pulse(process, "reading the shards"):
            task = make_task(settings)
        train(task, settings.optim, settings.run, plain(settings), folder, process)
        if process.leads:
            with _pulse(process, "measuring the result"):
                finish(task, plain(settings), folder, process.device)
    return 0


def _pulse(process: Process, what: str) -> AbstractContextManager[object]:
    """Signs of life of the process that speaks for all."""
    return Pulse(lambda: what) if process.leads else nullcontext()


def run_training(app: typer.Typer, arguments: list[str] | None, module: str) -> int:
    """Run the command of `python -m MODULE`; returns the exit code."""
    return run_command(app, arguments, f"python -m {module}", stopped=GOES_ON)
