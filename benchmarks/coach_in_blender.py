"""Has the coach teach in real Blender: `python -m benchmarks.coach_in_blender FOLDER ...`.

Every `sequence.json` below the folders becomes a lesson. The coach is packed, installed in a Blender of its own
settings, and watches two pupils: one does what the cards say, key by key, and has to be accepted at every step; one
makes every error of a list at every step, of which none may be accepted and each has to be named. With `--events` the
first one alone comes, and presses every key and clicks every click in a window, on the DISPLAY or in Xvfb. Exit codes:
0 all as it has to be, 1 not, 2 wrong usage or no Blender.
"""

import argparse
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.export import byhand
from autopoly_env.export.blender import ask_blender
from autopoly_env.export.byhand import cards_of, find_screen
from autopoly_env.export.coach import save_lesson
from autopoly_env.sequence import ConstructionSequence
from blender.build import build

PUPIL = Path(__file__).with_name("coach_pupil.py")
SECONDS = 3600.0
WINDOW = ("1500", "1400")  # pixels


def teach(
    sequences: Sequence[ConstructionSequence], *, screen: Sequence[str] = (), seconds: float = SECONDS
) -> list[dict[str, Any]]:
    """What came of the lesson of each sequence, as `coach_pupil` tells it; with a `screen`, by keys and clicks.

    Raises ConfigError if there is no Blender, OutputError if it breaks down, SequenceError for what does not replay.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        lessons = []
        for number, sequence in enumerate(sequences):
            path = save_lesson(sequence, folder / f"{number}.lesson.json")
            acts = [[act for line in card.lines for act in line.acts] for card in cards_of(sequence)]
            lessons.append({"path": str(path), "cards": acts})
        question = {
            "zip": str(build(folder)),
            "byhand": str(Path(byhand.__file__).parent),
            "lessons": lessons,
        }
        kept = {name: os.environ.get(name) for name in ("BLENDER_USER_RESOURCES", "BLENDER_USER_SCRIPTS")}
        os.environ |= {"BLENDER_USER_RESOURCES": str(folder / "own"), "BLENDER_USER_SCRIPTS": str(folder / "own")}
        try:
            answers: list[dict[str, Any]] = ask_blender(
                PUPIL,
                question,
                what="lessons",
                seconds=seconds,
                screen=screen,
                look=("--enable-event-simulate", "--window-geometry", "0", "0", *WINDOW) if screen else ("-b",),
                options=("--events",) if screen else (),
                ends_well=False,
            )
        finally:
            for variable, value in kept.items():
                os.environ.pop(variable)
                os.environ |= {} if value is None else {variable: value}
        return answers


def problems_of(answer: dict[str, Any]) -> list[str]:
    """What is not as it has to be, a line each."""
    pupil = answer["pupil"]
    told = [] if pupil["accepted"] == pupil["of"] else [f"a right step is not accepted: {pupil['problem']}"]
    for error in answer["errors"]:
        what = f"step {error['step']}, {error['kind']}"
        if error["is_accepted"]:
            told.append(f"{what}: is accepted")
        told += [f"{what}: no {word!r} in {error['said']!r}" for word in error["names"] if word not in error["said"]]
    return told


def main(arguments: Sequence[str] | None = None) -> int:
    """Teach all lessons, print what differs and a line for all; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.coach_in_blender", description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER", help="as agents.solve writes them")
    parser.add_argument("--events", action="store_true", help="keys and clicks, in a window; a second each")
    asked = parser.parse_args(arguments)
    folders: list[Path] = asked.folders
    paths = sorted({path for folder in folders for path in folder.rglob("sequence.json")})
    try:
        if not paths:
            raise ConfigError(f"no sequence.json below {', '.join(map(str, folders))}; give folders of results")
        screen = find_screen() if asked.events else ()
        if asked.events and not screen:
            raise ConfigError("there is no screen; apt-get install xvfb, or set DISPLAY")
        answers = teach([ConstructionSequence.load(path) for path in paths], screen=screen)
    except AutoPolyError as error:
        print("error:", error, file=sys.stderr)
        return 2
    n_problems = 0
    for path, answer in zip(paths, answers, strict=True):
        told = problems_of(answer)
        n_problems += len(told)
        for line in told[:3]:
            print(f"{path.parent}: {line}")
    errors = [error for answer in answers for error in answer["errors"]]
    n_named = sum(all(word in error["said"] for word in error["names"]) for error in errors)
    print(
        f"Blender {answers[0]['blender']}: {len(paths)} lessons; the pupil who does as told: "
        f"{sum(a['pupil']['accepted'] for a in answers)} of {sum(a['pupil']['of'] for a in answers)} steps accepted, "
        f"{sum(a['pupil']['stood_in'] for a in answers)} acts stood in for; the one who errs: "
        f"{sum(e['is_accepted'] for e in errors)} of {len(errors)} errors accepted, {n_named} named"
    )
    print("; ".join(f"{kind} {n}" for kind, n in Counter(error["kind"] for error in errors).items()))
    return int(n_problems > 0)


if __name__ == "__main__":
    sys.exit(main())
