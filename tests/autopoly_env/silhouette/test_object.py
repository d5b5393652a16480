"""What in a picture is the object: the kinds of picture that people have, drawn here, and what overrules the choice."""

import io
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from autopoly_env.errors import AutoPolyError, ConfigError, SilhouetteError
from autopoly_env.silhouette import ObjectOptions, Silhouette, load_silhouette
from autopoly_env.silhouette.colours import hex_of, oklab, oklab_lightness, parse_colour
from tests.helpers.pictures import SIZE, antialiased, chair, disc, encoded, faded, iou, painted, pictures

WHITE, GREY, BLACK, RED, GREEN = (255, 255, 255), (160, 160, 160), (0, 0, 0), (255, 0, 0), (0, 140, 0)


def load(picture: Any, **options: Any) -> Silhouette:
    return load_silhouette(picture, options=ObjectOptions(**options))


def says(silhouette: Silhouette, words: str) -> bool:
    return any(words in note for note in silhouette.notes)


# --- colours ---


def test_oklab__is_that_of_its_author() -> None:
    # L, a, b of white, black, red and blue as the reference implementation prints them
    levels = np.array([WHITE, BLACK, RED, (0, 0, 255)], dtype=np.uint8)
    expected = [[1, 0, 0], [0, 0, 0], [0.627955, 0.224863, 0.125846], [0.452014, -0.032457, -0.311528]]
    assert np.allclose(oklab(levels), expected, atol=1e-4)


@given(st.tuples(*3 * [st.integers(0, 255)]))
def test_hex__comes_back(levels: tuple[int, int, int]) -> None:
    name = "#{:02x}{:02x}{:02x}".format(*levels)
    assert parse_colour(name) == levels
    assert hex_of(oklab(np.array(levels, np.uint8))) == name


def test_lightness__of_greys_is_the_l_of_oklab() -> None:
    greys = np.arange(256, dtype=np.uint8)
    expected = oklab(np.stack(3 * [greys], axis=-1))[:, 0]
    assert np.allclose(oklab_lightness(greys), expected, atol=1e-5)
    assert np.allclose(oklab_lightness(greys / 255), expected, atol=1e-5)


# --- every kind of picture ---


@settings(max_examples=60, deadline=None)
@given(pictures())
def test_object__is_found_in_any_colours_whatever_is_around_it(drawn: tuple[np.ndarray, np.ndarray, str]) -> None:
    picture, mask, extra = drawn
    silhouette = load_silhouette(picture)
    assert iou(silhouette.mask, mask) > (0.9 if extra == "gradient" else 0.999), (extra, silhouette.notes)


def face() -> tuple[np.ndarray, np.ndarray]:
    """A yellow face with dark eyes on white, and its mask."""
    mask = disc(SIZE, 0.4)
    picture = painted(mask, (255, 222, 60))
    picture[disc(SIZE, 0.06, (0.38, 0.4)) | disc(SIZE, 0.06, (0.62, 0.4))] = (40, 30, 20)
    return picture, mask


def test_object__is_all_that_differs_in_colour_and_a_note_tells_of_the_dark_part() -> None:
    picture, mask = face()
    silhouette = load_silhouette(picture)
    assert np.array_equal(silhouette.mask, mask)
    assert says(silhouette, "lightness alone would find another object, 4% of this: --object dark")
    assert load(picture, object="dark").mask.sum() < 0.06 * mask.sum()


@pytest.mark.parametrize("body", range(1, 250, 11))
def test_object__with_a_flat_body_of_any_grey_includes_its_black_eyes(body: int) -> None:
    picture = np.full((64, 64), 255, np.uint8)
    picture[12:52, 12:52] = body
    picture[20:23, [20, 21, 22, 40, 41, 42]] = 0
    assert load_silhouette(picture).mask.sum() == 1600


def test_object__of_the_same_lightness_as_its_ground_is_told_by_colour() -> None:
    assert np.array_equal(load_silhouette(painted(chair(), RED, (76, 76, 76))).mask, chair())


def test_object__of_levels_between_those_of_8_bits_is_found_beside_hot_pixels() -> None:
    picture = np.where(chair(), 9000, 9100).astype(np.uint16)
    picture[3, 3], picture[90, 90] = 65535, 0
    silhouette = load_silhouette(Image.fromarray(picture))
    assert np.array_equal(silhouette.mask, chair())
    assert says(silhouette, "2 pixels lie beyond")


