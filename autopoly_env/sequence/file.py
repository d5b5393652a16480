"""The JSON of a construction sequence: its fields and their types, and one-line errors that name the step."""

import json
import math
from dataclasses import asdict, dataclass
from functools import cache
from typing import Annotated, Any, NoReturn

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, TypeAdapter, ValidationError

from autopoly_env.arguments import first_defect
from autopoly_env.errors import MeshError, SequenceError
from autopoly_env.mesh import PolyMesh, Topology, validate
from autopoly_env.shown import short

FORMAT = "autopoly-construction-sequence"
VERSION = 2  # of sequences whose steps say which part they work on; all others are written as version 1
VERSIONS = (1, VERSION)
MOST_LABEL = 60  # characters
MOST_BYTES = 16_000_000  # of a text
MOST_CORNERS = 20_000  # of a mesh: what looks for crossings takes time by their square
FARTHEST = 1e6  # unit square, of a coordinate: farther out nothing can be computed with
SCORE_KEYS = ("iou", "complexity", "self_intersections", "total")

Id = Annotated[int, Field(strict=True, ge=0, le=2**53)]  # as far as every reader of JSON counts exactly
Coordinate = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-FARTHEST, le=FARTHEST)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
PlainScore = dict[str, Annotated[int, Field(strict=True, ge=-(2**53), le=2**53)] | Number]  # at least SCORE_KEYS
_STRICT = ConfigDict(extra="forbid")


def check_label(label: str) -> str:
    """The label of a part as it is. Raises ValueError if it is not 1 to `MOST_LABEL` printable characters, trimmed."""
    if not 0 < len(label) <= MOST_LABEL or not label.isprintable() or label != label.strip():
        raise ValueError(f"expected 1 to {MOST_LABEL} printable characters, no space around them")
    return label


Label = Annotated[str, Field(strict=True), AfterValidator(check_label)]


@dataclass(frozen=True)
class Step:
    """One action and what came of it; vertices and faces go by their ids.

    `element` is {"edge": [a, b]}, {"face": f}, {"face": f, "vertex": v} for a corner, {"vertex": v}, or
    {"face": f, "sides": k} for a hole. `choice` is {"to": v} for `face_split`, {"points": [[x, y], ...],
    "bridges": [[v, hole corner], [v, hole corner]]} for `face_hole`, otherwise None. `part` is a label such as "left
    leg 2", the same for all steps of a part, or None where nobody has said.
    """

    __pydantic_config__ = _STRICT

    operator: str
    element: dict[str, Id | list[Id]]
    choice: dict[str, Any] | None
    created: dict[str, list[Id]]  # {"vertices": [...], "faces": [...]}
    removed: dict[str, list[Id]]
    moved: tuple[tuple[Id, Coordinate, Coordinate], ...]  # (vertex, x, y) where the operator itself put it elsewhere
    score: PlainScore
    part: Label | None = None


@dataclass(frozen=True)
class _Start:
    __pydantic_config__ = _STRICT

    vertices: list[tuple[Id, Coordinate, Coordinate]]
    faces: list[tuple[Id, list[Id]]]
    next_vertex_id: Id
    next_face_id: Id
    score: PlainScore


@dataclass(frozen=True)
class _Document:
    __pydantic_config__ = _STRICT

    format: str
    version: Annotated[int, Field(strict=True)]
    settings: dict[str, Any]
    start: _Start
    steps: tuple[Step, ...]


@cache
def _reader() -> TypeAdapter[_Document]:
    """Made when a file is read: that takes longer than reading it, and most commands read none."""
    return TypeAdapter(_Document)


def dump_json(settings: dict[str, Any], start: PolyMesh, start_score: PlainScore, steps: tuple[Step, ...]) -> str:
    """The text of a sequence, a step a line. Raises SequenceError for what JSON has not, such as NaN."""
    ids = start.vertex_ids
    start_document = _Start(
        [(ids[v], x, y) for v, (x, y) in enumerate(start.vertices.tolist())],
        [(name, [ids[v] for v in face]) for name, face in zip(start.face_ids, start.faces, strict=True)],
        start.next_vertex_id,
        start.next_face_id,
        start_score,
    )
    version = VERSION if any(step.part is not None for step in steps) else 1
    head = f'{{"format": "{FORMAT}", "version": {version},\n "settings": {plain_json(settings)}'
    lines = ",\n  ".join(plain_json(_plain_step(step)) for step in steps)
    return f'{head},\n "start": {plain_json(asdict(start_document))},\n "steps": [\n  {lines}]}}\n'


