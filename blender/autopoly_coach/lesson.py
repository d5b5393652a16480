"""A lesson as the file has it, read with suspicion: what is none is refused in one line, and nothing of it is run."""

import base64
import binascii
import hashlib
import json
import math
import os
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn

FORMAT, VERSION = "autopoly-lesson", 1
SEQUENCE = "autopoly-construction-sequence"
MOST_BYTES = 16_000_000
MOST_STEPS = 2_000
MOST_WORK = 500_000  # vertices and faces of all meshes
MOST_VERTICES = 2_000  # of one mesh: the coach compares all with all that are near
MOST_PIXELS = 4_096  # a side of the picture
MOST_LETTERS = 2_000  # of a text
MOST_LINES = 200  # of a card
MOST_SHOWN = 60  # letters of what was given, in a message
FARTHEST = 1e6
KINDS = {"vertex": (1, 1), "edge": (2, 2), "face": (1, MOST_VERTICES)}  # how many ids name one

Ids = tuple[int, ...]
Place = tuple[float, float]


class LessonError(Exception):
    """What was given is no lesson; one line says why."""


@dataclass(frozen=True)
class Step:
    """One step: what to do, and the mesh after it. The first of a lesson is its start."""

    operator: str
    title: str
    part: str  # "" where there is but one
    done: str
    why: str
    menu: str
    blender: str  # the name of Blender's operator
    lines: tuple[tuple[str, str], ...]  # what to do, what Blender is like then
    picks: tuple[tuple[str, Ids], ...]  # what to point at of the mesh before
    aims: dict[int, Place]  # where vertices have to come
    call: tuple[str, tuple[Any, ...]] | None  # of what Blender is asked for; None where nobody knows
    vertices: dict[int, Place]  # all, x right, y up
    faces: dict[int, Ids]  # all, counter-clockwise
    next_ids: tuple[int, int]  # of the next vertex and face

    @property
    def counts(self) -> tuple[int, int, int]:
        """How many vertices, edges and faces there are."""
        return len(self.vertices), len(self.edges), len(self.faces)

    @property
    def edges(self) -> set[Ids]:
        """The sides of all faces, the lower id first."""
        rings = self.faces.values()
        return {(min(a, b), max(a, b)) for ring in rings for a, b in pairwise((*ring, ring[0]))}


@dataclass(frozen=True)
class Lesson:
    """A construction to be learnt."""

    name: str
    of: str  # the digest of the sequence that it was made of
    picture: bytes  # a PNG, or nothing
    steps: tuple[Step, ...]  # the start, then each step

    @property
    def last(self) -> int:
        """The number of the last step."""
        return len(self.steps) - 1


