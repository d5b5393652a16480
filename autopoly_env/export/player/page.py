"""The player: a construction sequence as one HTML page to be watched, stepped through and read aloud.

The page asks for nothing from outside and works from a file. What comes from a sequence (names, scores) is data in it,
never markup or code: it is JSON in a `<script type="application/json">`, and its content security policy lets no
script run but the player's own.
"""

import base64
import hashlib
import html
import json
import os
import re
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.export.byhand import Card, cards_of
from autopoly_env.export.pictures import picture_url
from autopoly_env.export.player.words import Words, describe_lesson, describe_start, describe_step
from autopoly_env.export.replay import finite_meshes
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence, Lesson, Step, parts_of
from autopoly_env.sequence.effort import seconds_of
from autopoly_env.sequence.file import PlainScore
from autopoly_env.sequence.ids import decoded
from autopoly_env.silhouette import Silhouette

DIGITS = 5  # of a coordinate: a hundredth of a pixel on a screen
MOVED = 0.002  # unit square; a vertex that moves less is not shown as moved
FARTHEST = 10.0  # unit square; what lies farther out is not brought into view
TARGET_SIZE = 768  # pixels a side of the target in the page, at most
LOOK, WORK = ("look.css", "player.css"), ("drawing.js", "player.js")  # the first of each is the studio's as well
MARKED_CHARACTERS = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}


def to_html(sequence: ConstructionSequence, target: Silhouette | None = None) -> str:
    """The page as text; it opens at the last step, or at step k where its address ends in `#step-k`.

    Raises SequenceError if the replay fails.
    """
    title = _title(sequence, target)
    style, script = (part_of(shared) + part_of(own) for shared, own in (LOOK, WORK))
    parts = {
        "title": html.escape(title),
        "policy": f"default-src 'none'; img-src data:; style-src '{_digest(style)}'; script-src '{_digest(script)}'",
        "style": style,
        "script": script,
        "data": _script_json(_page_data(sequence, target, title)),
    }
    # in one pass over the template, so that nothing inside the parts is taken for a mark
    return re.sub(r"\{\{(\w+)\}\}", lambda mark: parts[mark[1]], part_of("player.html"))


def save_html(sequence: ConstructionSequence, path: str | os.PathLike[str], target: Silhouette | None = None) -> Path:
    """Write the page, whole or not at all. Raises OutputError if it cannot be written, SequenceError as `to_html`."""
    return write_atomically(path, to_html(sequence, target))


def to_frame(sequence: ConstructionSequence, height: int = 620) -> str:
    """The page inside an `<iframe>` of `height` pixels, cut off from the page around it, as notebooks show it."""
    name = html.escape(f"Construction of {_title(sequence, None)}")
    return (
        f'<iframe title="{name}" sandbox="allow-scripts" width="100%" height="{height}" '
        f'style="border: 0; border-radius: 8px" srcdoc="{html.escape(to_html(sequence))}"></iframe>'
    )


