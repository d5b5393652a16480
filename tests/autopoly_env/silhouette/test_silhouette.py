"""Loading silhouettes: exact area averages, which part is the object, cleaning, sizes, and every refusal."""

import io
import pickle
import struct
import subprocess
import sys
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import EpsImagePlugin, Image, ImageFilter, ImageOps

from autopoly_env.errors import ConfigError, SilhouetteError
from autopoly_env.silhouette import IMAGE_SUFFIXES, ObjectOptions, Silhouette, Target, find_images, load_silhouette
from tests.helpers.paths import ROOT


def l_shape() -> np.ndarray:
    """An L in a 12x12 picture, away from the border: no symmetry, so that no flip goes unnoticed."""
    mask = np.zeros((12, 12), dtype=bool)
    mask[2:10, 3:6] = True
    mask[8:10, 3:9] = True
    return mask


def grey_image(mask: np.ndarray, object_level: int = 0, background_level: int = 255) -> Image.Image:
    return Image.fromarray(np.where(mask, object_level, background_level).astype(np.uint8))


def encoded(image: Image.Image, format: str, **options: Any) -> io.BytesIO:
    stream = io.BytesIO()
    image.save(stream, format, **options)
    stream.seek(0)
    return stream


def refusal(source: Any, **options: Any) -> str:
    with pytest.raises(SilhouetteError) as caught:
        load_silhouette(source, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


# --- Target: area averages and prefix sums, by hand ---


def test_target__averages_two_by_two_blocks() -> None:
    mask = np.array([[1, 1, 0, 0], [1, 0, 0, 1], [0, 0, 1, 1], [0, 0, 1, 1]], dtype=bool)
    target = Silhouette(mask).target(2)
    assert target.coverage.tolist() == [[0.75, 0.25], [0.0, 1.0]]
    assert target.mask.tolist() == [[True, False], [False, True]]


def test_target__splits_pixels_that_a_cell_border_crosses() -> None:
    mask = np.zeros((3, 3), dtype=bool)
    mask[0, 0] = mask[1, 1] = True
    # A cell is 1.5 pixels a side, area 2.25: the centre pixel gives each a quarter, the corner one all.
    expected = np.array([[1.25, 0.25], [0.25, 0.25]]) / 2.25
    assert np.array_equal(Silhouette(mask).target(2).coverage, expected)


def test_target__counts_a_half_covered_cell_as_object_for_awkward_ratios_too() -> None:
    mask = np.zeros((18, 18), dtype=bool)
    mask[:, :9] = True
    coverage = Silhouette(mask).target(7).coverage
    assert np.all(coverage == [1, 1, 1, 0.5, 0, 0, 0])
    assert Silhouette(mask).target(7).mask[:, 3].all()


def test_target__above_the_native_resolution_is_blocky() -> None:
    target = Silhouette(np.array([[True, False], [False, False]])).target(4)
    assert np.array_equal(target.coverage, np.kron([[1, 0], [0, 0]], np.ones((2, 2))))


def test_target__at_the_native_resolution_is_the_mask() -> None:
    assert np.array_equal(Silhouette(l_shape()).target(12).coverage, l_shape())


def test_target__prefix_sums_start_at_zero_and_end_at_the_row_total() -> None:
    target = Target(np.array([[0.5, 0.25], [0.0, 1.0]]))
    assert target.row_sum.tolist() == [[0, 0.5, 0.75], [0, 0, 1]]
    assert target.row_square_sum.tolist() == [[0, 0.25, 0.3125], [0, 0, 1]]
    assert target.mask_sum.tolist() == [[0, 1, 1], [0, 0, 1]]
    assert target.mask_sum.dtype == np.float64
    assert target.resolution == 2 and repr(target) == "Target(resolution=2)"


def test_target__arrays_are_contiguous_and_read_only_even_after_pickling() -> None:
    silhouette = Silhouette(l_shape(), "l", ("a note",))
    copy = pickle.loads(pickle.dumps(silhouette))
    assert (copy.name, copy.notes) == ("l", ("a note",)) and not copy.mask.flags.writeable
    for target in (silhouette.target(5), pickle.loads(pickle.dumps(silhouette.target(5)))):
        for array in (target.coverage, target.mask, target.row_sum, target.row_square_sum, target.mask_sum):
            assert array.flags.c_contiguous and not array.flags.writeable


def test_target__is_made_once_per_resolution() -> None:
    silhouette = Silhouette(l_shape())
    assert silhouette.target(8) is silhouette.target(8)
    assert [target.resolution for target in silhouette.pyramid((2, 4, 8))] == [2, 4, 8]
    assert silhouette.pyramid((2, 4, 8))[-1] is silhouette.target(8)


@settings(max_examples=60, deadline=None)
@given(
    mask=st.integers(1, 24).flatmap(lambda n: hnp.arrays(bool, (n, n))).filter(lambda mask: mask.any()),
    resolution=st.integers(1, 40),
)
def test_target__keeps_the_area_at_every_resolution(mask: np.ndarray, resolution: int) -> None:
    coverage = Silhouette(mask).target(resolution).coverage
    assert coverage.min() >= 0 and coverage.max() <= 1
    assert coverage.sum() / resolution**2 == pytest.approx(mask.mean(), rel=1e-12)


def test_silhouette__does_not_follow_changes_of_the_array_it_was_made_from() -> None:
    mask = l_shape()
    silhouette = Silhouette(mask)
    mask[:] = False
    assert silhouette.mask.any() and silhouette.resolution == 12


@pytest.mark.parametrize("mask", [np.ones((2, 3), bool), np.ones((2, 2)), np.zeros((2, 2), bool)])
def test_silhouette__refuses_what_is_no_square_mask_with_an_object(mask: np.ndarray) -> None:
    with pytest.raises(SilhouetteError, match="the mask"):
        Silhouette(mask)


def test_silhouette__refuses_settings_out_of_range() -> None:
    for resolution in (0, -1, 1.5, "8", None, float("nan"), 10**5):
        with pytest.raises(ConfigError, match=r"target resolution=.*: expected a whole number of at least 1"):
            Silhouette(l_shape()).target(resolution)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="min_speck"):
        load_silhouette(l_shape(), options=ObjectOptions(min_speck=-1))


