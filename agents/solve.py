"""The command `python -m agents.solve`: from silhouette images to meshes, construction sequences and pictures."""

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.commands import pictures
from agents.commands.running import run_command
from agents.commands.starting import loading
from agents.commands.styles import default_style, describe_styles, style_named
from agents.names import AGENT_NAMES
from autopoly_env.errors import AutoPolyError

MOST_SKIPPED = 3  # files that are named

SHORT_HELP = """Usage: python -m agents.solve [OPTIONS] IMAGE...

Build a polygon mesh of every silhouette and tell how, action by action.

  python -m agents.solve examples
  python -m agents.solve chair.png mug.jpg drawings/ --out results
  python -m agents.solve mug.png --style paper --seconds 5

IMAGE is a file, a folder, or a pattern in quotes such as 'shapes/**/*.png'.
For each, OUT/<its name>/ gets player.html (to watch, and to do by hand in
Blender), steps.png, mesh.obj, mesh.svg, sequence.json and lesson.json.

  --style STYLE    modeller (the default): quads, extruded part by part;
                   paper: the best score, few faces of many corners, told as
                   an outline that is cut finer and finer
  --w-sc PRICE     of a vertex, an edge, a face, in points of the score:
                   0.3 (the default) keeps details, 1 asks for simple shapes
  --agent NAME     who builds, in the paper's style: mcts, trace in a tenth of
                   the time, and others
  --seconds S      how long an image may take (no limit by default)
  --object WHAT    what of the picture is built, where the notes name the
                   wrong thing: dark, light, alpha, or a colour
  --out FOLDER     where the results go (out)

The table shows the score (higher is better: 100 times the IoU, less the price
of the elements), the IoU of mesh and picture (1 is perfect), the number of
elements, which are vertices, edges and faces, and the number of steps; "big
first" is high where the big shape comes before its details; then refits and
seconds. Crossings, meshes that are not sound, and vertices that are moved again
("moved", low is good) are shown where there are any. --columns all shows all.

--help-all lists all options: operators, rules of faces, budgets, guidance,
pictures, output; and the exit codes.
"""

HELP = """Build a polygon mesh of every silhouette and tell how, action by action.

\b
Examples:
  python -m agents.solve examples
  python -m agents.solve chair.png mug.png --agent greedy --operators paper
  python -m agents.solve chair.png --agent beam --option width=4 --refits 5000
  python -m agents.solve chair.png --agent my.module:MyAgent
  python -m agents.solve 'shapes/**/*.png' --json --quiet > scores.jsonl
  python -m agents.solve mug.png --style paper
  python -m agents.solve mug.png --agent beam --faces quads
  python -m agents.solve mug.png --importance face.png
  python -m agents.solve mug.png --agent beam --start mug.obj --lock 0,3
  python -m agents.solve vase.png --agent beam --symmetry best
  python -m agents.solve gear.png --keep holes
  python -m agents.solve badge.png --object dark --show-mask

\b
For every image, OUT/<name of the file without its ending>/ gets
  sequence.json  the actions, to be replayed    mesh.obj  the mesh, y up
  steps.png      every step over the target     mesh.svg  the mesh, to edit
  player.html    the construction, to be watched and done by hand in Blender
  lesson.json    the same for the coach in Blender (docs/blender.md)
and OUT/overview.png shows all meshes beside their pictures, if there are several images.

\b
What in a picture is the object (docs/pictures-in.md) the notes tell; --object, --background, --threshold,
--alpha-threshold, --min-speck and --keep-specks say otherwise, and --show-mask writes mask.png.

\b
Guidance (docs/guidance.md): --importance and --align are for every agent;
--start, --lock and --symmetry are for those that play step by step: all but
trace, climb, decimate, quads, dr-simple and dr-complex. quads takes --symmetry,
too. --faces convex or quads is for all but trace, climb and decimate.

\b
Printed are the scores, at each image's own resolution, and the picture to
open; in words, or with --columns and --json by these names:
  r_all = w_sm r_sm - w_sc r_sc - w_si r_si
  r_sm: IoU, 0 to 1      r_sc: V + E + F      r_si: self-intersections
and how the construction reads (docs/lessons.md): the number of actions, and
  valid: share of meshes without crossings and flipped faces, 1 is expected
  blocking_in: mean r_sm on the way, high where the big shape comes first
  moved: share of the vertices already there that a step moves, LOW is good
With --columns lesson also: quads (share of the faces), ngons and concave
(faces), effort (seconds to follow it by hand), returns (to a part that was left).

Ctrl-C writes the best mesh so far of the image in work and stops; a second one aborts at once.
Exit codes: 0 all is well, 1 something failed, 2 wrong usage, 130 Ctrl-C.
"""