def test_page__with_soft_corners_is_no_object() -> None:
    alpha = np.full((SIZE, SIZE, 1), 255, np.uint8)
    alpha[[0, 0, -1, -1], [0, -1, 0, -1]] = 110
    silhouette = load_silhouette(np.dstack([painted(chair()), alpha]))
    assert np.array_equal(silhouette.mask, chair())


def test_alpha__counts_relative_to_the_most_opaque_pixel() -> None:
    picture = np.dstack([painted(chair()), np.where(chair(), 110, 0).astype(np.uint8)])
    silhouette = load_silhouette(picture)
    assert np.array_equal(silhouette.mask, chair())
    assert silhouette.notes[0] == "object is what alpha shows as opaque (55 or more)"


def test_shadow__of_a_sprite_is_left_out_and_the_option_that_takes_it_in_named() -> None:
    alpha, colours = np.where(chair(), 255, 0), painted(chair(), RED, BLACK)
    shadow = np.roll(chair(), (8, 8), (0, 1)) & ~chair()
    alpha[shadow] = 150
    sprite = np.dstack([colours, alpha.astype(np.uint8)])
    silhouette = load_silhouette(sprite)
    assert np.array_equal(silhouette.mask, chair())
    assert says(silhouette, "--alpha-threshold 0.5 takes it in")
    assert np.array_equal(load(sprite, alpha_threshold=0.5).mask, chair() | shadow)


def tile() -> tuple[np.ndarray, np.ndarray]:
    """A white tile with clear, rounded corners and a dark chair on it, and the tile's mask."""
    opaque = np.ones((SIZE, SIZE), dtype=bool)
    for corner in ((0, 0), (0, 1), (1, 0), (1, 1)):
        x, y = (np.arange(SIZE) + 0.5 if side == 0 else SIZE - 0.5 - np.arange(SIZE) for side in corner)
        opaque &= ~(np.add.outer(np.maximum(20 - y, 0) ** 2, np.maximum(20 - x, 0) ** 2) > 400)
    return np.dstack([painted(chair()), np.where(opaque, 255, 0).astype(np.uint8)]), opaque


def test_tile__is_the_object_and_a_note_tells_of_what_is_drawn_on_it() -> None:
    picture, opaque = tile()
    silhouette = load_silhouette(picture)
    assert np.array_equal(silhouette.mask, opaque)
    assert says(silhouette, "there is a darker shape inside: --object dark takes that")
    assert np.array_equal(load(picture, object="dark").mask, chair())


@pytest.mark.parametrize("sides", [(1, 1, 1, 1), (0, 1, 0, 0), (1, 0, 1, 0)])
def test_frame__along_the_border_is_no_object(sides: tuple[int, ...]) -> None:
    picture = painted(chair())
    for has_frame in sides:
        if has_frame:
            picture[:3] = 20
        picture = np.rot90(picture)
    silhouette = load_silhouette(picture)
    assert np.array_equal(silhouette.mask, chair())
    assert says(silhouette, "a dark frame")


def test_margin__around_a_tile_is_background_however_thin() -> None:
    for ground, colour in ((BLACK, WHITE), (WHITE, BLACK), (GREY, RED)):
        mask = np.zeros((SIZE, SIZE), dtype=bool)
        mask[2:-2, 2:-2] = True
        assert np.array_equal(load_silhouette(painted(mask, colour, ground)).mask, mask)


def test_object__that_fills_the_picture_is_told_by_its_corners() -> None:
    mask = disc(SIZE, 0.62)
    silhouette = load_silhouette(painted(mask))
    assert np.array_equal(silhouette.mask, mask)
    assert says(silhouette, "the object fills the picture") and says(silhouette, "--object light")
    assert np.array_equal(load(painted(mask), object="light").mask, ~mask)


def test_letter__that_was_cropped_close_is_ink_on_paper() -> None:
    mask = np.ones((SIZE, SIZE), dtype=bool)
    mask[36:62, :36] = mask[36:62, 60:] = False
    assert np.array_equal(load_silhouette(painted(mask)).mask, mask)


def test_uneven_light__is_told_from_the_object_and_looks_like_a_photo_once() -> None:
    picture = faded(painted(chair(), (70, 70, 70), (220, 220, 220)), 0.7)
    for source in (picture, encoded(picture, "JPEG", quality=90)):
        silhouette = load_silhouette(source)
        assert iou(silhouette.mask, chair()) > 0.97
        assert sum("photo" in note for note in silhouette.notes) == 1


