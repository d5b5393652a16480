"""Odd values, and documents that are nearly right: what files, options and callers may hold."""

import copy
import json
import math
from typing import Any

import numpy as np

Rng = np.random.Generator

# Each is odd somewhere: too large, of another type, not finite, not printable, not text, very long.
VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 3, 7, 2**31, 2**53, 2**63, -(2**63), 10**20, 10**400, -(10**400),
    0.0, -0.0, 0.5, 1.0, -1.0, 1e-320, 1e6, 1e300, -1e308, math.nan, math.inf, -math.inf,
    "", " ", "0", "1", "nan", "full", "edge_subdivide", "stop", "a" * 5000, "9" * 5000, "\x1b]0;PWN\x07\x1b[2J",
    "b\nc", "\u202egnp", "\udc80", "\0", "../../x", "/", "{}", "[1, 2]", "=", "a=b", "1e-3", "日本",
    [], [[]], [0, 1], [1.5, "x"], {}, {"a": 1}, {"\x1b[2J": 1}, {"to": 2}, {"edge": [0, 1]},
)  # fmt: skip


def odd_value(rng: Rng) -> Any:
    """One of them, sometimes in a list or a mapping."""
    value = copy.deepcopy(VALUES[rng.integers(len(VALUES))])
    if rng.random() < 0.1:
        return [value] * int(rng.integers(1, 4))
    if rng.random() < 0.1:
        return {str(VALUES[rng.integers(28, len(VALUES))])[:40]: value}
    return value


def places_in(document: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The paths of all values in a document of lists and mappings, its own among them."""
    inner = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    return [path, *(place for key, value in inner for place in places_in(value, (*path, key)))]


def mutated(rng: Rng, document: Any) -> Any:
    """A copy with one to three values replaced, left out, doubled, swapped or put in where none was."""
    document = copy.deepcopy(document)
    for _ in range(1 if rng.random() < 0.6 else int(rng.integers(2, 4))):
        places = places_in(document)[1:]
        if not places:
            return odd_value(rng)
        *path, key = places[rng.integers(len(places))]
        holder = document
        for part in path:
            holder = holder[part]
        match int(rng.integers(6)):
            case 0 if isinstance(holder, list):
                holder.insert(int(key), copy.deepcopy(holder[key]))
            case 0:
                holder[str(odd_value(rng))[:40]] = odd_value(rng)
            case 1:
                del holder[key]
            case 2 if isinstance(holder[key], int | float) and not isinstance(holder[key], bool):
                holder[key] = holder[key] + int(rng.integers(-2, 3))
            case 3:
                other = places[rng.integers(len(places))]
                found: Any = document
                for part in other:
                    found = found[part] if isinstance(found, dict | list) and _has(found, part) else None
                holder[key] = copy.deepcopy(found)
            case _:
                holder[key] = odd_value(rng)
    return document


def damaged(rng: Rng, text: str) -> str:
    """A text cut off, with letters changed, or with a piece of it twice."""
    if not text:
        return text
    a, b = sorted(int(i) for i in rng.integers(0, len(text) + 1, 2))
    match int(rng.integers(4)):
        case 0:
            return text[:a]
        case 1:
            return text[:a] + text[b:]
        case 2:
            return text[:b] + text[a:b] + text[b:]
        case _:
            letter = chr(int(rng.choice((0, 9, 10, 27, 34, 44, 58, 91, 93, 123, 125, 45, 46, 48, 101, 233, 0x2028))))
            return text[:a] + letter + text[a + 1 :]


def as_json(document: Any) -> str:
    """The document as JSON, NaN and lone surrogates included."""
    return json.dumps(document)


def yaml_text(rng: Rng, depth: int = 0) -> str:
    """YAML that is mostly odd: tags, anchors, aliases of aliases, dates, numbers of all kinds, brackets."""
    words = (
        "1", "-1", "1e400", "0x" + "f" * 5000, "1:30:00", ".nan", ".inf", "~", "yes", "'", '"', "[", "{", "}", "- a",
        "!!timestamp x", "!!int x", "!!float x", "!!binary x", "!!set {a, b}", "!!python/object/apply:os.system [true]",
        "2001-01-01", "9999-99-99", "&a [*a]", "*b", "<<: 1", "? [a]", "a: b: c", "\t", "\x1b[2J", "\x85", "é",
        "!!omap [a: 1]", "!!pairs [a: 1]", "|\n a\n b", "%YAML 9", "---", "...", "9" * 5000,
    )  # fmt: skip
    if rng.random() < 0.05:
        lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
        lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, int(rng.integers(2, 30)))]
        return "\n".join(lines)
    if rng.random() < 0.02:
        return "[" * int(rng.integers(1, 3000))
    if depth > 2 or rng.random() < 0.4:
        return str(words[rng.integers(len(words))])
    keys = ("targets", "kind", "agents", "agent", "options", "budget", "seeds", "name", "weights", "a", "1")
    indent = "  " * depth
    n = rng.integers(1, 4)
    lines = [f"{indent}{keys[rng.integers(len(keys))]}: {_value(rng, depth)}" for _ in range(n)]
    return "\n".join(lines)


def _value(rng: Rng, depth: int) -> str:
    inner = yaml_text(rng, depth + 1)
    return f"\n{inner}" if ":" in inner and not inner.startswith("!") else inner


def _has(holder: Any, key: Any) -> bool:
    return key in holder if isinstance(holder, dict) else isinstance(key, int) and 0 <= key < len(holder)
