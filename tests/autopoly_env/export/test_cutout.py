"""Pictures of the mesh alone: transparent, and as a mask that is read back as a silhouette."""

from pathlib import Path

import numpy as np
import pytest

from autopoly_env import viewer
from autopoly_env.errors import ConfigError
from autopoly_env.export import save_png
from autopoly_env.export.cutout import mask_picture, mesh_picture
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS
from autopoly_env.silhouette import load_silhouette
from tests.helpers.shapes import polygon, shapely_coverage, star

RING = OPERATORS["face_delete"].apply(PolyMesh.grid(3, 0.125, 0.125, 0.875, 0.875), 4)


def test_mask__has_the_exact_share_of_each_pixel() -> None:
    import shapely

    points = star(4, 13)
    mask = np.asarray(mask_picture(polygon(points), 64), np.float64)
    assert mask.shape == (64, 64)
    np.testing.assert_allclose(mask / 255.0, shapely_coverage(shapely.Polygon(points), 64), atol=0.502 / 255.0)


def test_mask__is_read_back_as_the_mesh(tmp_path: Path) -> None:
    read = load_silhouette(save_png(mask_picture(RING, 64), tmp_path / "ring.png"))
    assert read.mask.sum() == 48 * 48 - 16 * 16 and not read.mask[32, 32]


def test_mesh_picture__is_clear_beside_the_mesh_and_in_its_holes() -> None:
    picture = np.asarray(mesh_picture(RING, 256))
    assert picture.shape == (256, 256, 4)
    assert picture[0, 0, 3] == picture[128, 128, 3] == 0
    assert tuple(picture[56, 56]) == (*viewer.MATCH, 255) and tuple(picture[96, 52]) == (*viewer.INK, 255)
    rim = picture[(picture[:, :, 3] > 64) & (picture[:, :, 3] < 255)]
    assert len(rim) and np.abs(rim[:, :3] - np.array(viewer.INK, float)).max() <= 4  # ink, not a pale fringe


@pytest.mark.parametrize("size", [0, -4, 8, 9000])
def test_size__that_is_none_is_refused(size: int) -> None:
    for draw in (mesh_picture, mask_picture):
        with pytest.raises(ConfigError, match=f"size {size}: expected a whole number of pixels, 16 to 8192"):
            draw(RING, size)
