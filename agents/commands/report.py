"""What `agents.solve` prints: a progress bar and errors on stderr, a table or JSON records on stdout."""

import json
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from agents import budget
from agents.commands.columns import LESSON
from agents.commands.losses import record_of_losses
from agents.commands.progress import TASK, progress_bar
from agents.commands.results import Result
from agents.commands.screen import say
from autopoly_env.sequence import Lesson
from autopoly_env.shown import tame, told

FORMATS = {  # of the numbers that a table can show, each and as a mean
    "r_sm": (".4f", ".4f"),
    "r_sc": (".0f", ".1f"),
    "r_si": (".0f", ".1f"),
    "r_all": (".2f", ".2f"),
    "V": (".0f", ".1f"),
    "E": (".0f", ".1f"),
    "F": (".0f", ".1f"),
    "actions": (".0f", ".1f"),
    "valid": (".2f", ".2f"),
    "blocking_in": (".3f", ".3f"),
    "moved": (".3f", ".3f"),
    "quads": (".2f", ".2f"),
    "ngons": (".0f", ".1f"),
    "concave": (".0f", ".1f"),
    "effort": (".1f", ".1f"),
    "returns": (".0f", ".2f"),
    "refits": (".0f", ".1f"),
    "seconds": (".2f", ".2f"),
}
WORDS = {  # what is shown where nothing is asked for, and what it is called there
    "r_all": "score",
    "r_sm": "IoU",
    "r_sc": "elements",
    "r_si": "crossings",
    "actions": "steps",
    "valid": "sound",
    "blocking_in": "big first",
    "moved": "moved",
    "refits": "refits",
    "seconds": "seconds",
}
USUAL = {"r_si": 0.0, "valid": 1.0, "moved": 0.0}  # a column with nothing but this says nothing
WARNING = "warning:"
MOST_NOTES = 8  # lines of notes below a table
LOST = " the mesh "  # in notes on what a mesh has lost
MOST_NAMES = 4  # names of images in such a line
PLAIN_WIDTH = 120  # of a table that goes to a file
MOST_NAME = 24  # letters of a name in a line of it; longer ones are folded
SPACE = 3  # letters between columns


class Report:
    """Tells the user how it goes with `n_tasks` images; as a context it shows the progress bar where it can be seen.

    The table has `columns` of FORMATS, by these names; where there are none, those of WORDS that say something.
    """

    def __init__(
        self, n_tasks: int, *, as_json: bool = False, quiet: bool = False, columns: tuple[str, ...] = ()
    ) -> None:
        self.n_failed = 0
        self._columns = columns
        self._as_json, self._quiet = as_json, quiet
        self._rows: dict[str, dict[str, float]] = {}
        self._notes: dict[str, list[str]] = {}  # the names of the images that have a note
        self._warnings: list[str] = []
        self._picture: Path | None = None
        self._messages = Console(stderr=True)
        self._output = Console()
        if not self._output.is_terminal:
            self._output.width = PLAIN_WIDTH
        is_hidden = quiet or (as_json and self._output.is_terminal)
        self._bar = progress_bar(n_tasks, is_hidden=is_hidden, console=self._messages)
        self._name = ""

    def __enter__(self) -> "Report":
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def begin(self, name: str) -> None:
        """An image is begun."""
        self._name = tame(name)
        self._bar.update(TASK, description=self._name)

    def progress(self, progress: budget.Progress) -> None:
        """An agent has come this far with it."""
        text = f"{self._name}  r_all {progress.best_total:.2f}, {progress.n_refits} refits"
        if progress.n_nodes:
            text += f", tree of {progress.n_nodes}"
        self._bar.update(TASK, description=text)

    def solved(self, result: Result) -> None:
        """An image is solved and its results are written."""
        self._bar.advance(TASK)
        self._picture = result.files["steps.png"]
        if self._as_json:
            _print_record(record_of(result))
        self._rows[result.name] = _numbers_of(result)
        for note in result.notes:
            if note.startswith(WARNING):
                self._warnings.append(f"{WARNING} {result.image}: {note.removeprefix(WARNING).strip()}")
            else:
                self._notes.setdefault(note, []).append(result.name)

    def failed(self, what: str, problem: str) -> None:
        """Something, most often an image, has failed."""
        self.n_failed += 1
        problem = told(problem)
        self._bar.advance(TASK)
        if self._as_json:
            _print_record({"image": what, "error": problem})
        self.say(told(f"error: {problem}" if what in problem else f"error: {what}: {problem}"))

    def say(self, text: str) -> None:
        """A line on stderr, above the progress bar."""
        say(self._messages, text)

    def finish(self, overview: Path | None) -> None:
        """The work is done: show the table and what else there is to know, last the picture to open."""
        self._bar.stop()
        if not self._rows:
            return
        lines = list(self._warnings)
        if not (self._quiet or self._as_json):
            lines += _note_lines(self._notes, len(self._rows))
        if not (self._quiet and self._as_json):
            lines.append(f"Open {overview or self._picture}")
        if not self._as_json:
            for table in _tables(self._rows, self._columns, self._output.width):
                self._output.print(table)
        for line in lines:
            say(self._messages if self._as_json else self._output, line)