# --- which part is the object ---


def rgba(mask: np.ndarray, colour: int = 255) -> Image.Image:
    """The object opaque, the rest transparent, all of one colour: only alpha can tell."""
    image = Image.new("RGBA", mask.shape[::-1], (colour, colour, colour, 0))
    image.putalpha(grey_image(mask, 255, 0))
    return image


SAME_PICTURE: dict[str, Callable[[np.ndarray], Any]] = {
    "dark on light": lambda mask: grey_image(mask),
    "light on dark": lambda mask: grey_image(mask, 200, 30),
    "alpha, white": lambda mask: rgba(mask),
    "alpha, black": lambda mask: rgba(mask, 0),
    "grey and alpha": lambda mask: rgba(mask).convert("LA"),
    "CMYK": lambda mask: grey_image(mask).convert("CMYK"),
    "LAB": lambda mask: grey_image(mask).convert("RGB").convert("LAB"),
    "16 bit": lambda mask: Image.fromarray(np.where(mask, 300, 4000).astype(np.uint16)),
    "32 bit": lambda mask: Image.fromarray(np.where(mask, -5, 90000).astype(np.int32)),
    "float": lambda mask: Image.fromarray(np.where(mask, 0.25, 0.5).astype(np.float32)),
    "PNG": lambda mask: encoded(grey_image(mask), "PNG"),
    "1-bit PNG": lambda mask: encoded(grey_image(mask).convert("1"), "PNG"),
    "16-bit PNG": lambda mask: encoded(SAME_PICTURE["16 bit"](mask), "PNG"),
    "palette PNG, transparent": lambda mask: encoded(grey_image(mask).convert("P"), "PNG", transparency=255),
    "grey PNG, transparent": lambda mask: encoded(grey_image(mask), "PNG", transparency=255),
    "JPEG": lambda mask: encoded(grey_image(mask), "JPEG", quality=95),
    "WebP": lambda mask: encoded(rgba(mask), "WEBP", lossless=True),
    "BMP": lambda mask: encoded(grey_image(mask), "BMP"),
    "GIF, transparent": lambda mask: encoded(grey_image(mask), "GIF", transparency=255),
    "TIFF": lambda mask: encoded(grey_image(mask), "TIFF"),
    "bool array": lambda mask: mask,
    "uint8 array": lambda mask: np.where(mask, 10, 240).astype(np.uint8),
    "float array": lambda mask: np.where(mask, 0.9, 0.2),
    "one channel": lambda mask: mask[..., None],
    "two channels": lambda mask: np.stack([np.zeros(mask.shape), mask], axis=2).astype(float),
    "three channels": lambda mask: np.where(mask[..., None], [200, 0, 0], [255, 255, 255]).astype(np.uint8),
    "four channels": lambda mask: np.where(mask[..., None], [9, 9, 9, 128], [9, 9, 9, 127]).astype(np.uint8),
    "four channels, all opaque": lambda mask: np.where(mask[..., None], [0, 0, 0, 255], 255).astype(np.uint8),
}


