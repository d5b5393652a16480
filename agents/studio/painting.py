"""Where matching matters, as the page paints it: a square of grey levels over the square of the picture."""

import io

import numpy as np
from PIL import Image

from autopoly_env.arrays import ByteArray
from autopoly_env.errors import ConfigError

SIDE = 256  # pixels
PLAIN = 64  # the grey of what nobody has painted: a quarter of what matters most


def check_painted(data: bytes) -> bytes | None:
    """The bytes as they are; None where all is alike. Raises ConfigError where they are not SIDE x SIDE."""
    if len(data) != SIDE * SIDE:
        raise ConfigError(f"{len(data)} bytes of importance: expected {SIDE} x {SIDE} grey levels")
    levels = levels_of(data)
    return None if levels.min() == levels.max() else bytes(data)


def levels_of(painted: bytes) -> ByteArray:
    """The grey levels (SIDE, SIDE), the upper left first."""
    levels: ByteArray = np.frombuffer(painted, np.uint8).reshape(SIDE, SIDE)
    return levels


def as_png(painted: bytes) -> bytes:
    """The weight image that `agents.solve --importance` reads."""
    stream = io.BytesIO()
    Image.fromarray(levels_of(painted)).save(stream, "PNG", optimize=True)
    return stream.getvalue()
