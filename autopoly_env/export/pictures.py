"""Targets as small pictures that can stand inside another file."""

import base64
import io

import numpy as np
from PIL import Image

from autopoly_env.silhouette import Silhouette


def picture_url(silhouette: Silhouette, colour: tuple[int, int, int], max_size: int | None = None) -> str:
    """The silhouette as a `data:` URL: a square PNG, `colour` on the object and transparent elsewhere.

    It has the silhouette's own resolution, or `max_size` pixels a side where that is less.
    """
    picture = Image.fromarray(silhouette.mask.astype(np.uint8))
    if max_size is not None and silhouette.resolution > max_size:
        shares = Image.fromarray(np.where(silhouette.mask, np.uint8(255), np.uint8(0)))
        smaller = shares.resize((max_size, max_size), Image.Resampling.BOX)
        picture = Image.fromarray((np.asarray(smaller) >= 128).astype(np.uint8))
    picture.putpalette([255, 255, 255, *colour])
    stream = io.BytesIO()
    picture.save(stream, "PNG", bits=1, transparency=0, optimize=True)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode("ascii")
