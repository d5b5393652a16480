"""Target pictures: found, read, told from their background, and averaged to any resolution."""

from autopoly_env.silhouette.image_files import IMAGE_SUFFIXES, find_images
from autopoly_env.silhouette.loading import ROUNDING, ImageSource, read_picture
from autopoly_env.silhouette.options import DEFAULT_OPTIONS, ObjectOptions
from autopoly_env.silhouette.silhouette import WEIGHT_STEPS, Silhouette, Target, area_means, load_silhouette
from autopoly_env.silhouette.thumbnail import thumbnail

__all__ = [
    "DEFAULT_OPTIONS",
    "IMAGE_SUFFIXES",
    "ROUNDING",
    "WEIGHT_STEPS",
    "ImageSource",
    "ObjectOptions",
    "Silhouette",
    "Target",
    "area_means",
    "find_images",
    "load_silhouette",
    "read_picture",
    "thumbnail",
]
