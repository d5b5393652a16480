"""Masks that are the wrong way round although most of the border says so: objects that fill or leave the picture."""

from dataclasses import replace

import numpy as np

from autopoly_env.arrays import BoolArray, Float32Array, IntArray
from autopoly_env.silhouette.background import SAME, border
from autopoly_env.silhouette.cleaning import parts
from autopoly_env.silhouette.opinion import Opinion

CORNER_SHARE = 0.03  # of the picture: a corner is no larger
TILE_CORNERS = 0.015  # of the picture, all four together: they show the shape of a tile
NOTCHES = (0.08, 0.5)  # share of the border that notches take
PAPER, INK = 0.3, 0.7  # how much lighter than the object, and how light at least, paper is


def righted(found: Opinion, features: Float32Array) -> Opinion:
    """The opinion turned inside out where its object is only what a larger object leaves free along the border.

    - Four alike corners, and perhaps something inside: an object that fills the picture, such as a disc or a tile; but
      if the corners are tiny, those of a page, and no object.
    - Light notches along the border, around a dark shape that is whole: ink on paper that reaches the border.
    """
    if not border(found.mask).any() or min(found.mask.shape) < 8:
        return found
    labels, n_parts = parts(found.mask)
    if n_parts < 2:
        return found
    corners = _corner_parts(labels, features)
    if corners is not None:
        is_corner = np.isin(labels, corners)
        if n_parts == len(corners):
            return _turned(found, "the object fills the picture, its corners are background")
        if is_corner.mean() >= TILE_CORNERS:
            turned = _turned(replace(found, mask=is_corner), "the object is a tile, whose corners are background")
            return turned.saying("something is drawn on it, which that takes alone")
        return replace(
            found,
            mask=found.mask & ~is_corner,
            notes=(*found.notes, "the corners of the picture are no part of the object: --object takes them in"),
        )
    if _are_notches(found.mask, labels, n_parts, features):
        return _turned(found, "the object reaches the border, which is mostly its own")
    return found


def _turned(found: Opinion, reason: str) -> Opinion:
    side = "light" if any("lighter" in note for note in found.notes) else "dark"
    notes = [note for note in found.notes if not note.startswith("object is ")]
    said = f"object is inside out of what the border says: {reason}; --object {side} turns it back"
    return replace(found, mask=~found.mask, notes=(*notes, said))


def _corner_parts(labels: IntArray, features: Float32Array) -> IntArray | None:
    """The parts in the corners, if there is one in each, and they are small, apart and of one colour."""
    found = np.array([labels[0, 0], labels[0, -1], labels[-1, 0], labels[-1, -1]])
    if not found.all() or len(set(found.tolist())) < 4:
        return None
    areas = np.bincount(labels.ravel())[found]
    if areas.max() > CORNER_SHARE * labels.size or areas.max() > 3 * areas.min() + 8:
        return None
    colours = features[[0, 0, -1, -1], [0, -1, 0, -1]]
    if np.linalg.norm(colours - colours[0], axis=1).max() > 2 * SAME:
        return None
    return found


def _are_notches(mask: BoolArray, labels: IntArray, n_parts: int, features: Float32Array) -> bool:
    """Whether all parts lie on the border, and are paper around one dark shape."""
    on_border = border(labels)
    if len(np.unique(on_border[on_border > 0])) < n_parts or parts(~mask)[1] > 1:
        return False
    if not NOTCHES[0] <= float((on_border > 0).mean()) <= NOTCHES[1]:
        return False
    light, dark = float(np.median(features[mask][:, 0])), float(np.median(features[~mask][:, 0]))
    return light >= INK and light - dark >= PAPER