def test_antialiased_edge__is_cut_where_half_of_the_pixel_is_object() -> None:
    fine = disc(4 * SIZE, 0.3, (0.45, 0.55))
    share = fine.reshape(SIZE, 4, SIZE, 4).mean(axis=(1, 3))
    for colour, ground in (((250, 214, 60), WHITE), ((30, 60, 200), (120, 200, 90))):
        mixed = share[..., None] * np.array(colour) + (1 - share[..., None]) * np.array(ground)
        assert iou(load_silhouette(np.rint(mixed).astype(np.uint8)).mask, share >= 0.5) > 0.98


def test_pale_part__beside_something_strong_is_no_edge_of_it() -> None:
    x, y = np.meshgrid(*2 * [np.arange(8 * 48) / (8 * 48)])
    trunk, sleeves = (abs(x - 0.5) < 0.22) & (abs(y - 0.5) < 0.35), (abs(x - 0.5) < 0.27) & (abs(y - 0.5) < 0.35)
    picture, mask = antialiased(48, [(sleeves, (250, 215, 190)), (trunk, (20, 30, 90))])
    assert iou(load_silhouette(picture).mask, mask) > 0.99


@pytest.mark.parametrize(("body", "quality"), [((250, 220, 200), 90), ((240, 240, 240), 75)])
def test_pale_object__that_reaches_the_border_of_a_jpeg_is_no_background(
    body: tuple[int, int, int], quality: int
) -> None:
    side = 40 if quality == 75 else 96
    banner = np.zeros((8 * side, 8 * side), dtype=bool)
    banner[int(1.2 * side) : -int(1.2 * side)] = True
    picture, mask = antialiased(side, [(banner, body), (disc(8 * side, 0.15), (180, 30, 40))])
    assert iou(load_silhouette(encoded(picture, "JPEG", quality=quality)).mask, mask) > 0.95


@pytest.mark.parametrize("n_faint", [0, 12])
def test_drawing__whose_faint_edges_touch_the_border_is_cut_low_all_the_same(n_faint: int) -> None:
    mask = disc(64, 0.3)
    picture = painted(mask, (226, 221, 214), (200, 200, 200))
    picture[disc(64, 0.1)] = (90, 20, 40)
    picture[0, 8 : 8 + 2 * n_faint : 2] = (203, 201, 200)
    assert iou(load_silhouette(picture).mask, mask) > 0.98


@pytest.mark.parametrize("ground", [WHITE, (200, 200, 200), (96, 160, 120)])
@pytest.mark.parametrize("quality", [75, 90])
def test_sprite__saved_as_jpeg_is_found_to_its_borders(ground: tuple[int, int, int], quality: int) -> None:
    parts = [(disc(512, 0.49), (190, 140, 100)), (disc(512, 0.12, (0.5, 0.62)), (150, 100, 70))]
    picture, mask = antialiased(64, parts, ground)
    assert iou(load_silhouette(encoded(picture, "JPEG", quality=quality)).mask, mask) > 0.95


@pytest.mark.parametrize("quality", [75, 90])
def test_pale_part_of_a_small_jpeg__that_was_missed_is_asked_about_and_taken_by_the_option(quality: int) -> None:
    parts = [(disc(512, 0.4), (225, 200, 190)), (disc(512, 0.2, (0.5, 0.4)), (40, 60, 90))]
    picture, mask = antialiased(64, parts, (200, 200, 200))
    compressed = encoded(picture, "JPEG", quality=quality)
    silhouette = load_silhouette(compressed)
    assert iou(silhouette.mask, mask) < 0.5
    assert says(silhouette, "more differs a little, pale parts or what compression left: --background '#c")
    assert iou(load(compressed, background="#c8c8c8", threshold=0.03).mask, mask) > 0.8


@pytest.mark.parametrize("quality", [75, 90])
def test_small_jpeg__without_pale_parts_asks_nothing(quality: int) -> None:
    picture, mask = antialiased(64, [(disc(512, 0.4), (40, 60, 90))], (200, 200, 200))
    silhouette = load_silhouette(encoded(picture, "JPEG", quality=quality))
    assert iou(silhouette.mask, mask) > 0.95
    assert not says(silhouette, "--")


def test_grain__is_no_pale_part() -> None:
    noise = np.random.default_rng(0).normal(0.0, 12.0, (SIZE, SIZE))
    grainy = np.clip(np.where(chair(), 60.0, 200.0) + noise, 0, 255).astype(np.uint8)
    assert not says(load_silhouette(grainy), "differs a little")


def test_colour__that_finds_nothing_says_so() -> None:
    halves = np.where(np.arange(32) < 16, 200, 184) + np.random.default_rng(0).integers(-3, 4, (32, 32))
    assert says(load_silhouette(halves.astype(np.uint8)), "colour finds none that stands out from the border")


