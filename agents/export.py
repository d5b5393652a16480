"""The command `python -m agents.export`: construction sequences as pages, drawings, meshes, pictures and scripts."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agents.commands import pictures
from agents.commands.operators import OutsideOperators, know
from agents.commands.running import FAILURE, complain, run_command
from autopoly_env.errors import AutoPolyError, ConfigError, OutputError, SequenceError
from autopoly_env.export.formats import LISTED, Export, Format, find_format, format_of, formats
from autopoly_env.outside import described
from autopoly_env.shown import tame

if TYPE_CHECKING:
    from autopoly_env.export.texture import Texture
    from autopoly_env.sequence import ConstructionSequence

DEFAULT = "html"
_CHECK = "autopoly_env.conformance.check_format shows where"

_FORMATS = "\n".join(f"  {name:11} {line}" for name, _, line in LISTED)

HELP = f"""Write construction sequences in another format.

\b
Examples:
  python -m agents.export out/chair/sequence.json
  python -m agents.export out/mug/sequence.json --target mug.png --out mug.html
  python -m agents.export out/chair/sequence.json --out chair.obj
  python -m agents.export out/chair/sequence.json --to svg --step 4
  python -m agents.export out/*/sequence.json --to gltf --depth 0.1 --out glTF
  python -m agents.export out/key/sequence.json --to stl --depth 0.05 --size 80
  python -m agents.export out/vase/sequence.json --to blender --half

\b
Formats:
{_FORMATS}

\b
Without --to the ending of --out decides. A format of your own is named by its
module, --to my.module:FORMAT (docs/player.md).

\b
Without --out the result goes beside the sequence, under its name. What does
not replay is not written: one line tells the step, its operator and the reason.

Exit codes: 0 all is well, 1 something failed, 2 wrong usage, 130 Ctrl-C.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@app.command(help=HELP, context_settings={"help_option_names": ["-h", "--help"]})
def export(
    sequences: Annotated[
        list[Path], typer.Argument(metavar="SEQUENCE", help="Sequences as agents.solve writes them (JSON).")
    ],
    to: Annotated[
        str | None,
        typer.Option(
            help=f"{', '.join(name for name, _, _ in LISTED)}, or my.module:FORMAT.",
            show_default="what --out ends in, or html",
        ),
    ] = None,
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
        float, typer.Option(help="Thickness of the mesh, in units of the unit square, in formats that show it.")
    ] = 0.0,
    size: Annotated[
        float | None,
        typer.Option(
            help="Side of the picture: millimetres (stl, 3mf, dxf; 100) or pixels (png, godot, convex-json; 512).",
            show_default="the format's own",
        ),
    ] = None,
    triangles: Annotated[bool, typer.Option("--triangles", help="Cut faces into triangles (obj).")] = False,
    layers: Annotated[
        bool, typer.Option("--layers", help="All steps (svg), or inner edges (dxf), on layers of their own.")
    ] = False,
    texture: Annotated[
        Path | None,
        typer.Option(metavar="IMAGE", help="The picture on the mesh (obj, gltf).", show_default="none"),
    ] = None,
    half: Annotated[
        bool,
        typer.Option(
            "--half", help="What lies to the right of a symmetric mesh's axis, for a mirror (obj, gltf, blender)."
        ),
    ] = False,
    operators: OutsideOperators = None,
    object_: pictures.Object = "auto",
    background: pictures.Background = None,
    threshold: pictures.Threshold = None,
    alpha_threshold: pictures.AlphaThreshold = None,
    min_speck: pictures.MinSpeck = None,
    keep_specks: pictures.KeepSpecks = False,
    show_mask: pictures.ShowMask = False,
) -> int:
    """Check the options, then write one sequence after the other; return the exit code."""
    from autopoly_env.silhouette import load_silhouette

    sources = list(dict.fromkeys(sequences))
    if out is not None and out.resolve() in {source.resolve() for source in sources}:
        raise ConfigError(f"{out}: is a sequence; give another --out")
    know(operators)
    picture = pictures.read_options(object_, background, threshold, alpha_threshold, min_speck, keep_specks)
    if target is None and (show_mask or pictures.as_dict(picture)):
        raise ConfigError("--object, --show-mask and the like are about the picture of --target; give one")
    made = _choose(to, out, len(sources))
    _refuse_what_is_not_shown(
        made, depth=depth, target=target, size=size, triangles=triangles, layers=layers, texture=texture, half=half
    )
    jobs = list(_name_outputs(sources, out, made.suffix))
    silhouette = load_silhouette(target, options=picture) if target else None
    if silhouette is not None and show_mask:
        print(pictures.save_mask(silhouette, jobs[0][1].with_name(f"{silhouette.name}-{pictures.MASK}")))
    shown = _load_texture(texture) if texture else None
    n_failed = 0
    for source, goal in jobs:
        try:
            _write(made, Export(_load(source, step), silhouette, depth, size, triangles, layers, shown, half), goal)
            print(tame(str(goal)))
        except ConfigError:
            raise
        except AutoPolyError as error:
            complain(str(error) if str(source) in str(error) else f"{source}: {error}", FAILURE)
            n_failed += 1
    return FAILURE if n_failed else 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    return run_command(app, arguments, "python -m agents.export")


def _choose(to: str | None, out: Path | None, n: int) -> Format:
    """The format of `n` sequences: by its name, or by the ending of --out. Raises ConfigError if they contradict."""
    named = None if to is None else find_format(to)
    if out is None or not out.suffix or os.path.isdir(out):
        return named or find_format(DEFAULT)
    if n > 1:  # to go into a folder, which may have a dot in its name
        if any(_ends_as(out, other) for other in formats().values()):
            raise ConfigError(f"--out {out}: one file for {n} sequences; give a folder")
        return named or find_format(DEFAULT)
    if named is None:
        return format_of(out)
    if not _ends_as(out, named):
        endings = " or ".join(named.suffixes)
        raise ConfigError(f"--out {out} with --to {to}: expected a file name that ends in {endings}; leave one out")
    return named


def _ends_as(out: Path, made: Format) -> bool:
    """Whether a file of that format may have such an ending, the last one of it."""
    return out.suffix.lower() in {Path(f"_{suffix}").suffix for suffix in made.suffixes}


_WHY = {"depth": "is flat", "target": "shows no target", "size": "has a size of its own"}


def _refuse_what_is_not_shown(made: Format, **given: Any) -> None:
    """Raise ConfigError for an option that the format does not heed; 0, no and None ask for nothing."""
    for name, value in given.items():
        if value is None or value is False or (name == "depth" and not value) or name in made.heeded:
            continue
        able = ", ".join(other.name for other in formats().values() if name in other.heeded)
        shown = f"--{name}" if value is True else f"--{name} {value}"
        raise ConfigError(f"{shown}: {made.name} {_WHY.get(name, 'has nothing of the kind')}; use it with {able}")


def _write(made: Format, export: Export, goal: Path) -> None:
    """Write a file. Raises OutputError, in one line that names the format and its module, for what a writer may do."""
    module = str(getattr(made.write, "__module__", "an unknown module"))
    who = f"{goal}: the writer of {made.name!r}, of {module}"
    try:
        made.write(export, goal)
    except (ConfigError, OutputError, SequenceError):
        raise
    except Exception as error:  # whatever it is, the other sequences can be written
        what = described(error, module)
        raise OutputError(f"{who}, failed: {what}; expected a file or an OutputError ({_CHECK})") from error
    if not os.path.exists(goal):
        raise OutputError(f"{who}, made no such file ({_CHECK})")


def _load_texture(path: Path) -> "Texture":
    """The picture in a file. Raises SilhouetteError."""
    from autopoly_env.export.texture import load_texture

    return load_texture(path)


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
            goal = source.with_suffix(suffix) if source.name else source / f"sequence{suffix}"
        elif len(sources) == 1 and out.suffix and not os.path.isdir(out):
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
