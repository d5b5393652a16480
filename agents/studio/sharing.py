"""The shared file: a picture, what was chosen and wished for, and the construction, in one JSON text.

{"format": "autopoly-studio", "version": 1, "name": "mug", "picture": base64 or null, "object": {...},
 "choices": {...}, "painted": base64 or null, "locked": [3, 5], "sequence": {...} or null}
"""

import base64
import binascii
import json
from dataclasses import asdict, dataclass
from typing import Any

from agents.commands import pictures
from agents.studio.choices import Choices
from agents.studio.painting import check_painted
from agents.studio.reading import options_of
from autopoly_env.errors import SequenceError
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.shown import short
from autopoly_env.silhouette import ObjectOptions

FORMAT, VERSION = "autopoly-studio", 1
SUFFIX = ".studio.json"
MOST_NAME = 120  # letters
MOST_COMMAS = 1_000_000  # of a text: while Python reads JSON, it does nothing else


@dataclass(frozen=True, eq=False)
class Shared:
    """What a shared file holds."""

    name: str
    picture: bytes | None
    options: ObjectOptions
    choices: Choices
    painted: bytes | None
    locked: tuple[int, ...]
    sequence: ConstructionSequence | None


def write_shared(shared: Shared) -> str:
    """The text of the file."""
    sequence = None if shared.sequence is None else json.loads(shared.sequence.to_json())
    values = {
        "format": FORMAT,
        "version": VERSION,
        "name": shared.name,
        "picture": _packed(shared.picture),
        "object": pictures.as_dict(shared.options),
        "choices": asdict(shared.choices),
        "painted": _packed(shared.painted),
        "locked": list(shared.locked),
        "sequence": sequence,
    }
    return json.dumps(values, ensure_ascii=False, allow_nan=False)


def read_shared(text: str) -> Shared | None:
    """What is in the file; None if it says of itself that it is something else.

    Raises SequenceError, ConfigError, for what is none, or not sound.
    """
    if text.count(",") > MOST_COMMAS:
        raise SequenceError(f"more than {MOST_COMMAS:,} values; give a picture, a sequence or a shared file")
    try:
        values = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SequenceError(f"not JSON ({error}); give a picture, a sequence or a shared file") from None
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        return None
    if values.get("version") != VERSION:
        raise SequenceError(f"the version is {short(values.get('version'))}; this release reads version {VERSION}")
    name, locked, sequence = values.get("name"), values.get("locked", []), values.get("sequence")
    if not isinstance(name, str) or not 0 < len(name.strip()) <= MOST_NAME:
        raise SequenceError(f"the name is {short(name)}; expected 1 to {MOST_NAME} letters")
    if not isinstance(locked, list) or not all(type(one) is int and one >= 0 for one in locked):
        raise SequenceError(f"locked is {short(locked)}; expected ids of vertices")
    painted = _unpacked(values, "painted")
    return Shared(
        name,
        _unpacked(values, "picture"),
        options_of(ObjectOptions, values.get("object", {}), "object: "),
        options_of(Choices, values.get("choices", {}), "choices: "),
        None if painted is None else check_painted(painted),
        tuple(locked),
        None if sequence is None else ConstructionSequence.from_json(json.dumps(sequence)),
    )


def _packed(data: bytes | None) -> str | None:
    return None if data is None else base64.b64encode(data).decode("ascii")


def _unpacked(values: dict[str, Any], name: str) -> bytes | None:
    given = values.get(name)
    if given is None:
        return None
    try:
        return base64.b64decode(given, validate=True)
    except (TypeError, ValueError, binascii.Error):
        raise SequenceError(f"{name} is {short(given)}; expected base64") from None