def test_dust__is_told_apart_with_the_option_that_drops_it() -> None:
    picture = painted(chair())
    for row, column in ((6, 66), (6, 78), (18, 66), (18, 78)):
        assert not chair()[row - 2 : row + 5, column - 2 : column + 5].any()
        picture[row : row + 3, column : column + 2] = 0
    silhouette = load_silhouette(picture)
    assert "object has 5 separate parts, 4 of at most 6 pixels: --min-speck 7 drops those" in silhouette.notes
    assert np.array_equal(load(picture, min_speck=7).mask, chair())
    everything = load(picture, min_speck=10_000)
    assert np.array_equal(everything.mask, silhouette.mask)
    assert says(everything, "every part has less than 10000 pixels and is kept: give a lower --min-speck")


def test_checkerboard__of_pixels_is_grey_up_to_its_border_and_one_of_blocks_is_parts() -> None:
    odd = np.add.outer(np.arange(64), np.arange(64)) % 2 == 1
    square = np.zeros((64, 64), dtype=bool)
    square[10:54, 10:54] = True
    silhouette = load_silhouette(painted(square & odd))
    assert (silhouette.mask ^ square).sum() <= 2  # a corner is a pixel of the ground, for all that can be seen
    assert says(silhouette, "a pattern of them is taken for grey: --keep-specks keeps it")
    blocks = np.kron(np.add.outer(np.arange(6), np.arange(6)) % 2 == 1, np.ones((8, 8), dtype=bool))
    assert "object has 18 separate parts" in load_silhouette(painted(np.pad(blocks, 8))).notes


def test_noise__is_refused_and_an_honest_pattern_is_not() -> None:
    rng = np.random.default_rng(0)
    for shape in ((64, 64), (64, 64, 3)):
        with pytest.raises(SilhouetteError, match=r"is noise, .*; alpha, colour and lightness were tried"):
            load_silhouette(rng.integers(0, 256, shape, dtype=np.uint8))
    salted = painted(chair())
    salted[rng.random((SIZE, SIZE)) < 0.02] = 0
    assert iou(load_silhouette(salted).mask, chair()) > 0.95


def test_object__that_is_hollow_for_its_ground_is_like_it_says_how_to_take_more() -> None:
    rng = np.random.default_rng(0)
    picture = painted(disc(SIZE, 0.4), (40, 60, 90), (200, 200, 200)).astype(int)
    picture[disc(SIZE, 0.4) & (np.arange(SIZE) > 48)] = (230, 120, 40)
    picture[disc(SIZE, 0.3)] = (206, 206, 214)
    noisy = np.clip(picture + rng.integers(-6, 7, picture.shape), 0, 255).astype(np.uint8)
    silhouette = load_silhouette(noisy)
    assert iou(silhouette.mask, disc(SIZE, 0.4) & ~disc(SIZE, 0.3)) > 0.95
    assert says(silhouette, "of what its outline encloses looks like the background: --background")


# --- dirt ---


def test_pixel__of_a_small_picture_is_a_detail() -> None:
    mask = np.zeros((11, 8), dtype=bool)
    mask[2:9, 1:7] = True
    mask[4, 2] = mask[4, 5] = False
    mask[0, 0] = True
    assert np.array_equal(load_silhouette(mask).mask[:, 1:9], mask)


def test_specks__that_are_all_there_is_are_what_is_drawn() -> None:
    dots = np.zeros((SIZE, SIZE), dtype=bool)
    dots[10:90:4, 10:90:4] = True
    dots[10:13, 10:13] = True
    silhouette = load_silhouette(dots)
    assert np.array_equal(silhouette.mask, dots)
    assert says(silhouette, "399 specks of less than 4 pixels kept")


def test_dirt__is_what_the_options_call_so() -> None:
    dirty = chair()
    dirty[3, 3] = dirty[8, 80] = dirty[8, 81] = True
    assert np.array_equal(load(dirty).mask, chair())
    assert np.array_equal(load(dirty, keep_specks=True).mask, dirty)
    assert load(dirty, min_speck=2).mask.sum() == dirty.sum() - 1


# --- what overrules ---


def test_object__of_a_colour_that_was_named() -> None:
    picture = painted(chair(), RED)
    blue = np.roll(chair(), -25, axis=1) & ~chair()
    picture[blue] = (30, 60, 220)
    assert np.array_equal(load(picture).mask, chair() | blue)
    for name in ("red", "#ff0000", "rgb(250, 4, 2)"):
        assert np.array_equal(load(picture, object=name).mask, chair())
    assert np.array_equal(load(picture, object="blue", background="red").mask, blue)
    assert np.array_equal(load(picture, object="white").mask, ~(chair() | blue))