BUILDING, LIMITS = "What is built, by whom, with what", "Weights and limits"
GUIDANCE, OUTPUT = "Guidance (docs/guidance.md)", "Output"

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


def _print_short(is_asked: bool) -> None:
    if is_asked:
        print(SHORT_HELP, end="")
        raise typer.Exit


@app.command(help=HELP, context_settings={"help_option_names": ["--help-all"]})
def solve(
    images: Annotated[
        list[str], typer.Argument(metavar="IMAGE", help="Files, folders or patterns; ** crosses folders.")
    ],
    style: Annotated[
        str | None,
        typer.Option(
            help=f"What is built, and how: {describe_styles()} (docs/modelling.md).",
            show_default="modeller; paper where the agent, its options, operators, faces or a start are given",
            rich_help_panel=BUILDING,
        ),
    ] = None,
    agent: Annotated[
        str | None,
        typer.Option(
            help=f"Who builds: {', '.join(AGENT_NAMES)}, my.module:Agent for one of yours, or a YAML "
            "file of options that is named after its agent (docs/agents.md).",
            show_default="the style's",
            rich_help_panel=BUILDING,
        ),
    ] = None,
    operators: Annotated[
        str | None,
        typer.Option(
            help="paper, full, modeller, names, or my.module:my_operator, separated by commas.",
            show_default="the style's",
            rich_help_panel=BUILDING,
        ),
    ] = None,
    faces: Annotated[
        str | None,
        typer.Option(
            help="Rule of faces: any, convex, or quads (convex, 3 or 4 corners).",
            show_default="the style's",
            rich_help_panel=BUILDING,
        ),
    ] = None,
    w_sm: Annotated[float, typer.Option(help="Weight of the IoU.", rich_help_panel=LIMITS)] = 100.0,
    w_sc: Annotated[float, typer.Option(help="Weight of the complexity V + E + F.", rich_help_panel=LIMITS)] = 0.3,
    w_si: Annotated[float, typer.Option(help="Weight of the self-intersections.", rich_help_panel=LIMITS)] = 5.0,
    w_locality: Annotated[
        float,
        typer.Option(
            help="Price of moving vertices already there, off r_all in choosing steps; try 0.5.", rich_help_panel=LIMITS
        ),
    ] = 0.0,
    resolution: Annotated[
        int, typer.Option(help="Pixels a side at which the agent works.", rich_help_panel=LIMITS)
    ] = 128,
    max_steps: Annotated[
        int, typer.Option(help="Steps after which a construction ends.", rich_help_panel=LIMITS)
    ] = 100,
    seconds: Annotated[
        float | None,
        typer.Option(
            help="Time for an image; results then depend on the machine.", show_default="none", rich_help_panel=LIMITS
        ),
    ] = None,
    refits: Annotated[
        int | None, typer.Option(help="Limit of refits an image.", show_default="none", rich_help_panel=LIMITS)
    ] = None,
    simulations: Annotated[
        int | None,
        typer.Option(
            help="Limit of simulations an image, for agents that search a tree.",
            show_default="none",
            rich_help_panel=LIMITS,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            help="Of the agents that draw random numbers.", show_default="the agent's, 0", rich_help_panel=BUILDING
        ),
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE", help="An option of the agent, as YAML; may be repeated.", rich_help_panel=BUILDING
        ),
    ] = None,
    importance: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Grey picture: white where matching matters, black where not.",
            rich_help_panel=GUIDANCE,
        ),
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Mesh (.obj) to start from, or sequence (.json) to go on from.",
            rich_help_panel=GUIDANCE,
        ),
    ] = None,
    lock: Annotated[
        str | None,
        typer.Option(
            metavar="IDS", help="Vertices of --start that stay where they are, such as 0,3,5.", rich_help_panel=GUIDANCE
        ),
    ] = None,
    symmetry: Annotated[
        str | None,
        typer.Option(
            metavar="[auto|best|off|X]",
            help="Left and right alike: auto where 99 % of the area is, about the best axis, or x = X (0 to 1).",
            show_default="the style's",
            rich_help_panel=GUIDANCE,
        ),
    ] = None,
    align: Annotated[
        bool | None,
        typer.Option(
            help="What is nearly upright, level, parallel or of equal length becomes exactly so.",
            show_default="the style's",
            rich_help_panel=GUIDANCE,
        ),
    ] = None,
    keep: Annotated[
        str | None,
        typer.Option(
            metavar="[holes|parts|all]",
            help="What of the picture is to be in the mesh, whatever it costs.",
            rich_help_panel=GUIDANCE,
        ),
    ] = None,
    object_: pictures.Object = "auto",
    background: pictures.Background = None,
    threshold: pictures.Threshold = None,
    alpha_threshold: pictures.AlphaThreshold = None,
    min_speck: pictures.MinSpeck = None,
    keep_specks: pictures.KeepSpecks = False,
    show_mask: pictures.ShowMask = False,
    out: Annotated[Path, typer.Option(help="Folder for the results.", rich_help_panel=OUTPUT)] = Path("out"),
    as_json: Annotated[
        bool,
        typer.Option(
            "--json", help="Print a JSON record a line as each image is done, no table.", rich_help_panel=OUTPUT
        ),
    ] = False,
    columns: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="What the table shows: all, lesson, or names of a JSON record with commas.",
            rich_help_panel=OUTPUT,
        ),
    ] = "",
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar, no notes.", rich_help_panel=OUTPUT)] = False,
    short_help: Annotated[
        bool,
        typer.Option(
            "--help",
            "-h",
            is_eager=True,
            callback=_print_short,
            help="The six options to begin with.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
) -> int:
    """Check everything that can be checked before the work, then do it; return the exit code."""
    with loading():
        from agents.budget import Budget
        from agents.commands.columns import read_columns
        from agents.commands.report import FORMATS, Report
        from agents.commands.results import claim_folder
        from agents.commands.solving import Settings, name_jobs, solve_all
        from agents.commands.wishes import read_wishes
        from autopoly_env.score import ScoreWeights

    shown = read_columns(columns, FORMATS, ())
    weights = ScoreWeights(w_sm, w_sc, w_si, w_locality)
    budget = Budget(refits, seconds, simulations)
    options = _parse_options(option or [])
    named = default_style((agent, option, operators, faces, simulations, start, lock)) if style is None else style
    chosen = style_named(named).with_choices(agent, operators, faces, symmetry, align)
    wishes = read_wishes(importance, start, lock, chosen.symmetry, keep, chosen.align)
    picture = pictures.read_options(object_, background, threshold, alpha_threshold, min_speck, keep_specks)
    settings = Settings(
        chosen.agent,
        options,
        seed,
        chosen.operators,
        resolution,
        max_steps,
        weights,
        budget,
        wishes,
        chosen.faces,
        picture,
        show_mask,
    )
    settings.check()
    found, problems, skipped = _find(images)
    jobs = name_jobs(found, out)
    claim_folder(out)
    with Report(len(jobs) + len(problems), as_json=as_json, quiet=quiet, columns=shown) as report:
        for image, problem in problems:
            report.failed(image, problem)
        if skipped and not quiet:
            names = ", ".join(path.name for path in skipped[:MOST_SKIPPED])
            more = ", …" if len(skipped) > MOST_SKIPPED else ""
            report.say(f"note: {len(skipped)} files are no pictures and were skipped: {names}{more}")
        return solve_all(jobs, settings, out, report)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    return run_command(app, arguments, "python -m agents.solve")


def _parse_options(given: list[str]) -> dict[str, Any]:
    """The options of the agent as they were typed, `key=value`."""
    from agents.options import put_override

    options: dict[str, Any] = {}
    for pair in given:
        put_override(options, pair, f"--option {pair}", "width=4")
    return options


def _find(given: list[str]) -> tuple[list[Path], list[tuple[str, str]], list[Path]]:
    """The images, each once, (what was given, what is wrong with it) where there are none, and what else lies there."""
    from autopoly_env.silhouette import find_images

    found: dict[Path, None] = {}
    problems: list[tuple[str, str]] = []
    skipped: list[Path] = []
    for path in given:
        try:
            found.update(dict.fromkeys(find_images([path], skipped)))
        except AutoPolyError as error:
            problems.append((path, str(error)))
    return list(found), problems, skipped


if __name__ == "__main__":
    sys.exit(main())
