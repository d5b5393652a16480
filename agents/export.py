"""The command `python -m agents.export`: construction sequences as pages, drawings, meshes, pictures and scripts."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from agents.commands.running import FAILURE, complain, run_command
from autopoly_env.errors import ConfigError, OutputError, SequenceError

if TYPE_CHECKING:
    from autopoly_env.sequence import ConstructionSequence

HELP = """Write construction sequences in another format.

\b
Examples:
  python -m agents.export out/chair/sequence.json
  python -m agents.export out/mug/sequence.json --target mug.png --out mug.html
  python -m agents.export out/chair/sequence.json --to svg --step 4
  python -m agents.export out/*/sequence.json --to gltf --depth 0.1 --out glTF

\b
Formats:
  html     the player: a page to watch, with what to press in Blender
  svg      a drawing to edit, a layer for each step, the last one visible
  obj      the last mesh, with its n-gons
  gltf     an animation for viewers and engines; binary in a file .glb
  gif      an animated picture
  png      every step on one sheet
  blender  a Python script that builds the mesh with Blender's own operators

Without --out the result goes beside the sequence, under its name. What does not
replay is not written: one line tells the step, its operator and the reason.

Exit codes: 0 all is well, 1 something failed, 2 wrong usage, 130 Ctrl-C.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@app.command(help=HELP, context_settings={"help_option_names": ["-h", "--help"]})
def export(
    sequences: Annotated[
        list[Path], typer.Argument(metavar="SEQUENCE", help="Sequences as agents.solve writes them (JSON).")
    ],
    to: Annotated[str, typer.Option(help="html, svg, obj, gltf, gif, png or blender.")] = "html",
    out: Annotated[
        Path | None,
        typer.Option(help="A file name with its ending, or a folder.", show_default="beside the sequence"),
    ] = None,
    target: Annotated[
        Path | None,
        typer.Option(metavar="IMAGE", help="The silhouette, to be shown behind the mesh.", show_default="none"),
    ] = None,
    step: Annotated[
        int | None, typer.Option(help="End the construction after this step; 0 is the start.", show_default="the last")
    ] = None,
    depth: Annotated[
        float, typer.Option(help="Thickness of the mesh, in units of the unit square (gltf, blender).")
    ] = 0.0,
) -> int:
    """Check the options, then write one sequence after the other; return the exit code."""
    from autopoly_env.export.formats import FORMATS, Export
    from autopoly_env.silhouette import load_silhouette

    if to not in FORMATS:
        raise ConfigError(f"--to {to}: unknown format; give one of {', '.join(FORMATS)}")
    kind = FORMATS[to]
    if depth and not kind.shows_depth:
        able = [name for name, other in FORMATS.items() if other.shows_depth]
        raise ConfigError(f"--depth {depth}: {to} is flat; use it with {', '.join(able)}")
    if target and not kind.shows_target:
        able = [name for name, other in FORMATS.items() if other.shows_target]
        raise ConfigError(f"--target {target}: {to} shows no target; use it with {', '.join(able)}")
    jobs = list(_name_outputs(list(dict.fromkeys(sequences)), out, kind.suffix))
    silhouette = load_silhouette(target) if target else None
    n_failed = 0
    for source, goal in jobs:
        try:
            sequence = _load(source, step)
            print(kind.write(Export(sequence, silhouette, depth), goal))
        except (OutputError, SequenceError) as error:
            complain(str(error) if str(source) in str(error) else f"{source}: {error}", FAILURE)
            n_failed += 1
    return FAILURE if n_failed else 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    return run_command(app, arguments, "python -m agents.export")


def _load(path: Path, step: int | None) -> "ConstructionSequence":
    """The sequence in a file, up to a step. Raises SequenceError."""
    from autopoly_env.sequence import ConstructionSequence

    sequence = ConstructionSequence.load(path)
    return sequence if step is None else sequence.trim(step)


def _name_outputs(sources: list[Path], out: Path | None, suffix: str) -> Iterator[tuple[Path, Path]]:
    """Each sequence with the file to write. Raises ConfigError where that would overwrite a sequence.

    In a folder a file has the name of its sequence, or of the folder that it is in if it is called `sequence`, and a
    number if that name is taken.
    """
    taken = {source.resolve() for source in sources}
    for source in sources:
        if out is None:
            goal = source.with_suffix(suffix)
        elif len(sources) == 1 and out.suffix and not out.is_dir():
            goal = out
        else:
            name = source.resolve().parent.name if source.stem == "sequence" else source.stem
            goal, number = out / f"{name}{suffix}", 2
            while goal.resolve() in taken:
                goal, number = out / f"{name}-{number}{suffix}", number + 1
        if goal.resolve() in taken:
            raise ConfigError(f"{goal}: is a sequence, or the result of another one; give another --out")
        taken.add(goal.resolve())
        yield source, goal


if __name__ == "__main__":
    sys.exit(main())