def test_background__of_a_colour_that_was_named() -> None:
    picture = painted(chair(), RED)
    assert np.array_equal(load(picture, background="red").mask, ~chair())
    assert np.array_equal(load(picture, background="white").mask, chair())


def test_threshold__is_a_grey_level_or_a_distance_from_a_colour() -> None:
    levels = np.full((SIZE, SIZE), 250, np.uint8)
    levels[20:70, 20:70], levels[30:50, 30:50] = 150, 30
    assert load(levels, threshold=0.3).mask.sum() == 400
    assert load(levels, threshold=0.7).mask.sum() == 2500
    assert load(levels, threshold=0.3, object="light").mask.sum() == SIZE**2 - 400
    assert load(levels, background="#fafafa", threshold=0.5).mask.sum() == 400
    assert load(levels, object="#1e1e1e", threshold=0.1).mask.sum() == 400


# --- refusals ---


@pytest.mark.parametrize(
    ("options", "finding"),
    [
        ({"object": "reddish"}, "object 'reddish' is not known; expected auto, dark, light, alpha, or a colour"),
        ({"background": "#12345"}, "background '#12345' is not known; expected a colour"),
        ({"threshold": 1.5}, "threshold is 1.5; expected a number between 0 and 1"),
        ({"alpha_threshold": 0.0}, "alpha_threshold is 0; expected"),
        ({"min_speck": -1}, "min_speck=-1: expected a whole number of at least 0"),
        ({"min_speck": "3"}, "min_speck='3': expected a whole number"),
        ({"threshold": "high"}, "threshold='high': expected a number"),
        ({"min_speck": 4, "keep_specks": True}, "contradict each other"),
        ({"object": "dark", "background": "white"}, "does not look at the background"),
        ({"object": "alpha", "threshold": 0.5}, "give alpha_threshold instead"),
        ({"object": "#ff0000", "background": "red"}, "object and background are both '#ff0000'"),
    ],
)
def test_options__that_mean_nothing_are_refused(options: dict[str, Any], finding: str) -> None:
    with pytest.raises(ConfigError) as caught:
        ObjectOptions(**options)
    assert finding in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("picture", "options", "finding"),
    [
        (painted(chair()), {"object": "alpha"}, "has no alpha channel, so that object 'alpha' finds nothing"),
        (painted(chair()), {"alpha_threshold": 0.3}, "so that alpha_threshold 0.3 finds nothing"),
        (painted(chair(), RED), {"object": "lime"}, "shows no lime (the object asked for); it mostly has #ffffff"),
        (painted(chair()), {"background": "magenta"}, "shows no magenta (the background asked for)"),
        (painted(chair(), GREY), {"threshold": 0.1}, "which is nowhere in it"),
        (chair(), {"object": "dark"}, "says itself what is object"),
    ],
)
def test_options__that_the_picture_has_nothing_for_are_refused(
    picture: np.ndarray, options: dict[str, Any], finding: str
) -> None:
    with pytest.raises(SilhouetteError) as caught:
        load(picture, **options)
    assert finding in str(caught.value) and "\n" not in str(caught.value)


# --- frames ---


def test_frames__the_first_that_shows_something_is_taken() -> None:
    blank, shown = Image.new("L", (SIZE, SIZE), 255), Image.fromarray(painted(chair())).convert("L")
    for format in ("GIF", "TIFF", "PNG", "WEBP"):
        stream = encoded(blank, format, save_all=True, append_images=[blank, shown])
        silhouette = load_silhouette(stream)
        assert iou(silhouette.mask, chair()) > 0.98
        assert "the first that shows something" in silhouette.notes[0]


def test_frames__that_are_all_blank_are_counted() -> None:
    frames = [Image.new("L", (9, 9), level) for level in (255, 0, 255)]
    stream = encoded(frames[0], "GIF", save_all=True, append_images=frames[1:])
    with pytest.raises(AutoPolyError, match=r"white everywhere.* in all of its 3 frames"):
        load_silhouette(stream)


def test_frames__of_an_animation_that_is_cut_short_are_those_before() -> None:
    first, second = (Image.fromarray(painted(np.roll(chair(), step, 1))) for step in (0, 9))
    whole = encoded(first, "GIF", save_all=True, append_images=[second]).getvalue()
    assert iou(load_silhouette(io.BytesIO(whole[: len(whole) - 40])).mask, chair()) > 0.98
