"""Target pictures: found, read, told from their background, and averaged to any resolution."""

from autopoly_env.silhouette.connectivity import LEVEL, areas, distances_within, label_holes, label_parts, torn_corners
from autopoly_env.silhouette.image_files import IMAGE_SUFFIXES, find_images
from autopoly_env.silhouette.loading import ROUNDING, ImageSource, read_picture
from autopoly_env.silhouette.options import DEFAULT_OPTIONS, ObjectOptions
from autopoly_env.silhouette.silhouette import (
    SMALL,
    WEIGHT_STEPS,
    Silhouette,
    Target,
    area_means,
    load_silhouette,
)
from autopoly_env.silhouette.thumbnail import thumbnail

__all__ = [
    "DEFAULT_OPTIONS",
    "IMAGE_SUFFIXES",
    "LEVEL",
    "ROUNDING",
    "SMALL",
    "WEIGHT_STEPS",
    "ImageSource",
    "ObjectOptions",
    "Silhouette",
    "Target",
    "area_means",
    "areas",
    "distances_within",
    "find_images",
    "label_holes",
    "label_parts",
    "load_silhouette",
    "read_picture",
    "thumbnail",
    "torn_corners",
]
