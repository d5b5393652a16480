"""SVG drawings are pictures like any other, and see nothing of the machine that draws them."""

import base64
import gzip
import io
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from autopoly_env.errors import ConfigError, SilhouetteError
from autopoly_env.silhouette import find_images, load_silhouette, svg

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 64 32">'
SQUARE = '<path d="M8 8h16v16H8z"/>'


def drawing(body: str) -> io.BytesIO:
    return io.BytesIO(f"{HEAD}{body}</svg>".encode())


def test_svg__is_drawn_with_1024_pixels_on_its_longer_side() -> None:
    pytest.importorskip("resvg_py")
    expected = np.zeros((512, 1024), dtype=bool)
    expected[128:384, 128:384] = True
    silhouette = load_silhouette(drawing(SQUARE))
    assert np.array_equal(silhouette.mask[256:768], expected)
    assert silhouette.picture_shape == (512, 1024)
    tall = load_silhouette(io.BytesIO(HEAD.replace("64 32", "32 64").encode() + f"{SQUARE}</svg>".encode()))
    assert tall.picture_shape == (1024, 512)


def test_svg__is_found_in_a_folder_packed_or_not(tmp_path: Path) -> None:
    pytest.importorskip("resvg_py")
    (tmp_path / "a.svg").write_bytes(drawing(SQUARE).getvalue())
    (tmp_path / "b.svgz").write_bytes(gzip.compress(drawing(SQUARE).getvalue()))
    one, other = map(load_silhouette, find_images([tmp_path]))
    assert np.array_equal(one.mask, other.mask) and (one.name, other.name) == ("a", "b")


def test_svg__may_hold_pictures_within_and_links_for_readers() -> None:
    pytest.importorskip("resvg_py")
    pixel = io.BytesIO()
    Image.new("L", (1, 1)).save(pixel, "PNG")
    data = base64.b64encode(pixel.getvalue()).decode()
    embedded = f'<image href="data:image/png;base64,{data}" x="8" y="8" width="16" height="16"/>'
    linked = f'<a href="https://example.org">{SQUARE}</a>'
    used = f'<defs><g id="it">{SQUARE}</g></defs><use xlink:href="#it"/>'
    for body in (embedded, linked, used):
        assert load_silhouette(drawing(body)).mask.sum() == pytest.approx(256 * 256, rel=0.02)


def test_svg__that_asks_for_a_stylesheet_elsewhere_is_refused() -> None:
    sheet = '<?xml-stylesheet type="text/css" href="https://example.org/a.css"?>'
    with pytest.raises(SilhouetteError, match=r"refers to 'https://example.org/a.css', which is not followed"):
        load_silhouette(io.BytesIO(f"{sheet}{HEAD}{SQUARE}</svg>".encode()))


@pytest.mark.parametrize(
    "body",
    [
        '<image href="{path}" width="9" height="9"/>',
        '<image xlink:href="file://{path}" width="9" height="9"/>',
        '<image href="https://example.org/a.png" width="9" height="9"/>',
        '<image href="data:image/svg+xml;base64,PHN2Zy8+" width="9" height="9"/>',
        '<use href="{path}#it"/>',
        '<rect width="9" height="9" fill="url({path}#paint)"/>',
        '<style>@import "https://example.org/a.css";</style>',
        "<style>rect {{ fill: url('{path}#paint') }}</style>",
    ],
)
def test_svg__refers_to_nothing_outside(body: str, tmp_path: Path) -> None:
    path = tmp_path / "red.png"
    Image.new("RGB", (9, 9), "red").save(path)
    with pytest.raises(SilhouetteError, match=r"refers to .*, which is not followed") as caught:
        load_silhouette(drawing(body.format(path=path) + SQUARE))
    assert "\n" not in str(caught.value)


def test_svg__that_would_unpack_to_gigabytes_or_expand_entities_is_refused() -> None:
    start = drawing(SQUARE).getvalue()
    bomb = gzip.compress(start + b" " * 33_000_000)
    with pytest.raises(SilhouetteError, match="more than 32 MB"):
        load_silhouette(io.BytesIO(bomb))
    lol = b'<!DOCTYPE svg [<!ENTITY a "aaaa">]>' + start.replace(b"<path", b"&a;<path")
    with pytest.raises(SilhouetteError, match="entities"):
        load_silhouette(io.BytesIO(lol))


def test_svg__that_is_broken_is_refused_in_one_line() -> None:
    with pytest.raises(SilhouetteError, match="no valid SVG"):
        load_silhouette(io.BytesIO(HEAD.encode()))


def test_svg__that_crashes_its_renderer_ends_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("resvg_py")
    monkeypatch.setattr(svg, "DRAWING", "import os; os.abort()")
    with pytest.raises(SilhouetteError, match="its renderer crashes"):
        load_silhouette(drawing(SQUARE))


def test_svg__that_does_not_come_to_an_end_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("resvg_py")
    monkeypatch.setattr(svg, "PATIENCE", 0.0)
    with pytest.raises(SilhouetteError, match="it takes more than 0 seconds"):
        load_silhouette(drawing(SQUARE))


def test_svg__without_its_renderer_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "resvg_py", None)
    with pytest.raises(ConfigError, match=r"needs the package resvg_py.*pip install -e '\.\[svg\]'"):
        load_silhouette(drawing(SQUARE))
