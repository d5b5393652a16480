"""The target: a silhouette image as an exact, square object mask, and its area averages at any resolution."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from autopoly_env.arguments import whole
from autopoly_env.arrays import BoolArray, FloatArray, read_only
from autopoly_env.errors import SilhouetteError
from autopoly_env.silhouette import cleaning, object_mask, target_kernels
from autopoly_env.silhouette.connectivity import is_slanting_line
from autopoly_env.silhouette.image_files import find_images
from autopoly_env.silhouette.loading import NAMELESS, ImageSource, Picture, read_frames
from autopoly_env.silhouette.options import DEFAULT_OPTIONS, ObjectOptions

__all__ = ["SMALL", "ImageSource", "Silhouette", "Target", "find_images", "load_silhouette"]

WEIGHT_STEPS = 2**20  # of a weight of 1
MOST_RESOLUTION = 4096  # of a target
_NO_WEIGHTS = read_only(np.empty((0, 0)))
SMALL = 64  # pixels a side; a smaller picture has too few pixels to tell shapes apart by counting them


@dataclass(frozen=True, eq=False, repr=False)
class Target:
    """A silhouette at resolution R, with what the rasteriser and the score read off it.

    Only `coverage` is given, everything else follows from it, when it is asked for; all arrays are C-contiguous and
    read-only:

    - `coverage` (R, R) float64 in 0..1: the share of each cell that is object.
    - `mask` (R, R) bool: coverage >= 0.5.
    - `row_sum`, `row_square_sum` (R, R+1) float64: prefix sums along the rows of coverage and of its square,
      from 0, so that `row_sum[y, b] - row_sum[y, a]` is the sum over the columns a..b-1.
    - `mask_sum` (R, R+1) float64: the same of `mask`; `n_filled`: how many cells of it are set.

    Where cells are not all worth the same, `weights` (R, R) >= 0 say so, rounded to multiples of 2**-20: sums of them
    are then exact. `weight_sum` (R, R+1) are their prefix sums, None without, and each sum above (and
    `n_filled`) counts every cell times its weight.

    `by_area`: the IoU counts a cell by the share of it that a mesh covers; otherwise as 1 from half coverage on, as the
    paper does.
    """

    coverage: FloatArray
    weights: FloatArray | None = None
    by_area: bool = False

    def __post_init__(self) -> None:
        coverage = np.array(self.coverage, dtype=np.float64, order="C")
        if coverage.ndim != 2 or coverage.shape[0] != coverage.shape[1] or coverage.size == 0:
            raise SilhouetteError(f"coverage has shape {coverage.shape}; expected a square (R, R): pad it")
        object.__setattr__(self, "coverage", read_only(coverage))
        if self.weights is not None:
            object.__setattr__(self, "weights", read_only(np.rint(self.weights * WEIGHT_STEPS) / WEIGHT_STEPS))

    @cached_property
    def _row_sums(self) -> tuple[FloatArray, ...]:
        among = _NO_WEIGHTS if self.weights is None else self.weights
        return tuple(map(read_only, target_kernels.row_sums(self.coverage, among)))

    @cached_property
    def _filled(self) -> tuple[BoolArray, FloatArray, float]:
        is_weighted = self.weights is not None
        among = self.weights if is_weighted else _NO_WEIGHTS
        mask, mask_sum, n_filled = target_kernels.filled_sums(self.coverage, among)
        return read_only(mask), read_only(mask_sum), float(n_filled) if is_weighted else int(n_filled)

    @property
    def row_sum(self) -> FloatArray:
        return self._row_sums[0]

    @property
    def row_square_sum(self) -> FloatArray:
        return self._row_sums[1]

    @property
    def weight_sum(self) -> FloatArray | None:
        return None if self.weights is None else self._row_sums[2]

    @property
    def mask(self) -> BoolArray:
        return self._filled[0]

    @property
    def mask_sum(self) -> FloatArray:
        return self._filled[1]

    @property
    def n_filled(self) -> float:
        return self._filled[2]

    @property
    def resolution(self) -> int:
        """R, in cells a side."""
        return len(self.coverage)

    def __repr__(self) -> str:
        return f"Target(resolution={self.resolution})"

    def __reduce__(self) -> tuple[Any, ...]:
        return Target, (self.coverage, self.weights, self.by_area)  # so that an unpickled one is read-only as well


@dataclass(frozen=True, eq=False)
class Silhouette:
    """A target shape: `mask` (R, R) bool, True is object, at the image's own resolution R; read-only.

    It fills the unit square, x right, y down. `notes` has a short sentence for everything that loading did or
    noticed; those that begin with "warning:" deserve to be shown. `picture_shape` (H, W) is what the image had before
    it was padded to a square, (R, R) by default. `weights` (R, R) in 0..1 say where matching matters, None: everywhere
    alike; `autopoly_env.guidance.guidance.importance.weighted` reads them from an image.

    Raises SilhouetteError for a mask that is not boolean, not square or without any object.
    """

    mask: BoolArray = field(repr=False)
    name: str = "silhouette"
    notes: tuple[str, ...] = ()
    picture_shape: tuple[int, int] | None = field(default=None, repr=False)
    weights: FloatArray | None = field(default=None, repr=False)
    _targets: dict[int, Target] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        mask = np.array(self.mask, order="C")
        if mask.dtype != np.bool_ or mask.ndim != 2 or mask.shape[0] != mask.shape[1]:
            given = f"the mask has shape {mask.shape} and dtype {mask.dtype}"
            raise SilhouetteError(f"{given}; expected (R, R) and bool: use load_silhouette for other images")
        if not mask.any():
            raise SilhouetteError("the mask is False everywhere: there is no object; expected some True pixels")
        object.__setattr__(self, "mask", read_only(mask))

    @property
    def resolution(self) -> int:
        """R, in pixels a side."""
        return len(self.mask)

    @cached_property
    def is_scored_by_area(self) -> bool:
        """Whether the picture has so few pixels that it is scored on exact areas: fewer than `SMALL` a side.

        Not so drawings in lines one pixel wide, some of them slanting: their pixels are steps, which nobody means.
        """
        return self.resolution < SMALL and not is_slanting_line(self.mask)

    def target(self, resolution: int) -> Target:
        """The silhouette on a grid of `resolution` x `resolution` cells: exact area averages, kept once made.

        The resolution need not divide the silhouette's own, and may exceed it (which gives blocks). At its own, that of
        a small picture is scored by area.

        Raises ConfigError for a resolution that is no whole number from 1 to `MOST_RESOLUTION`.
        """
        resolution = whole("target resolution", resolution, 1, MOST_RESOLUTION)
        if resolution not in self._targets:
            weights = None if self.weights is None else area_means(self.weights, (resolution, resolution))
            by_area = self.is_scored_by_area and resolution == self.resolution
            self._targets[resolution] = Target(target_kernels.area_average(self.mask, resolution), weights, by_area)
        return self._targets[resolution]

    def pyramid(self, levels: Sequence[int]) -> tuple[Target, ...]:
        """The targets at several resolutions, in the order given, e.g. `pyramid((8, 16, 32, 64))`."""
        return tuple(self.target(resolution) for resolution in levels)

    def __reduce__(self) -> tuple[Any, ...]:
        given = (self.mask, self.name, self.notes, self.picture_shape, self.weights)
        return Silhouette, given  # without the targets: cheaper made than sent


def load_silhouette(
    source: ImageSource, *, name: str | None = None, options: ObjectOptions = DEFAULT_OPTIONS
) -> Silhouette:
    """Load an image and find the object in it.

    `source` is a path, a binary file object, a PIL image or an array: (H, W) or (H, W, 1 to 4), uint8 or
    float in 0..1, or a boolean mask (True is object). The object is what the alpha channel shows, where a real share of
    the picture is clear; otherwise what differs in colour or lightness from the background, which most of the border
    shows (docs/pictures-in.md). Specks and pinholes go, pictures larger than 2048 pixels a side are reduced by an
    integer factor, and others than square ones are padded with background. What comes without a name, as arrays do, is
    named after its pixels. The notes say what was decided, `options`
    decide otherwise.

    Raises SilhouetteError when the source cannot be read, holds no object or not what the options ask for.

    >>> load_silhouette(np.eye(3, dtype=bool), name="diagonal")
    Silhouette(name='diagonal', notes=('object touches the border of the image',))
    """
    picture, mask, how_found = _first_object(source, options)
    mask, how_cleaned = cleaning.clean(mask, options)
    shape = mask.shape
    mask, how_padded = cleaning.square(mask)
    notes = (*picture.notes, *how_found, *how_cleaned, *how_padded)
    return Silhouette(mask, _own_name(picture.name, mask) if name is None else name, notes, (shape[0], shape[1]))


def _own_name(name: str, mask: BoolArray) -> str:
    """The name of a picture; one that has none, such as an array, is named after its pixels."""
    if name != NAMELESS:
        return name
    return f"silhouette-{hashlib.sha256(repr(mask.shape).encode() + np.packbits(mask).tobytes()).hexdigest()[:8]}"


def _first_object(source: ImageSource, options: ObjectOptions) -> tuple[Picture, BoolArray, list[str]]:
    """The first frame in which there is an object, its mask and the notes on it."""
    problems: list[SilhouetteError] = []
    for picture in read_frames(source):
        try:
            return picture, *object_mask.find_object(picture, options)
        except SilhouetteError as problem:
            problems.append(problem)
    if len(problems) == 1:
        raise problems[0]
    raise SilhouetteError(f"{problems[0]} (so it is in all of its {len(problems)} frames)")


def area_means(values: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Means of an image (H, W) over equal cells, as many as `shape` says; a cell may be smaller than a pixel."""
    for axis, n in enumerate(shape):
        size = values.shape[axis]
        prefix = np.concatenate((np.zeros_like(values.take([0], axis)), np.cumsum(values, axis)), axis)
        whole, rest = np.divmod(np.arange(n + 1) * size, n)  # the borders of the cells, in pixels
        begun = values.take(np.minimum(whole, size - 1), axis) * np.expand_dims(rest / n, 1 - axis)
        values = np.diff(prefix.take(whole, axis) + begun, axis=axis) * (n / size)
    return values
