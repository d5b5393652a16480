"""What trainings say: durations in words, their settings with what they mean, their metrics as a table."""

import inspect
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass
from typing import Any

import typer

BASELINES = ("residual", "majority", "chance", "least")  # how names of metrics end that others are measured against
_FIELD = re.compile(r"^    (\w+): [^#\n]*?(?:  # (.*))?$", re.MULTILINE)


def duration(seconds: float) -> str:
    """A time in words: 12 s, 3.4 min, 2.1 h."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.1f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


def settings_of(config: Any, prefix: str = "") -> list[str]:
    """A line for every SECTION.KEY of nested dataclasses: its value, whole and as it is given, and what it means."""
    lines: list[str] = []
    meanings = _meanings(type(config))
    for one in fields(config):
        value, name = getattr(config, one.name), f"{prefix}{one.name}"
        if is_dataclass(value):
            lines += ["", f"# {name}: {_first_line(type(value))}", *settings_of(value, f"{name}.")]
        else:
            meaning = meanings.get(one.name, "")
            lines.append(f"{name} = {_written(value)}" + (f"  # {meaning}" if meaning else ""))
    return lines


def show_config_option(settings: Any, what: str) -> Any:
    """The option --show-config of a command, which prints `settings` and does no more; `what` it prints of each."""

    def shown(wanted: bool) -> None:
        if wanted:
            print("\n".join(settings_of(settings)))
            raise typer.Exit

    help_text = f"Print every {what} and meaning, and do no more."
    return typer.Option("--show-config", callback=shown, is_eager=True, help=help_text)


def table_of(metrics: Mapping[str, float]) -> str:
    """A row for every metric, and beside it what it is measured against: names that end in one of `BASELINES`."""
    rows = [("metric", "value", "to compare with")]
    for name, value in metrics.items():
        if name.rpartition("_")[2] in BASELINES and name.rpartition("_")[0] in metrics:
            continue
        against = [f"{end} {metrics[f'{name}_{end}']:.4g}" for end in BASELINES if f"{name}_{end}" in metrics]
        rows.append((name, f"{value:.4g}", ", ".join(against)))
    widths = [max(len(row[k]) for row in rows) for k in range(2)]
    return "\n".join(f"  {a:<{widths[0]}}  {b:>{widths[1]}}  {c}".rstrip() for a, b, c in rows)


def _meanings(kind: type) -> dict[str, str]:
    """The comments beside the fields of a dataclass and of what it inherits from, by the fields' names."""
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__):
        if is_dataclass(one):
            found |= {name: comment for name, comment in _FIELD.findall(inspect.getsource(one)) if comment}
    return found


def _written(value: Any) -> str:
    """A value as the command line and files take it: JSON, which is YAML, too."""
    return json.dumps(value, default=asdict)


def _first_line(kind: type) -> str:
    return (inspect.getdoc(kind) or "").split("\n")[0]
