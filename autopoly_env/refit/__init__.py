"""Inverse shape estimation: vertices moved to match a target, by least squares and by the last fractions of a pixel."""

from autopoly_env.refit.mending import mended
from autopoly_env.refit.refitting import (
    DEFAULT,
    FROM_AFAR,
    LOCAL,
    QUICK,
    THOROUGH,
    Bonds,
    Judge,
    RefitConfig,
    RefitResult,
    RefitTarget,
    holding,
    quick_resolution,
    refit,
    refit_best,
)
from autopoly_env.refit.tuning import tune

__all__ = [
    "DEFAULT",
    "FROM_AFAR",
    "LOCAL",
    "QUICK",
    "THOROUGH",
    "Bonds",
    "Judge",
    "RefitConfig",
    "RefitResult",
    "RefitTarget",
    "holding",
    "mended",
    "quick_resolution",
    "refit",
    "refit_best",
    "tune",
]
