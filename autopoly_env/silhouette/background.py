"""What the background of a picture looks like: the colour of most of its border, even or fading, without its frame."""

from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import AnyArray, BoolArray, Float32Array, FloatArray, IntArray
from autopoly_env.silhouette.connectivity import areas

# Distances are those of Oklab: 1 between black and white; what people just notice is about 0.01 to 0.02.
SAME = 0.06  # colours this close are one
FRAME_SHARE = 0.04  # of the shorter side: a frame is no wider
FRAME_DIFFERS = 0.15  # from the page
FRAME_PURE = 0.9  # share of a line that has to be frame
STUDIED = 100  # pixels a side, about: a field of light is fitted to so many
FADING = 0.12  # a field that varies less along the border is even light
EVEN_ENOUGH = 0.85  # share of the border that one colour explains: no field is tried
FLAT, FLAT_SHARE = 0.01, 0.3  # nor where so much of it is of one colour to the letter, as in drawings,
DRIFTING, SMOOTH = 0.2, 0.8  # but not if so much of the border is nearly of that colour, in steps that are so smooth
STEP, LEVELS = 0.004, 4  # and on so many levels: then the light fades a little
PALE_SHARE = 0.75  # of what is nearly of that colour has one colour of its own: something pale that touches the border
FLAT_SUPPORT = 0.9  # of what is that flat: an object may hide the rest of the border
LETTER, LETTER_SHARE = 0.002, 0.8  # so much of what is flat is that very colour in a drawing, whose edges are the rest
RUN, EVEN, EVEN_SHARE = 8, 0.015, 0.6  # of runs of pixels near the colour, their middle is this close: JPEG, not light
CANDIDATES = 5  # colours of the border that may be the background's
CORNER_VOTE = 0.15  # what each corner adds to the share of its colour
FIELD_GAIN = 0.08  # by which a field must explain more of it
FIELD_ORDERS = (2, 3, 4, 4, 4)  # of the polynomials that are fitted one after the other
BLOCK = 2**13  # pixels whose distances are taken at a time
ROWS = 512  # of a product: BLAS starts no threads for so few
MOST_POINTS = 4096  # of the border that are looked at

Frame = tuple[int, int, int, int]  # pixels at the top, bottom, left, right
NO_FRAME = (0, 0, 0, 0)


