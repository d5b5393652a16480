"""What a user may ask of a construction: where matching matters, a start, locked vertices, symmetry."""

from autopoly_env.guidance.guidance import AUTO, KEPT, MOST_CORNERS, Guidance, continued, importance_settings
from autopoly_env.guidance.importance import ImportanceSource, read_importance, weighted
from autopoly_env.guidance.symmetry import asymmetry, best_axis

__all__ = [
    "AUTO",
    "KEPT",
    "MOST_CORNERS",
    "Guidance",
    "ImportanceSource",
    "asymmetry",
    "best_axis",
    "continued",
    "importance_settings",
    "read_importance",
    "weighted",
]
