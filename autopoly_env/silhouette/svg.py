"""SVG drawings as pictures: drawn by resvg (the extra `svg`), which is never shown a reference to anything outside.

It draws in a process of its own, for there are drawings that it crashes on, which no exception tells.
"""

import io
import re
import subprocess
import sys
import zlib
from collections.abc import Iterator
from typing import IO
from xml.etree import ElementTree

from PIL import Image

from autopoly_env.errors import ConfigError, SilhouetteError

SIDE = 1024  # pixels of the longer side
MAX_BYTES = 32_000_000  # of a drawing, unpacked
PATIENCE = 60.0  # seconds that a drawing may take
DRAWING = """
import sys
from resvg_py import svg_to_bytes
width, height, has_text = map(int, sys.argv[1:])
text = sys.stdin.buffer.read().decode("utf-8-sig")
try:
    drawn = svg_to_bytes(svg_string=text, skip_system_fonts=not has_text, width=width or None, height=height or None)
except BaseException as error:  # resvg's panics are no Exceptions
    sys.exit(str(error) or type(error).__name__)
sys.stdout.buffer.write(bytes(drawn))
"""
EMBEDDED = re.compile(r"data:image/(png|jpe?g|gif|webp)[;,]", re.IGNORECASE)
STYLESHEET = re.compile(rb"""<\?xml-stylesheet\b[^>]*?\bhref\s*=\s*["']([^"'#][^"']*)""")
URL = re.compile(r"""url\(\s*["']?\s*([^"')]*)""", re.IGNORECASE)


def read(stream: IO[bytes], label: str) -> Image.Image | None:
    """The drawing in a stream that Pillow could not read, as RGBA; None if it is no SVG (or packed SVG) either.

    Raises SilhouetteError for one that cannot be drawn or refers to a file or an address, ConfigError without resvg.
    """
    stream.seek(0)
    data = stream.read(MAX_BYTES + 1)
    if data[:2] == b"\x1f\x8b":
        data = _unpacked(data)
    if b"<svg" not in data[:4096] and b":svg" not in data[:4096]:
        return None
    if len(data) > MAX_BYTES:
        raise SilhouetteError(f"{label} has more than {MAX_BYTES // 10**6} MB of SVG; expected less: simplify it")
    root = _parsed(data, label)
    sheet = STYLESHEET.search(data)
    outside = next(_references(root), None) if sheet is None else sheet[1].decode("utf-8", "replace")
    if outside is not None:
        shown = outside if len(outside) <= 60 else f"{outside[:57]}..."
        raise SilhouetteError(
            f"{label} refers to {shown!r}, which is not followed; embed what it shows, or export a PNG"
        )
    try:
        import resvg_py  # noqa: F401
    except ImportError:
        advice = "pip install -e '.[svg]' in the checkout, or export it as PNG"
        raise ConfigError(
            f"{label} is SVG, which needs the package resvg_py, which is not installed: {advice}"
        ) from None
    return Image.open(io.BytesIO(_drawn(data, root, label)))


def _drawn(data: bytes, root: ElementTree.Element, label: str) -> bytes:
    """The PNG that resvg makes of a drawing. Raises SilhouetteError, also where it crashes or comes to no end."""
    size = (SIDE, 0) if _is_wide(root) else (0, SIDE)
    has_text = any(_local(element.tag) == "text" for element in root.iter())
    command = [sys.executable, "-I", "-c", DRAWING, *map(str, size), str(int(has_text))]
    reason = f"it takes more than {PATIENCE:g} seconds"
    try:
        done = subprocess.run(command, input=data, capture_output=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        pass
    else:
        if done.returncode == 0:
            return done.stdout
        said = done.stderr.decode("utf-8", "replace").split()
        reason = " ".join(said) if done.returncode == 1 and said else "its renderer crashes"
    raise SilhouetteError(f"{label} cannot be drawn ({reason}); expected valid SVG: export it as PNG")


def _unpacked(data: bytes) -> bytes:
    try:
        return zlib.decompressobj(wbits=31).decompress(data, MAX_BYTES + 1)
    except zlib.error:
        return b""


def _parsed(data: bytes, label: str) -> ElementTree.Element:
    if b"<!ENTITY" in data:
        raise SilhouetteError(
            f"{label} defines entities, which are not expanded; save it as plain SVG, or export a PNG"
        )
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise SilhouetteError(f"{label} is no valid SVG ({error}); save it again, or export it as PNG") from None


def _references(root: ElementTree.Element) -> Iterator[str]:
    """Whatever the drawing shows of files or addresses outside of it; links that a reader may click on are none."""
    for element in root.iter():
        tag = _local(element.tag)
        texts = [element.text or ""] if tag == "style" else []
        for name, value in element.attrib.items():
            texts.append(value)
            is_inside = value.strip().startswith("#") or EMBEDDED.match(value.strip())
            if _local(name) == "href" and tag != "a" and value.strip() and not is_inside:
                yield value.strip()
        for text in texts:
            yield from (url for url in URL.findall(text) if not url.startswith("#") and not EMBEDDED.match(url))
            if "@import" in text:
                yield "@import"


def _local(name: object) -> str:
    """The name of an element or attribute without its namespace."""
    return str(name).rpartition("}")[2].rpartition(":")[2].lower()


def _is_wide(root: ElementTree.Element) -> bool:
    """Whether the drawing is at least as wide as it is high, as far as it says so."""
    box = re.findall(r"-?[\d.]+(?:e-?\d+)?", root.get("viewBox", ""))
    sizes = [re.match(r"\s*([\d.]+)(?!.*%)", root.get(name, "")) for name in ("width", "height")]
    if sizes[0] and sizes[1]:
        return float(sizes[0][1]) >= float(sizes[1][1])
    return len(box) != 4 or float(box[2]) >= float(box[3])