def _print_record(record: dict[str, Any]) -> None:
    print(json.dumps(record, allow_nan=False), flush=True)


def _numbers_of(result: Result) -> dict[str, float]:
    """All that a table can show, in the order of FORMATS."""
    score, stats = result.solution.score, result.solution.stats
    lesson = Lesson.of(result.solution.sequence)
    n_vertices, n_edges, n_faces = result.solution.mesh.counts
    return {
        "r_sm": score.iou,
        "r_sc": score.complexity,
        "r_si": score.self_intersections,
        "r_all": score.total,
        "V": n_vertices,
        "E": n_edges,
        "F": n_faces,
        "actions": lesson.n_actions,
        **{name: value for name, value in vars(lesson).items() if name in LESSON},
        "refits": stats.n_refits,
        "seconds": stats.seconds,
    }


def _tables(rows: dict[str, dict[str, float]], columns: tuple[str, ...], width: int) -> list[Table]:
    """A row for every image, by its numbers, and their mean if there are several; more tables where one is too wide."""
    if not columns:
        columns = tuple(name for name in WORDS if any(n[name] != USUAL.get(name) for n in rows.values()))
        heads = {name: WORDS[name] for name in columns}
    else:
        heads = {name: name for name in columns}
    texts = {name: _column(rows, name) for name in columns}
    room = width - min(MOST_NAME, max(len("mean of 100"), *(len(tame(image)) for image in rows))) - 2 * SPACE
    tables: list[list[str]] = [[]]
    for name in columns:
        needed = sum(_width(texts[other], heads[other]) for other in (*tables[-1], name))
        if tables[-1] and needed > room:
            tables.append([])
        tables[-1].append(name)
    return [_table(list(rows), {heads[name]: texts[name] for name in names}) for names in tables]


def _column(rows: dict[str, dict[str, float]], name: str) -> list[str]:
    """The numbers of a column, and their mean."""
    mean = sum(numbers[name] for numbers in rows.values()) / len(rows)
    return [*(format(numbers[name], FORMATS[name][0]) for numbers in rows.values()), format(mean, FORMATS[name][1])]


def _width(texts: list[str], head: str) -> int:
    return max(map(len, (head, *texts))) + SPACE


def _table(names: list[str], columns: dict[str, list[str]]) -> Table:
    """A table of texts by their heads, the mean last."""
    table = Table(box=box.SIMPLE_HEAD, show_footer=len(names) > 1)
    table.add_column("name", footer=f"mean of {len(names)}", overflow="fold")
    for head, texts in columns.items():
        table.add_column(head, footer=texts[-1], justify="right", no_wrap=True)
    for number, name in enumerate(names):
        table.add_row(Text(tame(name)), *(texts[number] for texts in columns.values()))
    return table


def _note_lines(notes: dict[str, list[str]], n_images: int) -> list[str]:
    """A line for every note that images share: what is lost first, then those of most images."""
    if n_images == 1:
        return [f"notes: {'; '.join(notes)}"] if notes else []
    lines = []
    for note, names in sorted(notes.items(), key=lambda item: (LOST not in item[0], -len(item[1]))):
        first, n_more = ", ".join(names[:MOST_NAMES]), len(names) - MOST_NAMES
        whose = f"all {n_images} images" if len(names) == n_images else first
        lines.append(f"note: {note}: {whose}" + (f" and {n_more} more" if whose == first and n_more > 0 else ""))
    if len(lines) <= MOST_NOTES + 1:
        return lines
    return [*lines[:MOST_NOTES], f"note: {len(lines) - MOST_NOTES} more notes; --json shows them"]


def record_of(result: Result) -> dict[str, Any]:
    """A result as plain values, for JSON."""
    settings = result.solution.sequence.settings
    return {
        "image": str(result.image),
        "name": result.name,
        "agent": settings["agent"],
        "settings": settings,
        "seed": settings["seed"],
        **_numbers_of(result),
        "stopped_by": result.solution.stats.stopped_by,
        **({} if result.losses is None else {"kept": record_of_losses(result.losses)}),
        "notes": list(result.notes),
        "files": {name: str(path) for name, path in result.files.items()},
    }
