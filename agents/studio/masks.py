"""What the page shows of a mask, and what a search sees of a painted one: each made once, for it takes a moment."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

from agents.studio.painting import levels_of
from autopoly_env.export.pictures import picture_url
from autopoly_env.guidance import best_axis, weighted
from autopoly_env.silhouette import Silhouette

TARGET_SIZE = 768  # pixels a side of the mask on the page, at most


@lru_cache(maxsize=64)
def plain_mask(silhouette: Silhouette | None) -> dict[str, Any]:
    """The mask as a picture, where in its square the picture lies, its share, and the axis that suits it best."""
    if silhouette is None:
        return {"target": None, "frame": [0, 0, 1, 1], "share": 0.0, "best_axis": 0.5}
    size = silhouette.resolution
    height, width = silhouette.picture_shape or (size, size)
    return {
        "target": picture_url(silhouette, (255, 255, 255), TARGET_SIZE),
        "frame": [(size - width) // 2 / size, (size - height) // 2 / size, width / size, height / size],
        "share": round(float(silhouette.mask.mean()), 4),
        "best_axis": round(best_axis(silhouette), 4),
    }


@lru_cache(maxsize=2)
def painted_target(silhouette: Silhouette, painted: bytes | None) -> Silhouette:
    """A copy of the silhouette, with what matters in it. Raises ConfigError where nothing of the object does.

    A copy, since its targets take forty times the memory of its mask, and are kept only as long as it is.
    """
    return replace(silhouette) if painted is None else weighted(silhouette, levels_of(painted))
