"""Lessons for the coach in Blender (`blender/autopoly_coach`): a construction with all that there is to say about it.

The file needs no AutoPoly to be read: of each step it has the words and keys, what to point at, how Blender's own
operators are called for it, and which vertices and faces it changes. docs/blender.md lists the fields.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from autopoly_env.export.blender import arguments_of, places_of, rings_of
from autopoly_env.export.byhand import Card, cards_of, picks_of
from autopoly_env.export.formats import Format, register_format
from autopoly_env.export.pictures import picture_url
from autopoly_env.export.player.words import Words, describe_start, describe_step
from autopoly_env.export.replay import finite_meshes, sequence_name
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS
from autopoly_env.sequence import ConstructionSequence, parts_of
from autopoly_env.silhouette import Silhouette

FORMAT, VERSION = "autopoly-lesson", 1
PICTURE_SIZE = 768  # pixels a side of the target, at most


def lesson_of(sequence: ConstructionSequence, target: Silhouette | None = None) -> dict[str, Any]:
    """The lesson as JSON knows it. Raises SequenceError naming the step that cannot be replayed."""
    meshes, cards, parts = finite_meshes(sequence), cards_of(sequence), parts_of(sequence)
    names = parts.names if len(parts.names) > 1 else ("",)
    steps = [_page(describe_start(meshes[0]), cards[0], names[0]) | _changes(None, meshes[0])]
    for number, (step, before, after) in enumerate(zip(sequence.steps, meshes, meshes[1:], strict=False), 1):
        page = _page(describe_step(step, _n_moved(before, after)), cards[number], names[parts.of_steps[number - 1]])
        page["picks"] = picks_of(step, before)
        call = arguments_of(step, before) if step.operator in OPERATORS else None
        page["call"] = None if call is None else [step.operator, call]
        steps.append(page | _changes(before, after))
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": sequence_name(sequence),
        "of": digest_of(sequence.to_json()),
        "picture": "" if target is None else picture_url(target, (255, 255, 255), PICTURE_SIZE).partition(",")[2],
        "steps": steps,
    }


def save_lesson(sequence: ConstructionSequence, path: str | os.PathLike[str], target: Silhouette | None = None) -> Path:
    """Write the lesson, whole or not at all. Raises OutputError, and SequenceError as `lesson_of`."""
    lesson = lesson_of(sequence, target)
    steps = ",\n".join(json.dumps(step, allow_nan=False) for step in lesson.pop("steps"))
    return write_atomically(path, f'{json.dumps(lesson)[:-1]}, "steps": [\n{steps}]}}\n')


def digest_of(text: str) -> str:
    """What tells a sequence from others: its text as it is saved."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def _page(words: Words, card: Card, part: str) -> dict[str, Any]:
    return {
        "operator": card.operator,
        "part": part,
        "title": words.title,
        "done": words.done,
        "why": card.why,
        "menu": words.menu,
        "blender": words.blender,
        "lines": [[line.words, line.state] for line in card.lines],
        "picks": [],
        "aims": {str(name): place for name, place in card.aims.items()},
        "call": None,
    }


def _changes(before: PolyMesh | None, after: PolyMesh) -> dict[str, Any]:
    """Places and faces that are new or others, by id; null for what is gone."""
    return {
        "vertices": _changed({} if before is None else places_of(before), places_of(after)),
        "faces": _changed({} if before is None else rings_of(before), rings_of(after)),
        "next": [after.next_vertex_id, after.next_face_id],
    }


def _changed(before: Mapping[int, Any], after: Mapping[int, Any]) -> dict[str, Any]:
    changed = {str(name): value for name, value in after.items() if before.get(name) != value}
    return changed | {str(name): None for name in before if name not in after}


def _n_moved(before: PolyMesh, after: PolyMesh) -> int:
    """How many vertices are elsewhere after a step."""
    there = places_of(after)
    return sum(there.get(name, place) != place for name, place in places_of(before).items())


register_format(
    Format(
        "coach",
        (".lesson.json",),
        "what the coach in Blender teaches from, the picture with it",
        lambda export, path: save_lesson(export.sequence, path, export.target),
        shows_target=True,
    )
)