@pytest.mark.parametrize("way", SAME_PICTURE)
def test_load__finds_the_same_object_however_it_is_written(way: str) -> None:
    assert np.array_equal(load_silhouette(SAME_PICTURE[way](l_shape())).mask, l_shape())


def test_load__takes_a_boolean_array_as_it_is_even_with_object_on_the_border() -> None:
    mask = ~l_shape()
    assert np.array_equal(load_silhouette(mask).mask, mask)


def test_load__says_how_the_object_was_told_from_the_background() -> None:
    assert load_silhouette(grey_image(l_shape(), 51, 204)).notes == (
        "threshold 0.50 (Otsu)",
        "object is darker than the background",
    )
    assert "object is lighter than the background" in load_silhouette(grey_image(l_shape(), 255, 0)).notes
    assert load_silhouette(rgba(l_shape())).notes == ("object is what alpha shows as opaque (128 or more)",)
    assert load_silhouette(l_shape()).notes == ()


def test_load__ignores_an_alpha_channel_that_does_not_vary() -> None:
    image = grey_image(l_shape()).convert("RGBA")
    image.putalpha(200)
    assert np.array_equal(load_silhouette(image).mask, l_shape())


def test_load__uses_the_first_frame_and_says_so() -> None:
    first, second = grey_image(l_shape()), grey_image(np.roll(l_shape(), 2))
    silhouette = load_silhouette(encoded(first, "GIF", save_all=True, append_images=[second]))
    assert np.array_equal(silhouette.mask, l_shape())
    assert silhouette.notes[0] == "first frame of several"


def disc(size: int) -> np.ndarray:
    rows, columns = np.mgrid[:size, :size] + 0.5 - size / 2
    return rows**2 + columns**2 < (0.35 * size) ** 2


def test_load__warns_of_a_picture_whose_levels_run_into_each_other() -> None:
    ramp = np.tile(np.linspace(0, 1, 64), (64, 1))
    assert any(note.startswith("warning:") for note in load_silhouette(ramp).notes)


def test_load__does_not_take_antialiased_icons_and_blurred_jpegs_for_photos() -> None:
    icon = grey_image(disc(256)).resize((24, 24), Image.Resampling.BOX)
    jpeg = encoded(grey_image(disc(256)).filter(ImageFilter.GaussianBlur(2.5)), "JPEG", quality=10)
    for source in (icon, jpeg):
        assert not any("warning" in note for note in load_silhouette(source).notes)


# --- cleaning, border, square ---


def test_load__drops_specks_and_fills_pinholes_and_counts_them() -> None:
    mask = np.zeros((40, 40), dtype=bool)
    mask[10:30, 10:30] = True
    dirty = mask.copy()
    dirty[2, 2] = dirty[5, 35] = dirty[6, 36] = True  # one speck of 1 pixel, one of 2 that touch at a corner
    dirty[20, 20] = False
    silhouette = load_silhouette(dirty)
    assert np.array_equal(silhouette.mask, mask)
    assert silhouette.notes == (
        "2 specks of less than 4 pixels dropped",
        "1 pinhole of less than 4 pixels filled",
    )
    assert np.array_equal(load_silhouette(dirty, options=ObjectOptions(keep_specks=True)).mask, dirty)


