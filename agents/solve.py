"""The command `python -m agents.solve`: from silhouette images to meshes, construction sequences and pictures."""

import errno
import io
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.commands.running import FAILURE, complain, run_command
from agents.names import AGENT_NAMES
from autopoly_env.errors import AutoPolyError

DEFAULT_AGENT = "mcts"

HELP = """Build a polygon mesh of every silhouette and tell how, action by action.

\b
Examples:
  python -m agents.solve examples
  python -m agents.solve chair.png mug.png --agent greedy --operators paper
  python -m agents.solve chair.png --agent beam --option width=4 --refits 5000
  python -m agents.solve chair.png --agent my.module:MyAgent
  python -m agents.solve 'shapes/**/*.png' --json --quiet > scores.jsonl
  python -m agents.solve mug.png --importance face.png
  python -m agents.solve mug.png --agent beam --start mug.obj --lock 0,3
  python -m agents.solve vase.png --agent beam --symmetry auto

\b
For every image, OUT/<name of the file without its ending>/ gets
  sequence.json  the actions, to be replayed    mesh.obj  the mesh, y up
  steps.png      every step over the target     mesh.svg  the mesh, to edit
  player.html    the construction, to be watched and done by hand in Blender
and OUT/overview.png shows all meshes, if there are several images.

\b
Guidance (docs/guidance.md): --importance is for every agent; --start, --lock
and --symmetry are for those that play step by step: all but trace, climb,
decimate, dr-simple and dr-complex.

\b
Printed are the scores, at each image's own resolution, and the picture to open:
  r_all = w_sm r_sm - w_sc r_sc - w_si r_si
  r_sm: IoU, 0 to 1      r_sc: V + E + F      r_si: self-intersections
and how the construction reads (docs/lessons.md): the number of actions, and
  valid: share of meshes without crossings and flipped faces, 1 is expected
  blocking_in: mean r_sm on the way, high where the big shape comes first
  moved: share of the vertices already there that a step moves, LOW is good

Ctrl-C writes the best mesh so far of the image in work and stops; a second one aborts at once.
Exit codes: 0 all is well, 1 something failed, 2 wrong usage, 130 Ctrl-C.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@app.command(help=HELP, context_settings={"help_option_names": ["-h", "--help"]})
def solve(
    images: Annotated[
        list[str], typer.Argument(metavar="IMAGE", help="Files, folders or patterns; ** crosses folders.")
    ],
    agent: Annotated[
        str,
        typer.Option(
            help=f"Who builds: {', '.join(AGENT_NAMES)}, my.module:Agent for one of yours, or a YAML "
            "file of options that is named after its agent (docs/agents.md)."
        ),
    ] = DEFAULT_AGENT,
    operators: Annotated[
        str, typer.Option(help="paper, full, modeller, names, or my.module:my_operator, separated by commas.")
    ] = "full",
    w_sm: Annotated[float, typer.Option(help="Weight of the IoU.")] = 100.0,
    w_sc: Annotated[float, typer.Option(help="Weight of the complexity V + E + F.")] = 0.3,
    w_si: Annotated[float, typer.Option(help="Weight of the self-intersections.")] = 5.0,
    w_locality: Annotated[
        float, typer.Option(help="Price of moving vertices already there, off r_all in choosing steps; try 0.5.")
    ] = 0.0,
    resolution: Annotated[int, typer.Option(help="Pixels a side at which the agent works.")] = 128,
    max_steps: Annotated[int, typer.Option(help="Steps after which a construction ends.")] = 100,
    seconds: Annotated[
        float | None,
        typer.Option(help="Time for an image; results then depend on the machine.", show_default="none"),
    ] = None,
    refits: Annotated[int | None, typer.Option(help="Limit of refits an image.", show_default="none")] = None,
    simulations: Annotated[
        int | None,
        typer.Option(help="Limit of simulations an image, for agents that search a tree.", show_default="none"),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Of the agents that draw random numbers.", show_default="the agent's, 0")
    ] = None,
    option: Annotated[
        list[str] | None, typer.Option(metavar="KEY=VALUE", help="An option of the agent, as YAML; may be repeated.")
    ] = None,
    importance: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Grey picture: white where matching matters, black where not.")
    ] = None,
    start: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Mesh (.obj) to start from, or sequence (.json) to go on from.")
    ] = None,
    lock: Annotated[
        str | None, typer.Option(metavar="IDS", help="Vertices of --start that stay where they are, such as 0,3,5.")
    ] = None,
    symmetry: Annotated[
        str | None,
        typer.Option(metavar="[auto|X]", help="Left and right alike, about the best axis or x = X (0 to 1)."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out"),
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a JSON record a line as each image is done, no table.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar, no notes.")] = False,
) -> int:
    """Check everything that can be checked before the work, then do it; return the exit code."""
    from agents.budget import Budget
    from agents.commands.report import Report
    from agents.commands.results import claim_folder
    from agents.commands.solving import Settings, name_jobs, solve_all
    from agents.commands.wishes import read_wishes
    from autopoly_env.score import ScoreWeights

    weights = ScoreWeights(w_sm, w_sc, w_si, w_locality)
    budget = Budget(refits, seconds, simulations)
    wishes = read_wishes(importance, start, lock, symmetry)
    options = _parse_options(option or [])
    settings = Settings(agent, options, seed, operators, resolution, max_steps, weights, budget, wishes)
    settings.check()
    found, problems = _find(images)
    jobs = name_jobs(found, out)
    claim_folder(out)
    with Report(len(jobs) + len(problems), as_json=as_json, quiet=quiet) as report:
        for image, problem in problems:
            report.failed(image, problem)
        return solve_all(jobs, settings, out, report)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    try:
        return run_command(app, arguments, "python -m agents.solve", stopped="")
    except OSError as error:
        if error.errno == errno.EPIPE:
            raise
        sys.stdout = io.StringIO()  # so that leaving does not fail on it again
        return complain(f"cannot print the results ({error.strerror}); give them another place to go", FAILURE)


def _parse_options(given: list[str]) -> dict[str, Any]:
    """The options of the agent as they were typed, `key=value`."""
    from agents.options import put_override

    options: dict[str, Any] = {}
    for pair in given:
        put_override(options, pair, f"--option {pair}", "width=4")
    return options


def _find(given: list[str]) -> tuple[list[Path], list[tuple[str, str]]]:
    """The images, each once, and (what was given, what is wrong with it) where there are none."""
    from autopoly_env.silhouette import find_images

    found: dict[Path, None] = {}
    problems = []
    for path in given:
        try:
            found.update(dict.fromkeys(find_images([path])))
        except AutoPolyError as error:
            problems.append((path, str(error)))
    return list(found), problems


if __name__ == "__main__":
    sys.exit(main())