@cache
def part_of(name: str) -> str:
    """A file of the page, as text."""
    return (files(__package__) / name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    """What a content security policy calls an inline style or script."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii")


def _script_json(data: dict[str, Any]) -> str:
    """JSON that may stand inside a script element: no character in it can end that, or begin a comment."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return re.sub("[<>&\u2028\u2029]", lambda match: MARKED_CHARACTERS[match[0]], text)


def _title(sequence: ConstructionSequence, target: Silhouette | None) -> str:
    names = (sequence.settings.get("target"), target.name if target else None, "construction")
    name = next(name for name in names if isinstance(name, str) and name.strip())
    return name.encode("utf-8", "replace").decode("utf-8")  # half a surrogate pair has no UTF-8


def _page_data(sequence: ConstructionSequence, target: Silhouette | None, title: str) -> dict[str, Any]:
    meshes = finite_meshes(sequence)
    parts = parts_of(sequence)
    cards = cards_of(sequence)
    steps = [_pose(sequence.start, sequence.start_score, describe_start(sequence.start), cards[0])]
    steps[0]["part"] = parts.names[0]
    for number, (before, step, after) in enumerate(zip(meshes, sequence.steps, meshes[1:], strict=False), 1):
        motion = _motion(before, step, after)
        steps.append(_pose(after, step.score, describe_step(step, len(motion["moved"])), cards[number]) | motion)
        steps[-1]["seconds"] = round(seconds_of(step, before, after), 2)
        steps[-1]["part"] = parts.name(number)
    lost = sequence.settings.get("lost")
    if isinstance(lost, str):
        steps[-1]["done"] = f"{steps[-1]['done']} Note: {lost}."
    return {
        "title": title,
        "lesson": describe_lesson(Lesson.of(sequence), len(parts.names)),
        "box": _box(meshes, target),
        "target": None if target is None else picture_url(target, (255, 255, 255), TARGET_SIZE),
        "steps": steps,
    }


def _pose(mesh: PolyMesh, score: PlainScore, words: Words, card: Card) -> dict[str, Any]:
    """What the page knows of a step: where everything is after it, what it is worth and what there is to say."""
    ids = mesh.vertex_ids
    return {
        "vertices": {name: _rounded(point) for name, point in zip(ids, mesh.vertices, strict=True)},
        "faces": {name: [ids[v] for v in face] for name, face in zip(mesh.face_ids, mesh.faces, strict=True)},
        "counts": mesh.counts,
        "iou": score["iou"],
        "crossings": score["self_intersections"],
        "total": score["total"],
        "title": words.title,
        "done": words.done,
        "lines": [{"words": line.words, "state": line.state} for line in card.lines],
        "picks": card.picks,
        "aims": {name: _rounded(np.array((x, 1.0 - y))) for name, (x, y) in card.aims.items()},
        "why": card.why,
        "menu": words.menu,
        "blender": words.blender,
    }


def _motion(before: PolyMesh, step: Step, after: PolyMesh) -> dict[str, Any]:
    """How the vertices came there: where new ones grow from, where the operator puts them, where lost ones go."""
    operator, element, choice = decoded(before, step)
    made = operator.apply(before, element, choice)
    new = [made.vertex_index(name) for name in step.created["vertices"]]
    sources = _sources(operator.sources_of(before, element, choice, made), made.vertices[new])
    put = {
        name: [*_rounded(source), *_rounded(made.vertices[v])]
        for name, v, source in zip(step.created["vertices"], new, sources, strict=True)
    }
    lost = step.removed["vertices"] if operator.takes == "vertex" else []
    way = np.hypot(*(after.vertices - made.vertices).T)
    return {
        "put": put,
        "lost": {name: _rounded(_foot(before, before.vertex_index(name))) for name in lost},
        "moved": [name for name, length in zip(after.vertex_ids, way, strict=True) if length >= MOVED],
        "takes": operator.takes or None,
    }


def _sources(sources: FloatArray, put: FloatArray) -> FloatArray:
    """(n, 2) where the new vertices grow out of; out of their middle, if the operator puts them all where they are."""
    if len(put) > 1 and np.array_equal(sources, put):
        return np.broadcast_to(put.mean(axis=0), put.shape)
    return sources


def _foot(mesh: PolyMesh, vertex: int) -> FloatArray:
    """Where a vertex with two edges lies when they have become one: the nearest point between its neighbours."""
    a, b = mesh.vertices[[int(edge.sum()) - vertex for edge in mesh.edges if vertex in edge]]
    along = b - a
    share = np.dot(mesh.vertices[vertex] - a, along) / max(float(np.dot(along, along)), 1e-12)
    foot: FloatArray = a + np.clip(share, 0.0, 1.0) * along
    return foot


def _box(meshes: list[PolyMesh], target: Silhouette | None) -> list[float]:
    """[x, y, width, height] of all that is ever shown, in the unit square."""
    points = [mesh.vertices for mesh in meshes]
    if target is not None:
        rows, columns = (np.flatnonzero(target.mask.any(axis=axis)) for axis in (1, 0))
        points.append(np.array([(columns[0], rows[0]), (columns[-1] + 1, rows[-1] + 1)]) / target.resolution)
    shown = np.clip(np.vstack(points), -FARTHEST, FARTHEST)
    low, high = shown.min(axis=0), shown.max(axis=0)
    return [*_rounded(low), *_rounded(np.maximum(high - low, 0.05))]


def _rounded(point: FloatArray) -> list[float]:
    return [round(float(value), DIGITS) + 0.0 for value in point]