def test_load__keeps_components_of_four_pixels_and_counts_parts_and_holes() -> None:
    mask = np.zeros((40, 40), dtype=bool)
    mask[10:30, 10:30] = True
    mask[2:4, 2:4] = True
    mask[14:16, 14:16] = mask[20:25, 20:25] = False
    silhouette = load_silhouette(mask)
    assert np.array_equal(silhouette.mask, mask)
    assert silhouette.notes == ("object has 2 separate parts", "object has 2 holes")


def test_load__never_drops_all_of_the_object_nor_fills_all_of_the_background() -> None:
    lone_pixel = np.zeros((5, 5), dtype=bool)
    lone_pixel[2, 2] = True
    for mask in (lone_pixel, ~lone_pixel):
        assert np.array_equal(load_silhouette(mask).mask, mask)


def test_load__notes_an_object_that_touches_the_border() -> None:
    mask = l_shape()
    mask[9, :] = True
    silhouette = load_silhouette(mask)
    assert np.array_equal(silhouette.mask, mask)
    assert silhouette.notes == ("object touches the border of the image",)


def test_load__pads_to_a_centred_square_with_background() -> None:
    mask = np.zeros((20, 31), dtype=bool)
    mask[5:15, 5:26] = True
    silhouette = load_silhouette(grey_image(mask))
    assert silhouette.mask.shape == (31, 31)
    assert np.array_equal(silhouette.mask[5:25], mask)
    assert not silhouette.mask[:5].any() and not silhouette.mask[25:].any()
    assert silhouette.notes[-1] == "padded from 31x20 to 31x31"


@pytest.mark.parametrize("orientation", range(1, 9))
def test_load__applies_the_exif_orientation(orientation: int) -> None:
    exif = Image.Exif()
    exif[0x0112] = orientation
    stream = encoded(grey_image(l_shape()), "PNG", exif=exif)
    upright = ImageOps.exif_transpose(Image.open(io.BytesIO(stream.getvalue())))
    silhouette = load_silhouette(stream)
    assert np.array_equal(silhouette.mask, np.asarray(upright) < 128)
    assert any("EXIF" in note for note in silhouette.notes) == (orientation > 1)


def test_load__turns_a_quarter_clockwise_for_exif_orientation_six() -> None:
    exif = Image.Exif()
    exif[0x0112] = 6
    mask = np.zeros((8, 12), dtype=bool)
    mask[1:4, 2:10] = True
    silhouette = load_silhouette(encoded(grey_image(mask), "TIFF", exif=exif))
    assert np.array_equal(silhouette.mask[:, 2:10], np.rot90(mask, -1))


def test_load__names_a_silhouette_after_its_file_unless_told(tmp_path: Path) -> None:
    path = tmp_path / "chair.png"
    grey_image(l_shape()).save(path)
    assert load_silhouette(path).name == load_silhouette(str(path)).name == "chair"
    with path.open("rb") as stream, Image.open(path) as image:
        assert load_silhouette(stream).name == load_silhouette(image).name == "chair"
    assert load_silhouette(path, name="stool").name == "stool"
    path = path.rename(path.with_stem("silhouette"))
    assert load_silhouette(path).name == "silhouette"
    own = load_silhouette(l_shape()).name
    assert own.startswith("silhouette-") and own == load_silhouette(l_shape()).name
    assert own != load_silhouette(l_shape()[::-1]).name


# --- large pictures ---


@pytest.mark.slow
def test_load__averages_blocks_of_a_picture_over_2048_pixels() -> None:
    mask = np.zeros((4100, 4099), dtype=bool)
    mask[300:3000, 600:1500] = True
    for source in (mask, grey_image(mask), np.where(mask, 0.1, 0.9).astype(np.float32)):
        silhouette = load_silhouette(source)
        assert silhouette.notes[0] == "reduced from 4099x4100 to 1367x1367 (blocks of 3x3 averaged)"
        expected = np.zeros((1367, 1367), dtype=bool)
        expected[100:1000, 200:500] = True
        assert np.array_equal(silhouette.mask, expected)


