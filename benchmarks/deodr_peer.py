"""DEODR's 2-D rasteriser as a peer: loss and gradient of filled polygons, as fast as its interface allows.

What is done in its favour: one grey channel instead of three; its compiled functions are called directly, without the
checks of its Python layer; all arrays, the triangulation and the target exist beforehand and are written in place; the
image is not copied before the backward pass, which spoils it. What remains is its own work.
"""

import numpy as np
from deodr.differentiable_renderer import Scene2D
from deodr.differentiable_renderer_cython import renderSceneBCpp, renderSceneCpp

from autopoly_env.arrays import FloatArray
from benchmarks.triangulation import triangulate

_ANTIALIASING = 1.0  # pixels that its edges are overdrawn by: its default


class DeodrPolygons:
    """N polygons of V vertices each against one R x R target, drawn below each other in one tall image."""

    def __init__(self, polygons: FloatArray, target: FloatArray) -> None:
        """`polygons` (N, V, 2) in the unit square, the topology's first positions; `target` (R, R)."""
        n, v, _ = polygons.shape
        size = len(target)
        cuts = [triangulate(polygon) for polygon in polygons]
        faces = np.concatenate([cut + np.uint32(k * v) for k, (cut, _) in enumerate(cuts)])
        self._n, self._scale, self._shift = n, float(size), np.repeat(np.arange(n) * size, v)
        self._target = np.tile(target, (n, 1))[..., None]
        self._image, self._image_gradient = np.empty_like(self._target), np.empty_like(self._target)
        self._depth = np.empty((n * size, size))
        self._zero_positions, self._zero_colours = np.zeros((n * v, 2)), np.zeros((n * v, 1))
        self._scene = Scene2D(
            faces=faces,
            faces_uv=faces,
            ij=self.positions(polygons),
            depths=np.ones(n * v),
            textured=np.zeros(len(faces), bool),
            uv=np.zeros((n * v, 2)),
            shade=np.zeros(n * v),
            colors=np.ones((n * v, 1)),
            shaded=np.zeros(len(faces), bool),
            edgeflags=np.concatenate([outer for _, outer in cuts]),
            height=n * size,
            width=size,
            nb_colors=1,
            texture=np.zeros((0, 0, 1)),
            background_color=np.zeros(1),
            clockwise=True,
            backface_culling=True,
            integer_pixel_centers=False,
        )

    def positions(self, polygons: FloatArray) -> FloatArray:
        """Polygons (N, V, 2) of the unit square as its vertex array (N*V, 2), in pixels of the tall image."""
        points = polygons.reshape(-1, 2) * self._scale
        points[:, 1] += self._shift
        return points

    def retriangulate(self, positions: FloatArray) -> None:
        """Cut the polygon again: needed as it deforms, for triangles that flip are not drawn. For N = 1."""
        self._scene.faces, self._scene.edgeflags = triangulate(positions)
        self._scene.faces_uv = self._scene.faces

    def losses_and_gradient(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sums of squared pixel errors (N,), and the gradient (N*V, 2) of their sum with respect to the positions."""
        scene = self._scene
        scene.ij = positions
        renderSceneCpp(scene, _ANTIALIASING, self._image, self._depth, False, None, None, False)
        np.subtract(self._image, self._target, out=self._image_gradient)
        errors = self._image_gradient.reshape(self._n, -1)
        losses = np.vecdot(errors, errors)
        self._image_gradient *= 2.0
        # gradients are added to these; it stores the sums in new arrays
        scene.ij_b, scene.colors_b = self._zero_positions, self._zero_colours
        renderSceneBCpp(
            scene, _ANTIALIASING, self._image, self._depth, self._image_gradient, False, None, None, None, False
        )
        return losses, scene.ij_b
