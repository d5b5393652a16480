"""Prices of complexity w_sc, as settings give them: one, or two to draw from, evenly in their logarithm."""

import numpy as np


def prices_of(w_sc: float | tuple[float, float]) -> tuple[float, float]:
    """The least and the highest."""
    return w_sc if isinstance(w_sc, tuple) else (w_sc, w_sc)


def drawn_price(rng: np.random.Generator, low: float, high: float) -> float:
    """A price between two; of one price that one, and no number is drawn."""
    return low if low == high else float(np.exp(rng.uniform(np.log(low), np.log(high))))