def write_huge_png(path: Path, side: int) -> None:
    """A black square on white, half as wide as the image, in 8-bit grey, from two repeated deflate blocks."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    def deflated(data: bytes) -> bytes:
        compressor = zlib.compressobj(1, zlib.DEFLATED, -15)
        return compressor.compress(data) + compressor.flush(zlib.Z_FULL_FLUSH)

    margin = side // 4
    blank_rows = (b"\0" + b"\xff" * side) * 100
    object_rows = (b"\0" + b"\xff" * margin + b"\0" * (side // 2) + b"\xff" * margin) * 100
    blocks = [blank_rows] * (margin // 100) + [object_rows] * (side // 200) + [blank_rows] * (margin // 100)
    checksum = 1
    for block in blocks:
        checksum = zlib.adler32(block, checksum)
    packed = {block: deflated(block) for block in (blank_rows, object_rows)}
    data = b"\x78\x01" + b"".join(packed[block] for block in blocks) + b"\x03\x00" + struct.pack(">I", checksum)
    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


LOAD_AND_MEASURE = """
import sys, warnings
warnings.simplefilter("error")
from PIL import Image
from autopoly_env.silhouette import load_silhouette
limit = Image.MAX_IMAGE_PIXELS
silhouette = load_silhouette(sys.argv[1])
assert Image.MAX_IMAGE_PIXELS == limit
with open("/proc/self/status") as status:  # getrusage would count what the parent held when it started this process
    peak = next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))
print(silhouette.resolution, silhouette.mask.mean(), peak * 1024)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is read from /proc")
def test_load__reads_twenty_thousand_pixels_a_side_in_strips_within_a_gigabyte(tmp_path: Path) -> None:
    path = tmp_path / "huge.png"
    write_huge_png(path, 20_000)
    command = [sys.executable, "-c", LOAD_AND_MEASURE, str(path)]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert result.returncode == 0, result.stderr
    resolution, area, peak_bytes = result.stdout.split()
    assert (int(resolution), float(area)) == (2000, 0.25)
    assert int(peak_bytes) < 1e9  # the picture itself is 0.4 GB, as one float array it would be 1.6 GB


def test_load__refuses_more_than_500_megapixels_without_a_warning() -> None:
    stream = encoded(Image.new("L", (1, 1)), "PNG")
    png = bytearray(stream.getvalue())
    png[16:24] = struct.pack(">II", 30_000, 20_000)
    png[29:33] = struct.pack(">I", zlib.crc32(png[12:29]))
    limit = Image.MAX_IMAGE_PIXELS
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        message = refusal(io.BytesIO(png))
    assert "30000x20000" in message and "500 megapixels" in message
    assert Image.MAX_IMAGE_PIXELS == limit


def test_load__refuses_more_than_500_megapixels_of_an_array_at_once() -> None:
    message = refusal(np.broadcast_to(np.uint8(1), (100_000, 100_000)))
    assert "100000x100000" in message and "500 megapixels" in message