def parse_json(text: str) -> tuple[dict[str, Any], PolyMesh, PlainScore, tuple[Step, ...]]:
    """Settings, start mesh, its score and the steps of a text. Raises SequenceError if it is no sequence."""
    if len(text) > MOST_BYTES:
        raise SequenceError(f"the text has {len(text)} letters; expected at most {MOST_BYTES}")
    try:
        data = json.loads(text, parse_constant=_refuse_number, parse_float=_finite)
    except (ValueError, RecursionError) as error:
        raise SequenceError(f"not JSON ({_one_line(error)}); give a construction sequence as saved") from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        found = data.get("format") if isinstance(data, dict) else data
        raise SequenceError(f"the format is {short(found)}, not {FORMAT!r}; give a construction sequence")
    if data.get("version") not in VERSIONS or type(data["version"]) is not int:
        raise SequenceError(f"the version is {short(data.get('version'))}; this release reads versions 1 and 2")
    try:
        document = _reader().validate_python(data)
    except ValidationError as error:
        raise SequenceError(_first_defect(error)) from None
    check_score(document.start.score, "start")
    for number, step in enumerate(document.steps, 1):
        check_score(step.score, f"step {number}")
    return document.settings, _start_mesh(document.start), document.start.score, document.steps


def check_score(score: PlainScore, where: str) -> None:
    """Raise SequenceError if an entry of SCORE_KEYS is missing, or out of its range."""
    missing = [key for key in SCORE_KEYS if key not in score]
    if missing:
        raise SequenceError(f"{where}: the score has no {missing[0]!r}; give {', '.join(SCORE_KEYS)}")
    if not 0.0 <= score["iou"] <= 1.0:
        raise SequenceError(f"{where}: the score's iou is {score['iou']}; expected 0 to 1")
    for key in ("complexity", "self_intersections"):
        if not score[key] >= 0 or score[key] != int(score[key]):
            raise SequenceError(f"{where}: the score's {key} is {score[key]}; expected a whole number from 0")


def plain_json(value: object) -> str:
    """One line of JSON, floats with all their digits. Raises SequenceError for what JSON has not."""
    try:
        return json.dumps(value, allow_nan=False, default=_plain_number)
    except (TypeError, ValueError) as error:
        raise SequenceError(f"cannot be written as JSON ({_one_line(error)}); give finite numbers") from None


def _plain_step(step: Step) -> dict[str, Any]:
    """The fields of a step; `part` only where there is one."""
    values = asdict(step)
    if step.part is None:
        del values["part"]
    return values


def _plain_number(value: object) -> int | float | bool:
    if isinstance(value, np.generic):
        number: int | float | bool = value.item()
        return number
    raise TypeError(f"{type(value).__name__} is no JSON type")


def _start_mesh(start: _Start) -> PolyMesh:
    n_corners = sum(len(names) for _, names in start.faces)
    if n_corners > MOST_CORNERS:
        raise SequenceError(f"start: its faces have {n_corners} corners; expected at most {MOST_CORNERS}")
    index = {name: v for v, (name, _, _) in enumerate(start.vertices)}
    unknown = [(face, v) for face, names in start.faces for v in names if v not in index]
    if unknown:
        raise SequenceError(f"start: face {unknown[0][0]} names vertex {unknown[0][1]}, which does not exist")
    mesh = PolyMesh(
        np.array([(x, y) for _, x, y in start.vertices]).reshape(-1, 2),
        Topology(len(start.vertices), tuple(tuple(index[v] for v in names) for _, names in start.faces)),
        tuple(name for name, _, _ in start.vertices),
        tuple(name for name, _ in start.faces),
        start.next_vertex_id,
        start.next_face_id,
    )
    try:
        validate(mesh)
    except MeshError as error:
        raise SequenceError(f"start: {error}") from None
    return mesh


def _first_defect(error: ValidationError) -> str:
    """The first complaint in one line: which step (from 1), which field, what is wrong."""
    defect = first_defect(error)
    place = defect.place
    step = ""
    if len(place) > 1 and place[0] == "steps":
        step = f"step {int(place[1]) + 1}: "
        place = place[2:]
    return f"{step}{'.'.join(map(str, place)) or 'all of it'}: {defect.problem}"


def _finite(digits: str) -> float:
    number = float(digits)
    if not math.isfinite(number):
        _refuse_number(digits)
    return number


def _refuse_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no finite number")


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
