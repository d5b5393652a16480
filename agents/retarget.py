"""The command `python -m agents.retarget`: the steps of a construction, told again for another silhouette."""

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agents.commands import pictures
from agents.commands.operators import FaceRuleOfSequence, OutsideOperators, know
from agents.commands.running import run_command
from agents.commands.starting import INTERRUPTED
from autopoly_env.errors import ConfigError, SequenceError

if TYPE_CHECKING:
    from agents.retell.retargeting import Retargeted
    from autopoly_env.sequence import ConstructionSequence

STOPPED = "stopped by Ctrl-C; the files that were written are whole"

HELP = """Tell the steps of a construction again for another silhouette, and mend them where they do not fit.

\b
Examples:
  python -m agents.retarget out/chair/sequence.json other_chair.png
  python -m agents.retarget out/mug/sequence.json jug.png --refits 1000 --out jugs
  python -m agents.retarget out/chair/sequence.json other_chair.png --keep-level

\b
OUT/<name of the image without its ending>/ gets what agents.solve writes: sequence.json,
mesh.obj, mesh.svg, steps.png, player.html, lesson.json. The sequence replays from its own start.

\b
Printed are r_all on the new image: of the mesh as it was, of the same steps refitted,
and in the end, after steps were left out and added (docs/variations.md).

Ctrl-C writes the best so far and stops; a second one aborts at once.
Exit codes: 0 all is well, 1 something failed, 2 wrong usage, 130 Ctrl-C.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@app.command(help=HELP, context_settings={"help_option_names": ["-h", "--help"]})
def retarget(
    source: Annotated[Path, typer.Argument(metavar="SEQUENCE", help="A sequence as agents.solve writes it (JSON).")],
    image: Annotated[Path, typer.Argument(metavar="NEW_IMAGE", help="The silhouette to build instead.")],
    refits: Annotated[int, typer.Option(help="Limit of refits.")] = 300,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out"),
    operators: OutsideOperators = None,
    faces: FaceRuleOfSequence = None,
    keep_level: Annotated[bool, typer.Option("--keep-level", help="Level and plumb edges stay so.")] = False,
    no_symmetry: Annotated[
        bool, typer.Option("--no-symmetry", help="Let left and right differ where old and new are alike.")
    ] = False,
    object_: pictures.Object = "auto",
    background: pictures.Background = None,
    threshold: pictures.Threshold = None,
    alpha_threshold: pictures.AlphaThreshold = None,
    min_speck: pictures.MinSpeck = None,
    keep_specks: pictures.KeepSpecks = False,
    show_mask: pictures.ShowMask = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON record, no table.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar, no notes.")] = False,
) -> int:
    """Read both, retarget, write the results; return the exit code."""
    from agents.budget import Budget
    from agents.commands.ctrl_c import CtrlC
    from agents.commands.report import Report
    from agents.commands.results import Result, claim_folder, write_results
    from agents.commands.solving import name_jobs
    from agents.retell.retargeting import retarget as work
    from agents.retell.retargeting import simulator_of
    from autopoly_env.sequence import ConstructionSequence
    from autopoly_env.silhouette import load_silhouette

    budget = Budget(refits=refits)
    picture = pictures.read_options(object_, background, threshold, alpha_threshold, min_speck, keep_specks)
    know(operators)
    sequence = _under(source, ConstructionSequence.load(source), faces)
    [job] = name_jobs([image], out)
    silhouette = load_silhouette(image, name=job.name, options=picture)
    try:
        simulator = simulator_of(sequence, silhouette, keeps_symmetry=not no_symmetry)
    except ConfigError as error:
        raise SequenceError(f"{source}: settings: {error}") from None
    _check_not_overwritten(source, out / job.name)
    claim_folder(out)
    with CtrlC() as ctrl_c, Report(1, quiet=quiet or as_json) as report:
        report.begin(job.name)
        try:
            with ctrl_c.searching():
                done = work(simulator, sequence, budget, ctrl_c.heeding(report.progress), keep_level=keep_level)
            told = done.told
            solution = replace(done.solution, sequence=told)
            files = write_results(out / job.name, told, silhouette, ctrl_c.shielded, with_mask=show_mask)
        except KeyboardInterrupt:
            return INTERRUPTED
        if as_json:
            print(json.dumps({"image": str(image), **_record(done), "sequence": str(files["sequence.json"])}))
        else:
            report.solved(Result(image, job.name, solution, silhouette.notes, files))
            report.finish(None)
            print(_words(done, len(sequence.steps), simulator.guidance.axis, keep_level=keep_level))
        return INTERRUPTED if ctrl_c.n_pressed else 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    return run_command(app, arguments, "python -m agents.retarget", stopped=STOPPED)


def _under(source: Path, sequence: "ConstructionSequence", faces: str | None) -> "ConstructionSequence":
    """The sequence under a rule of faces. Raises SequenceError, with its file, where it breaks that."""
    try:
        return sequence.under(faces)
    except SequenceError as error:
        raise SequenceError(f"{source}: {error}") from None


def _check_not_overwritten(source: Path, folder: Path) -> None:
    if source.resolve() == (folder / "sequence.json").resolve():
        raise ConfigError(f"the results would overwrite {source}; give another folder with --out")


def _record(done: "Retargeted") -> dict[str, Any]:
    return {
        **done.notes,
        "before": asdict(done.before),
        "refitted": asdict(done.refitted),
        "after": asdict(done.solution.score),
        "start_iou": done.start_iou,
        "begins_elsewhere": done.begins_elsewhere,
        "level": done.n_level,
        "tilted": done.n_tilted,
        "n_refits": done.solution.stats.n_refits,
    }


def _words(done: "Retargeted", n_steps: int, axis: float | None = None, *, keep_level: bool = False) -> str:
    now = f"{done.solution.score.total:.2f} now"
    if done.solution.score.total < done.refitted.total:
        now += ", level and plumb" if keep_level else ", without hairlines"
    totals = f"{done.before.total:.2f} as it was, {done.refitted.total:.2f} refitted, {now}"
    steps = f"steps: {done.n_kept} of {n_steps} kept, {done.n_dropped} dropped, {done.n_added} added"
    if done.begins_elsewhere:
        steps += (
            f"; kept in name only: the start is a detail here (IoU {done.start_iou:.3f}), no body as it was "
            f"(at least {done.least_start_iou:.2f}); give a construction of a more similar shape, or solve it afresh"
        )
    lines = [steps, f"r_all: {totals}"]
    if axis is not None:
        lines.append(f"left and right stay alike (about x = {axis:g})")
    if keep_level:
        lines.append(f"level and plumb: {done.n_level} of {done.n_level + done.n_tilted} edges stay so")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
