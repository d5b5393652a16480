"""The command `python -m benchmarks.fuzz`: odd inputs by the thousand, or random play, and a table of what came of it.

    python -m benchmarks.fuzz --inputs 100000 --seed 1
    python -m benchmarks.fuzz --episodes 2000 --seed 1
    python -m benchmarks.fuzz --episodes 2000 --game modeller/quads

Exit code 1 if there was an exception that is not the project's own, a message that is too long or not tame, or a state
in random play that crosses itself or has a flipped face.
"""

import argparse
import sys

from autopoly_env.mesh import FaceRule
from benchmarks.fuzz.play import play_many
from benchmarks.fuzz.tally import MOST_BYTES, fuzz, limit_memory, table

GAMES: tuple[tuple[str, FaceRule], ...] = (
    ("paper", "any"),
    ("full", "any"),
    ("modeller", "quads"),
    ("full", "convex"),
    ("modeller", "any"),
)  # presets and rules of faces


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz", description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=0, help="how many odd inputs")
    parser.add_argument("--episodes", type=int, default=0, help="how many episodes of random play of each game")
    parser.add_argument("--game", default="", help="only this preset, or preset/rule, such as modeller/quads")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers")
    given = parser.parse_args(arguments)
    limit_memory(MOST_BYTES)
    tallies = fuzz(given.inputs, given.seed)
    if tallies:
        print(table(tallies), flush=True)
    is_sound = all(tally.is_sound for tally in tallies.values())
    for operators, faces in GAMES if given.episodes else ():
        if given.game not in ("", operators, f"{operators}/{faces}"):
            continue
        played = play_many(operators, given.episodes, given.seed, faces)
        print(f"{operators}/{faces}:", ", ".join(f"{what} {n}" for what, n in vars(played).items()), flush=True)
        is_sound &= not (played.n_crossed or played.n_flipped)
    return 0 if is_sound else 1


if __name__ == "__main__":
    sys.exit(main())