@dataclass(frozen=True, eq=False)
class Background:
    """The background of a picture (H, W) in C features.

    `colour` (C,) is its colour, with even light; where it fades, `field` (C, 5, 5) has the coefficients of x^i y^j, x
    and y from -1 to 1, or None. `share` of the border looks like that, within `noise`; `is_flat` if it is one
    colour to the letter, as in a drawing.
    """

    colour: Float32Array
    field: FloatArray | None
    share: float
    noise: float
    is_flat: bool = False
    is_even: bool = False

    @property
    def support(self) -> float:
        """How sure it is that this is the background, 0 to 1."""
        return max(self.share, FLAT_SUPPORT) if self.is_flat or self.is_even else self.share

    def distances(self, features: Float32Array) -> Float32Array:
        """How far (H, W) every pixel is from the background."""
        height, width, n_channels = features.shape
        distances = np.empty((height, width), dtype=np.float32)
        n_rows = max(1, BLOCK // width)
        powers = _powers(height).T.astype(np.float32)
        terms = None if self.field is None else (self.field.swapaxes(1, 2) @ _powers(width)).astype(np.float32)
        for top in range(0, height, n_rows):  # so few rows stay in the cache, and BLAS starts no threads for them
            rows = slice(top, top + n_rows)
            squares = distances[rows]
            squares[:] = 0
            for channel in range(n_channels):
                expected = self.colour[channel] if terms is None else powers[rows] @ terms[channel]
                squares += np.square(features[rows, :, channel] - expected)
            np.sqrt(squares, out=squares)
        return distances

    def differences(self, features: Float32Array, rows: IntArray, columns: IntArray) -> Float32Array:
        """How, by feature, the pixels at N rows and columns differ from it: (N, C)."""
        if self.field is None:
            return features[rows, columns] - self.colour
        height, width, _ = features.shape
        down, right = _powers(height)[:, rows], _powers(width)[:, columns]
        expected = np.einsum("cij,in,jn->nc", self.field, right, down, optimize=True)
        return (features[rows, columns] - expected).astype(np.float32)


def find_background(features: Float32Array) -> Background:
    """The background (H, W, C), judged by the border: by what most of it looks like."""
    points = _thinned(border(features))
    corners = features[[0, 0, -1, -1], [0, -1, 0, -1]]
    colour, share = dominant(points, corners)
    residuals = np.linalg.norm(points - colour, axis=1)
    is_flat = float((residuals < FLAT).mean()) >= FLAT_SHARE and not _fades_a_little(features, colour)
    near = residuals[residuals < FLAT]
    noise = _noise(near if is_flat else residuals)
    if is_flat and float((near < LETTER).mean()) >= LETTER_SHARE:
        noise = LETTER
    is_even = not is_flat and _is_even(features, colour)
    found = Background(colour, None, share, noise, is_flat, is_even)
    if share >= EVEN_ENOUGH or is_flat or is_even or min(features.shape[:2]) < 16:
        return found
    fading = _fading(features)
    return found if fading is None or fading.share < share + FIELD_GAIN else fading


def _is_even(features: Float32Array, colour: Float32Array) -> bool:
    """Whether three corners and much of the border are of a colour, but for noise: it does not drift off from it."""
    corners = features[[0, 0, -1, -1], [0, -1, 0, -1]]
    if (np.linalg.norm(corners - colour, axis=1) < SAME).sum() < 3:
        return False
    sides = (features[0], features[-1], features[:, 0], features[:, -1])
    runs = np.concatenate([side[: len(side) // RUN * RUN].reshape(-1, RUN, side.shape[1]) for side in sides])
    away = np.linalg.norm(np.median(runs, axis=1) - colour, axis=1)
    n_close = int((away < EVEN).sum())
    return n_close >= FLAT_SHARE * len(runs) and n_close >= EVEN_SHARE * int((away < SAME).sum())


def _fades_a_little(features: Float32Array, colour: Float32Array) -> bool:
    """Whether much of the border drifts off from a colour, in small steps and many of them."""
    lines = (features[0], features[-1], features[:, 0], features[:, -1])
    away = np.concatenate([np.linalg.norm(line - colour, axis=1) for line in lines])
    near = (away > FLAT) & (away < SAME)
    if near.mean() < DRIFTING:
        return False
    steps = np.abs(np.diff(away))[near[1:]]
    shares = np.bincount((away[near] / STEP).astype(int)) / near.sum()
    is_one_colour = shares.max() >= PALE_SHARE
    return bool((steps < FLAT).mean() >= SMOOTH and (shares >= 0.05).sum() >= LEVELS and not is_one_colour)


def find_frame(features: Float32Array) -> Frame:
    """Dark lines along the sides of a lighter page, such as a scan's edge: how many pixels of each side they take."""
    height, width, _ = features.shape
    limit = int(FRAME_SHARE * min(height, width))
    if limit < 1:
        return NO_FRAME
    depth = 2 * limit + 1
    page, share = dominant(_thinned(border(features[depth:-depth, depth:-depth])))
    if share < FRAME_PURE:
        return NO_FRAME
    sides = (features, features[::-1], features.swapaxes(0, 1), features.swapaxes(0, 1)[::-1])
    widths = [_frame_width(side[: limit + 2], page, limit) for side in sides]
    return (widths[0], widths[1], widths[2], widths[3])


def _frame_width(lines: Float32Array, page: Float32Array, limit: int) -> int:
    """How many of the lines (N, L, C) from one side inwards are frame; 0 if it is wider than `limit`."""
    away = np.linalg.norm(lines - page, axis=2)
    is_frame = (away > FRAME_DIFFERS) & (lines[..., 0] < page[0])
    pure = is_frame.mean(axis=1) >= FRAME_PURE
    if not pure[0] or pure[limit:].all():
        return 0
    width = int(np.argmin(pure))
    soft = (away[width:] > SAME).mean(axis=1) >= FRAME_PURE  # its blurred edge
    return width + (int(np.argmin(soft)) if not soft.all() else len(soft))


def without(array: AnyArray, frame: Frame) -> AnyArray:
    """A view of a picture (H, W, ...) without its frame."""
    top, bottom, left, right = frame
    return array[top : array.shape[0] - bottom, left : array.shape[1] - right]


def border(array: AnyArray) -> AnyArray:
    """The outermost pixels (N, ...) of a picture (H, W, ...)."""
    if min(array.shape[:2]) < 3:
        return array.reshape(-1, *array.shape[2:])
    return np.concatenate([array[0], array[-1], array[1:-1, 0], array[1:-1, -1]])


def dominant(points: Float32Array, corners: Float32Array | None = None) -> tuple[Float32Array, float]:
    """The colour (C,) around which most of the points (N, C) lie, and the share that lies within SAME of it.

    What lies within FLAT counts twice, and the corners (4, C) have a vote beside that. Of two that as many points have,
    the lighter one.
    """
    cells = np.floor(points / FLAT).astype(np.int64) + 2**15
    codes = cells @ 2 ** (16 * np.arange(cells.shape[1])[::-1])  # one number for each is quicker to sort
    _, first, inverse, counts = np.unique(codes, return_index=True, return_inverse=True, return_counts=True)
    best: tuple[float, float] = (-1.0, 0.0)
    colour, best_share = points[0], 0.0
    tried: list[int] = []
    for cell in np.argsort(-counts, kind="stable"):
        if any(np.linalg.norm(points[first[cell]] - points[first[other]]) < 0.5 * SAME for other in tried):
            continue
        tried.append(cell)
        centre = _settled(points, np.median(points[inverse == cell], axis=0))
        away = np.linalg.norm(points - centre, axis=1)
        share, flat = float((away < SAME).mean()), float((away < FLAT).mean())
        n_corners = 0 if corners is None else int((np.linalg.norm(corners - centre, axis=1) < SAME).sum())
        key = (round(share + flat + CORNER_VOTE * n_corners, 3), float(centre[0]))
        if key > best:
            best, best_share, colour = key, share, centre.astype(np.float32)
        if len(tried) == CANDIDATES:
            break
    return colour, best_share


def _settled(points: Float32Array, centre: AnyArray) -> AnyArray:
    """The middle of the points around a centre; the centre itself where most of those are its colour to the letter."""
    for _ in range(3):
        away = np.linalg.norm(points - centre, axis=1)
        near = away < SAME
        if (away < FLAT).sum() >= 0.5 * near.sum():
            break
        centre = np.median(points[near], axis=0)
    return centre


def _fading(features: Float32Array) -> Background | None:
    """The background as a smooth field, grown from the border inwards; None if the border is not like that."""
    height, width, n_channels = features.shape
    step = max(1, max(height, width) // STUDIED)
    small = np.ascontiguousarray(features[::step, ::step])
    basis = _basis(small.shape)
    is_border = np.zeros(small.shape[:2], dtype=bool)
    is_border[[0, -1]] = is_border[:, [0, -1]] = True
    coefficients = _robust_fit(basis, small, is_border, FIELD_ORDERS[0])
    residual = _residual(basis, small, coefficients)
    border_residual = border(residual)
    if float((border_residual < SAME).mean()) < 0.6:
        return None
    for order in FIELD_ORDERS:
        parts, count = areas(residual < 1.5 * SAME)
        reached = np.zeros(count + 1, dtype=bool)
        reached[border(parts)] = True
        reached[0] = False
        coefficients = _fit(basis, small, reached[parts], order)
        residual = _residual(basis, small, coefficients)
    border_residual = border(residual)
    fitted = border(_product(basis, coefficients))
    if np.ptp(fitted[:, 0]) < FADING:
        return None
    share = float((border_residual < SAME).mean())
    field = coefficients.reshape(n_channels, 5, 5)
    return Background(features.reshape(-1, n_channels)[0], field, share, _noise(border_residual))


def _noise(residuals: AnyArray) -> float:
    """How far pixels of the background stray from it, but for the odd one."""
    inliers = residuals[residuals < SAME]
    return float(np.quantile(inliers, 0.96)) if len(inliers) else SAME


def _basis(shape: tuple[int, ...]) -> FloatArray:
    """x^i y^j of every pixel: (H, W, 25), at 5 i + j."""
    x, y = _powers(shape[1]), _powers(shape[0])
    return np.einsum("jh,iw->hwij", y, x).reshape(shape[0], shape[1], 25)


def _powers(size: int) -> FloatArray:
    return np.linspace(-1.0, 1.0, size) ** np.arange(5)[:, None]


def _terms(order: int) -> AnyArray:
    """Which of the 25 terms a polynomial of that order has."""
    return np.flatnonzero(np.add.outer(np.arange(5), np.arange(5)).ravel() <= order)


def _fit(basis: FloatArray, features: Float32Array, chosen: BoolArray, order: int) -> FloatArray:
    """Least squares over the chosen pixels: coefficients (C, 25)."""
    terms = _terms(order)
    return _solved(basis[chosen].take(terms, axis=1), features[chosen], None, terms)


def _robust_fit(basis: FloatArray, features: Float32Array, chosen: BoolArray, order: int) -> FloatArray:
    """The same, in which pixels that are far off count less (least absolute deviations, reweighted)."""
    terms = _terms(order)
    rows, values = basis[chosen][:, terms], features[chosen]
    coefficients = _solved(rows, values, None, terms)
    for _ in range(12):
        off = np.linalg.norm(values - _product(rows, coefficients[:, terms]), axis=1)
        coefficients = _solved(rows, values, 1.0 / np.maximum(off, 0.005), terms)
    return coefficients


def _solved(rows: FloatArray, values: Float32Array, weights: FloatArray | None, terms: AnyArray) -> FloatArray:
    """The normal equations of rows (N, T) and values (N, C), solved: (C, 25)."""
    n_terms = len(terms)
    columns = np.concatenate([rows, values], axis=1)
    weighted = rows if weights is None else rows * weights[:, None]
    sums = np.zeros((n_terms, columns.shape[1]))
    for start in range(0, len(rows), ROWS):
        sums += weighted[start : start + ROWS].T @ columns[start : start + ROWS]
    normal = sums[:, :n_terms] + 1e-9 * len(rows) * np.eye(n_terms)
    coefficients = np.zeros((values.shape[1], 25))
    coefficients[:, terms] = np.linalg.solve(normal, sums[:, n_terms:]).T
    return coefficients


def _product(basis: FloatArray, coefficients: FloatArray) -> FloatArray:
    """The polynomials (C, T) at every pixel (..., T): (..., C)."""
    return basis @ coefficients.T


def _residual(basis: FloatArray, features: Float32Array, coefficients: FloatArray) -> AnyArray:
    apart = features - _product(basis, coefficients)
    return np.sqrt(np.einsum("hwc,hwc->hw", apart, apart))


def _thinned(points: AnyArray) -> AnyArray:
    return points[:: max(1, len(points) // MOST_POINTS)]