def test_load__says_alone_what_is_wrong_with_a_damaged_tiff(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "cut.tif"
    grey_image(l_shape().repeat(20, 0).repeat(20, 1)).save(path, compression="tiff_lzw")
    whole = bytearray(path.read_bytes())
    for k in range(20, 60):  # of the strip: of itself libtiff writes to stderr that it cannot read it
        whole[k] = 255
    path.write_bytes(whole)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        message = refusal(path)
    assert "cannot be decoded" in message
    assert capfd.readouterr() == ("", "")


# --- refusals ---


@pytest.mark.parametrize(
    ("source", "finding"),
    [
        (Image.new("L", (9, 9), 0), "black everywhere: there is no object"),
        (np.ma.masked_array(np.ones((9, 9, 3)), np.eye(9, dtype=bool)[:, :, None].repeat(3, 2)), "has masked pixels"),
        (Image.new("RGB", (9, 9), (255, 255, 255)), "white everywhere: there is no object"),
        (Image.new("L", (9, 9), 51), "grey level 0.2 everywhere: there is no object"),
        (Image.new("RGBA", (9, 9), (1, 2, 3, 0)), "transparent everywhere: there is no object"),
        (Image.new("L", (1, 1), 0), "there is no object"),
        (np.zeros((4, 4), dtype=bool), "False everywhere: there is no object"),
        (np.ones((4, 4), dtype=bool), "True everywhere: there is no object"),
        (Image.new("L", (0, 3)), "has no pixels (0x3)"),
        (np.zeros((3, 0)), "has no pixels (0x3)"),
        (np.zeros(4), "shape (4,)"),
        (np.zeros((4, 4, 5)), "shape (4, 4, 5)"),
        (np.zeros((4, 4, 3), dtype=bool), "expected one channel"),
        (np.zeros((4, 4), dtype=np.int64), "dtype int64"),
        (np.array([[0.0, np.nan], [1.0, 1.0]]), "NaN"),
        (np.array([[0.0, np.inf], [1.0, 1.0]]), "infinity"),
        (Image.fromarray(np.array([[0, np.nan]], dtype=np.float32)), "NaN"),
        (np.array([[0.0, 255.0]]), "spans 0..255"),
        ([[0, 1]], "cannot load a list"),
        (io.BytesIO(b"not an image"), "not an image"),
        (io.BytesIO(b""), "not an image"),
    ],
)
def test_load__refuses_in_one_line_what_holds_no_object(source: Any, finding: str) -> None:
    assert finding in refusal(source)


def test_load__refuses_files_that_are_missing_no_image_or_cut_short(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (64, 64), dtype=np.uint8)
    whole = encoded(Image.fromarray(noise), "PNG").getvalue()
    broken = bytearray(whole)
    broken[1000] ^= 255
    files = {
        "text.png": b"hello",
        "cut.png": whole[:2000],
        "header.png": whole[:20],
        "broken.png": bytes(broken),
    }
    for file_name, content in files.items():
        (tmp_path / file_name).write_bytes(content)
    findings = {
        "missing.png": "does not exist",
        "": "is a directory",
        "text.png": "is not an image",
        "cut.png": "cannot be decoded",
        "header.png": "cut short",
        "broken.png": "cannot be decoded",
        "x" * 5000: "cannot be opened",
    }
    for file_name, finding in findings.items():
        message = refusal(tmp_path / file_name)
        assert finding in message and str(tmp_path / file_name)[:100] in message


# --- find_images ---


def test_find_images__expands_files_directories_and_patterns(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    for file_name in ("b.png", "a.JPG", "notes.txt", ".hidden.png", "below/c.webp", "odd[1].png"):
        (tmp_path / file_name).touch()
    a, b, c, odd = (tmp_path / name for name in ("a.JPG", "b.png", "below/c.webp", "odd[1].png"))
    assert find_images([tmp_path]) == [a, b, odd]
    assert find_images([b, str(tmp_path / "*")]) == [b, a, odd]
    assert find_images([str(tmp_path / "**" / "*.webp")]) == [c]
    assert find_images([odd, tmp_path / "notes.txt"]) == [odd, tmp_path / "notes.txt"]
    assert find_images([]) == []


def test_find_images__knows_every_kind_that_pillow_reads_by_itself() -> None:
    Image.init()
    readable = {suffix for suffix, kind in Image.registered_extensions().items() if kind in Image.OPEN}
    elsewhere = {
        ".bufr",
        ".emf",
        ".eps",
        ".grib",
        ".h5",
        ".hdf",
        ".iim",
        ".mpeg",
        ".mpg",
        ".ps",
        ".wmf",
    }  # with a program
    assert readable - elsewhere <= set(IMAGE_SUFFIXES)


def test_find_images__tells_what_it_left_out_of_a_directory(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    for file_name in ("a.png", "b.avif", "notes.txt", ".hidden", "c.pbm"):
        (tmp_path / file_name).touch()
    skipped: list[Path] = []
    assert [path.name for path in find_images([tmp_path], skipped)] == ["a.png", "b.avif", "c.pbm"]
    assert skipped == [tmp_path / "notes.txt"]


def test_find_images__names_what_gave_no_image(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").touch()
    for path in (tmp_path, tmp_path / "missing.png", tmp_path / "*.png"):
        with pytest.raises(SilhouetteError) as caught:
            find_images([path])
        assert repr(str(path)) in str(caught.value) and "\n" not in str(caught.value)


def test_postscript__is_a_program_and_never_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*_: object) -> None:
        raise AssertionError("Ghostscript was called")

    monkeypatch.setattr(EpsImagePlugin, "Ghostscript", run)
    eps = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 100 100\n%%EndComments\nshowpage\n"
    with pytest.raises(SilhouetteError, match="PostScript, which is not run here"):
        load_silhouette(io.BytesIO(eps))
