"""Follows the cards of constructions in real Blender: `python -m benchmarks.cards_in_blender FOLDER ... [--screen]`.

For every `sequence.json` below the folders, what its cards say is done key by key, and compared after each: the mode,
what is selected, and after each card the mesh (counts equal, places within 1e-3, the same faces). Where there is no
screen, keys are calls of what they are bound to, and the knife is stood in for. With `--screen` the knife and the loop
cut are done by the pointer in a window, on the DISPLAY or in Xvfb; with `--events` all keys and clicks are, a second
each. Exit codes: 0 all cards end as told, 1 some do not, 2 wrong usage or no Blender.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.export.byhand import EVENTS, NEED_A_SCREEN, find_screen, prove
from autopoly_env.sequence import ConstructionSequence

SECONDS = 3600.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Follow all cards, print a line for each construction that differs and one for all; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cards_in_blender", description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER", help="as agents.solve writes them")
    parser.add_argument("--screen", action="store_true", help="knife and loop cut with the pointer, in a window")
    parser.add_argument("--events", action="store_true", help="all keys and clicks, too")
    asked = parser.parse_args(arguments)
    paths = sorted({path for folder in asked.folders for path in folder.rglob("sequence.json")})
    try:
        if not paths:
            raise ConfigError(f"no sequence.json below {', '.join(map(str, asked.folders))}; give folders of results")
        screen = find_screen() if asked.screen or asked.events else ()
        if (asked.screen or asked.events) and not screen:
            raise ConfigError("there is no screen; apt-get install xvfb, or set DISPLAY")
        sequences = [ConstructionSequence.load(path) for path in paths]
        events = EVENTS if asked.events else NEED_A_SCREEN
        proofs = prove(sequences, screen=screen, events=events, seconds=SECONDS)
    except AutoPolyError as error:
        print("error:", error, file=sys.stderr)
        return 2
    for path, proof in zip(paths, proofs, strict=True):
        if proof.problems:
            print(f"{path.parent}: {proof.n_cards} of {proof.of} cards; {proof.problems[0]}")
    n_done, n = sum(proof.n_cards for proof in proofs), sum(proof.of for proof in proofs)
    n_acts, n_stand_ins = sum(proof.n_acts for proof in proofs), sum(proof.n_stand_ins for proof in proofs)
    print(
        f"Blender {proofs[0].blender}: {n_done} of {n} cards end as told; {n_acts} acts, "
        f"{n_stand_ins} stood in for; {len(paths)} constructions"
    )
    return int(n_done < n)


if __name__ == "__main__":
    sys.exit(main())
