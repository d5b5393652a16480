"""The command `python -m agents.vary`: variants of a construction, an early step edited and carried on to the end."""

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from agents.commands.operators import FaceRuleOfSequence, OutsideOperators, know
from agents.commands.running import run_command
from agents.commands.starting import INTERRUPTED
from autopoly_env.errors import ConfigError, SequenceError

if TYPE_CHECKING:
    from agents.commands.ctrl_c import CtrlC
    from agents.retell.variants import Variant
    from autopoly_env.arrays import ByteArray
    from autopoly_env.mesh import PolyMesh

SHEET = "variants.png"
CELL_SIZE = 256  # pixels of a mesh on the sheet
MOST = 200  # variants
STOPPED = "stopped by Ctrl-C; the files that were written are whole"

HELP = """Make variants of a construction: an early step is edited, the later ones come along.

\b
Examples:
  python -m agents.vary out/chair/sequence.json
  python -m agents.vary out/chair/sequence.json --n 20 --amount 0.2 --seed 1 --out chairs
  python -m agents.vary out/chair/sequence.json --keep-level

\b
OUT/variants.png shows all of them, the given mesh first. OUT/variant-1/, OUT/variant-2/, ...
get what agents.solve writes: sequence.json, mesh.obj, steps.png, player.html and others.
No mesh on the way crosses itself or has a flipped face; a symmetric outline stays symmetric
(docs/variations.md).

Exit codes: 0 all is well, 1 something failed, 2 wrong usage, 130 Ctrl-C.
"""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich")


@app.command(help=HELP, context_settings={"help_option_names": ["-h", "--help"]})
def vary(
    source: Annotated[Path, typer.Argument(metavar="SEQUENCE", help="A sequence as agents.solve writes it (JSON).")],
    n: Annotated[int, typer.Option("--n", help="How many variants.")] = 8,
    amount: Annotated[float, typer.Option(help="How far an edit pulls, in the unit square.")] = 0.12,
    seed: Annotated[int, typer.Option(help="Of the random numbers.")] = 0,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/variants"),
    keep_level: Annotated[bool, typer.Option("--keep-level", help="Level and plumb edges stay so.")] = False,
    no_symmetry: Annotated[
        bool, typer.Option("--no-symmetry", help="Let left and right differ where they are alike.")
    ] = False,
    operators: OutsideOperators = None,
    faces: FaceRuleOfSequence = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar, no notes.")] = False,
) -> int:
    """Check the options, then draw and write one variant after the other; return the exit code."""
    from agents.commands.ctrl_c import CtrlC
    from agents.commands.progress import TASK, progress_bar
    from agents.commands.results import claim_folder
    from agents.retell.variants import check_sound, draw_variants
    from autopoly_env.sequence import ConstructionSequence

    _check(n, amount, seed)
    know(operators)
    sequence = ConstructionSequence.load(source)
    try:
        sequence = sequence.under(faces)
        check_sound(sequence)
    except SequenceError as error:
        raise SequenceError(f"{source}: {error}") from None
    claim_folder(out)
    variants = draw_variants(sequence, n, amount, seed, keep_level=keep_level, keep_symmetry=not no_symmetry)
    cells, n_failed = [_cell(sequence.final(), "as it was\n")], 0
    with CtrlC() as ctrl_c, progress_bar(n, "variants", is_hidden=quiet) as bar:
        for number, variant in enumerate(variants, 1):
            if variant is None:
                n_failed += 1
            else:
                try:
                    _write(variant, out / f"variant-{number}", ctrl_c)
                except KeyboardInterrupt:  # the second
                    return INTERRUPTED
                cells.append(_cell(variant.sequence.final(), f"variant-{number}\nedited after step {variant.step}"))
            bar.advance(TASK)
            if ctrl_c.n_pressed:
                break
        print(f"{len(cells) - 1} variants\nOpen {_save_sheet(cells, out / SHEET)}")
    if n_failed:
        raise SequenceError(f"{n_failed} of {n} variants were not found; give a smaller --amount, or fewer with --n")
    return INTERRUPTED if ctrl_c.n_pressed else 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; whatever is wrong is told in one line on stderr. Returns the exit code."""
    return run_command(app, arguments, "python -m agents.vary", stopped=STOPPED)


def _check(n: int, amount: float, seed: int) -> None:
    if not 1 <= n <= MOST:
        raise ConfigError(f"--n {n}: expected 1 to {MOST} variants")
    if not 0.0 < amount <= 1.0:
        raise ConfigError(f"--amount {amount}: expected a length in the unit square, above 0, at most 1")
    if seed < 0:
        raise ConfigError(f"--seed {seed}: expected at least 0")


def _write(variant: "Variant", folder: Path, ctrl_c: "CtrlC") -> None:
    """Write what `agents.solve` writes, the variant's own last mesh for its target."""
    from agents.commands.results import write_results
    from autopoly_env.sequence.variation import picture_of

    sequence = variant.sequence
    write_results(folder, sequence, picture_of(sequence.final(), folder.name), ctrl_c.shielded)


def _cell(mesh: "PolyMesh", caption: str) -> "ByteArray":
    from autopoly_env.viewer import draw_mesh

    return draw_mesh(mesh, size=CELL_SIZE, caption=caption)


def _save_sheet(cells: "Sequence[ByteArray]", path: Path) -> Path:
    """Write all cells on one page, about as wide as high."""
    from agents.commands.results import page_of
    from autopoly_env.export import save_png

    return save_png(page_of(cells, math.ceil(len(cells) ** 0.5)), path)


if __name__ == "__main__":
    sys.exit(main())
