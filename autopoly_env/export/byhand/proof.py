"""Cards proved: real Blender does what they say, act by act, and has then what they say, and the sequence's meshes."""

import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from autopoly_env.export.blender import ask_blender
from autopoly_env.export.byhand.cards import Card, cards_of
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence

EVENTS = ("mode", "nothing", "click", "drag", "press", "loop", "cut")  # acts that can be events
NEED_A_SCREEN = ("loop", "cut")  # of these
WINDOW = 1500, 1400  # pixels; the knife is as exact as the pointer
DRIVER = Path(__file__).with_name("driver.py")
TOLERANCE = 1e-3  # of a coordinate, unit square
SAME = 3e-3  # between where an element is told to be and where it is found


@dataclass(frozen=True)
class Proof:
    """What came of the cards of one sequence."""

    n_cards: int  # done as told, from the first on, each ending in the sequence's mesh
    of: int
    n_acts: int
    n_stand_ins: int  # acts that Blender cannot do without a screen, done for it
    problems: tuple[str, ...]  # a line each
    blender: str  # its version


def find_screen() -> tuple[str, ...]:
    """What a program is started with so that it has a window: the DISPLAY, or Xvfb's own; () where there is neither."""
    if os.environ.get("DISPLAY"):
        return ("env",)
    width, height = WINDOW
    return ("xvfb-run", "-a", "-s", f"-screen 0 {width}x{height}x24") if shutil.which("xvfb-run") else ()


def prove(
    sequences: Sequence[ConstructionSequence],
    *,
    screen: Sequence[str] = (),
    events: Sequence[str] = EVENTS,
    seconds: float = 600.0,
) -> list[Proof]:
    """Follow the cards of each sequence in one Blender.

    Without a window the keys are calls of what they are bound to. With a `screen`, as `find_screen` gives it, the acts
    named in `events` are events of mouse and keyboard, which take a second each; menus are calls there, too.
    Raises ConfigError if there is no Blender, OutputError if it breaks down or takes longer than `seconds`,
    SequenceError if a sequence cannot be replayed.
    """
    decks = [cards_of(sequence) for sequence in sequences]
    acts = [[[act for line in card.lines for act in line.acts] for card in deck] for deck in decks]
    answers = _asked(acts, screen, events, seconds)
    return [_proof(*each) for each in zip(sequences, decks, answers, strict=True)]


def _asked(
    acts: list[list[list[dict[str, Any]]]], screen: Sequence[str], events: Sequence[str], seconds: float
) -> list[dict[str, Any]]:
    window = ("--enable-event-simulate", "--window-geometry", "0", "0", *map(str, WINDOW))
    answers: list[dict[str, Any]] = ask_blender(
        DRIVER,
        acts,
        what="cards",
        seconds=seconds,
        screen=screen,
        look=window if screen else ("-b",),
        options=("--events", ",".join(events)) if screen else (),
        ends_well=False,
    )
    return answers


def _proof(sequence: ConstructionSequence, deck: list[Card], answer: dict[str, Any]) -> Proof:
    problems: list[str] = []
    n_done = n_acts = 0
    for number, (card, mesh, found) in enumerate(zip(deck, sequence.meshes(), answer["cards"], strict=False)):
        where = f"card {number} ({card.operator})"
        acts = [act for line in card.lines for act in line.acts]
        told = [f"{where}, act {k}: {what}" for k, what in enumerate(map(_untrue, acts, found["states"]), 1) if what]
        if "counts" in found:
            told += [f"{where}: {what}" for what in _other_mesh(mesh, found)]
        else:
            told.append(f"{where}, act {len(found['states']) + 1}: {answer['problem']}")
        n_acts += len(found["states"])
        n_done += not (told or problems)
        problems += told
    return Proof(n_done, len(deck), n_acts, answer["stand_ins"], tuple(problems), answer["blender"])


def _untrue(act: dict[str, Any], state: dict[str, Any]) -> str:
    """What Blender is like otherwise than an act says, or nothing."""
    if act["mode"] != state["mode"]:
        return f"Blender is in {state['mode']} mode, not in {act['mode']} mode"
    told, found = act["selected"], state["selected"]
    n_same = sum(any(_same_places(element, other) for other in found) for element in told)
    if n_same == len(told) == len(found):
        return ""
    keys = " ".join(act.get("keys", ()))
    return f"{act['do']} {keys}: of {len(told)} elements {n_same} are selected, and {len(found)} in all"


def _same_places(a: list[list[float]], b: list[list[float]]) -> bool:
    if len(a) != len(b):
        return False
    away = np.abs(np.array(a)[:, None] - np.array(b)[None]).max(axis=-1)
    return bool((away.min(axis=0) <= SAME).all() and (away.min(axis=1) <= SAME).all())


def _other_mesh(mesh: PolyMesh, found: dict[str, Any]) -> list[str]:
    """What differs between a mesh and what Blender has: counts, places, faces."""
    if tuple(found["counts"]) != mesh.counts:
        return [f"(V, E, F) is {tuple(found['counts'])}, not {mesh.counts}"]
    there = np.array(found["vertices"])
    away = np.abs((mesh.vertices * (1, -1) + (0, 1))[:, None] - there[None]).max(axis=-1)
    partner = _matched(away)
    off = float(away[np.arange(len(away)), partner].max())
    if not off <= TOLERANCE:
        return [f"a vertex lies {off:.1e} off"]
    ours = {frozenset(int(partner[v]) for v in face) for face in mesh.faces}
    return [] if ours == {frozenset(face) for face in found["faces"]} else ["the faces are others"]


def _matched(away: np.ndarray) -> np.ndarray:
    """(V,) for each row the column that is nearest and still free."""
    left, partner = away.copy(), np.zeros(len(away), np.int64)
    for _ in range(len(away)):
        row, column = np.unravel_index(int(np.argmin(left)), left.shape)
        partner[row] = column
        left[row], left[:, column] = np.inf, np.inf
    return partner
