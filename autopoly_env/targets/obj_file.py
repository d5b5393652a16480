"""Wavefront OBJ as it is found in the wild: the polygons of all groups, and nothing else of what it may say."""

import os
from array import array
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from autopoly_env.errors import SilhouetteError
from autopoly_env.targets.projection import Surface


def read_obj(path: str | os.PathLike[str]) -> Surface:
    """The polygons in an OBJ file: triangles, quads and n-gons; corners `v`, `v/t`, `v//n`, `v/t/n`, also negative.

    Faces with fewer than three corners are left out; groups, materials, normals, curves are passed over. Raises
    SilhouetteError, with the number of the line, for a file that cannot be read, has no faces, or is broken: a vertex
    without three finite coordinates, a corner that names no vertex.
    """
    coordinates, corners, ends = array("d"), array("q"), array("q", [0])
    try:
        with Path(path).open(encoding="utf-8", errors="replace") as stream:
            for number, words in _statements(stream):
                try:
                    if words[0] == "v":
                        coordinates.extend((float(words[1]), float(words[2]), float(words[3])))
                    elif words[0] == "f" and len(words) > 3:
                        corners.extend([_corner(word, len(coordinates) // 3) for word in words[1:]])
                        ends.append(len(corners))
                except (ValueError, IndexError, OverflowError):
                    text = " ".join(words)
                    raise SilhouetteError(f"{path}, line {number}: {_short(text)} is no vertex or face") from None
    except OSError as error:
        raise SilhouetteError(f"cannot read {path} ({error.strerror}); give a Wavefront OBJ file") from None
    surface = Surface(np.array(coordinates).reshape(-1, 3), np.array(corners, np.int64), np.array(ends, np.int64))
    _check(surface, path)
    return surface


def _statements(lines: Iterable[str]) -> Iterator[tuple[int, list[str]]]:
    """(number of its last line, words) of every statement that has any; a backslash carries one on."""
    words: list[str] = []
    for number, line in enumerate(lines, 1):
        words += line.partition("#")[0].split()
        if words and words[-1].endswith("\\"):
            words[-1] = words[-1][:-1]
            words = [word for word in words if word]
        elif words:
            yield number, words
            words = []


def _corner(word: str, n_vertices: int) -> int:
    """The vertex that a corner names; negative numbers count back from the last vertex so far."""
    index = int(word.partition("/")[0])
    if index == 0 or index < -n_vertices:
        raise ValueError
    return index - 1 if index > 0 else n_vertices + index


def _check(surface: Surface, path: str | os.PathLike[str]) -> None:
    if not len(surface.corners):
        raise SilhouetteError(f"{path} has no faces; give a Wavefront OBJ file with a surface")
    n_vertices = len(surface.vertices)
    if surface.corners.max() >= n_vertices:
        f = int(np.searchsorted(surface.ends, surface.corners.argmax(), "right"))
        raise SilhouetteError(
            f"{path}: face {f} names vertex {surface.corners.max() + 1} of {n_vertices}; is it cut off?"
        )
    if not np.isfinite(surface.vertices[surface.corners]).all():
        raise SilhouetteError(f"{path} has a vertex that is not finite; repair it")


def _short(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")