def digest_of(text: str) -> str:
    """What tells a sequence from others."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def read(path: str | os.PathLike[str]) -> str:
    """The text of a file. Raises LessonError if it cannot be read, is too large, or is no text."""
    try:
        if not os.path.isfile(path):
            raise LessonError(f"{path} is not there; choose a .lesson.json, or the lesson.json of a result")
        with open(path, "rb") as stream:
            data = stream.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise LessonError(f"{Path(path).name} has more than {MOST_BYTES} bytes; a lesson has fewer")
        return data.decode("utf-8")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise LessonError(f"{Path(path).name} cannot be read ({reason}); choose a .lesson.json") from None


def format_of(text: str) -> str:
    """What a text says it is. Raises LessonError if it is no JSON, or says nothing."""
    data = _object(text)
    found = data.get("format")
    if not isinstance(found, str):
        raise LessonError("this JSON does not say that it is a lesson; choose a .lesson.json of AutoPoly")
    return found


def parse(text: str) -> Lesson:
    """The lesson in a text. Raises LessonError, which names the step."""
    data = _object(text)
    if data.get("format") != FORMAT:
        raise LessonError(f"the format is {_short(data.get('format'))}, not {FORMAT!r}; choose a .lesson.json")
    if data.get("version") != VERSION or isinstance(data["version"], bool):
        raise LessonError(
            f"the lesson has version {_short(data.get('version'))}, and this coach reads {VERSION}; "
            "write it anew with the AutoPoly that the coach is from"
        )
    steps: list[Step] = []
    vertices: dict[int, Place] = {}
    faces: dict[int, Ids] = {}
    work = 0
    found = data.get("steps")
    if not isinstance(found, list) or not 1 <= len(found) <= MOST_STEPS:
        raise LessonError(f"the lesson has no list of 1 to {MOST_STEPS} steps; write it anew")
    for number, step in enumerate(found):
        try:
            steps.append(_step(step, vertices, faces))
        except (LessonError, AttributeError, LookupError, TypeError, ValueError, OverflowError) as error:
            reason = str(error) if isinstance(error, LessonError) else "a field is missing, or not what it should be"
            raise LessonError(f"step {number} of the lesson is damaged ({reason}); write it anew") from None
        vertices, faces = steps[-1].vertices, steps[-1].faces
        work += len(vertices) + len(faces)
        if work > MOST_WORK:
            raise LessonError(
                f"up to step {number} there are {work} vertices and faces; a lesson has {MOST_WORK} at most"
            )
    try:
        picture = _png(base64.b64decode(_text(data["picture"], MOST_BYTES), validate=True))
        return Lesson(_text(data["name"]), _text(data["of"]), picture, tuple(steps))
    except (LessonError, KeyError, binascii.Error) as error:
        raise LessonError(f"the head of the lesson is damaged ({_short(str(error))}); write it anew") from None


def _png(data: bytes) -> bytes:
    """A PNG of a size that can be shown, or nothing."""
    size = [int.from_bytes(data[k : k + 4], "big") for k in (16, 20)]
    if data and not (data.startswith(b"\x89PNG\r\n\x1a\n") and all(0 < side <= MOST_PIXELS for side in size)):
        raise LessonError(f"its picture is no PNG of at most {MOST_PIXELS} pixels a side")
    return data


def _object(text: str) -> dict[str, Any]:
    try:
        data = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError):
        raise LessonError("this is no JSON, or only a piece of it; choose a .lesson.json of AutoPoly") from None
    if not isinstance(data, dict):
        raise LessonError("this JSON is no lesson; choose a .lesson.json of AutoPoly")
    return data


def _no_number(name: str) -> NoReturn:
    raise ValueError(name)


def _step(data: dict[str, Any], vertices: dict[int, Place], faces: dict[int, Ids]) -> Step:
    """A step after a mesh."""
    after = _changed(vertices, {_id(name): _place(at) for name, at in data["vertices"].items()})
    rings = _changed(faces, {_id(name): _ring(ring) for name, ring in data["faces"].items()})
    _check_mesh(after, rings)
    next_vertex, next_face = data["next"]
    aims = {_id(name): _place(at) for name, at in data["aims"].items()}
    call, lines = data["call"], data["lines"]
    if not isinstance(lines, list) or len(lines) > MOST_LINES:
        raise LessonError(f"it has more than {MOST_LINES} lines")
    return Step(
        operator=_text(data["operator"]),
        title=_text(data["title"]),
        part=_text(data["part"]),
        done=_text(data["done"]),
        why=_text(data["why"]),
        menu=_text(data["menu"]),
        blender=_text(data["blender"]),
        lines=tuple((_text(words), _text(state)) for words, state in lines),
        picks=tuple(_pick(kind, ids, vertices, faces) for kind, ids in data["picks"]),
        aims={v: place for v, place in aims.items() if place is not None and v in after},
        call=None if call is None else (_text(call[0]), tuple(call[1])),
        vertices=after,
        faces=rings,
        next_ids=(_id(next_vertex), _id(next_face)),
    )


def _changed(before: dict[int, Any], changes: dict[int, Any]) -> dict[int, Any]:
    return {name: value for name, value in {**before, **changes}.items() if value is not None}


def _check_mesh(vertices: dict[int, Place], faces: dict[int, Ids]) -> None:
    if not faces or len(vertices) > MOST_VERTICES:
        raise LessonError(f"its mesh has {len(vertices)} vertices and {len(faces)} faces")
    used = {v for ring in faces.values() for v in ring}
    if used != vertices.keys():
        raise LessonError("its faces name other vertices than there are")
    sides: dict[Ids, int] = {}
    for ring in faces.values():
        for side in pairwise((*ring, ring[0])):
            sides[side] = sides.get(side, 0) + 1
    if max(sides.values()) > 1:
        raise LessonError("two of its faces run along an edge the same way")


def _pick(kind: str, ids: list[int], vertices: dict[int, Place], faces: dict[int, Ids]) -> tuple[str, Ids]:
    fewest, most = KINDS[kind]
    names = tuple(map(_id, ids))
    if not fewest <= len(names) <= most:
        raise LessonError(f"{kind} {_short(ids)} is none")
    known = faces if kind == "face" and len(names) == 1 else vertices
    if any(name not in known for name in names):
        raise LessonError(f"{kind} {_short(ids)} is not there")
    return kind, names


def _ring(ring: Any) -> Ids | None:
    if ring is None:
        return None
    names = tuple(map(_id, ring))
    if len(names) < 3 or len(set(names)) < len(names):
        raise LessonError(f"face {_short(ring)} is none")
    return names


def _place(at: Any) -> Place | None:
    if at is None:
        return None
    x, y = at
    if any(isinstance(value, bool) or not isinstance(value, (int, float)) for value in (x, y)):
        raise LessonError(f"place {_short(at)} is none")
    if not (math.isfinite(x) and math.isfinite(y) and max(abs(x), abs(y)) <= FARTHEST):
        raise LessonError(f"place {_short(at)} is too far away")
    return float(x), float(y)


def _id(name: Any) -> int:
    if isinstance(name, str) and name.isascii() and name.isdigit() and len(name) < 10:
        return int(name)
    if isinstance(name, int) and not isinstance(name, bool) and 0 <= name < 2**30:  # Blender's attributes have 32 bits
        return name
    raise LessonError(f"id {_short(name)} is none")


def _text(value: Any, most: int = MOST_LETTERS) -> str:
    if not isinstance(value, str) or len(value) > most:
        raise LessonError(f"{_short(value)} is no text of at most {most} letters")
    return value if value.isprintable() else "".join(sign if sign.isprintable() else " " for sign in value)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= MOST_SHOWN else text[: MOST_SHOWN - 1] + "…"
