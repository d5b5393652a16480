"""`ThinPlate`: the smoothest deformation of the plane that takes some points where they are wanted."""

from dataclasses import dataclass

import numpy as np

from autopoly_env.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class ThinPlate:
    """A thin-plate spline (Duchon 1977; Bookstein 1989): of all that take the anchors there the one that bends least.

    Three anchors move the plane affinely; more bend it. Letters: N anchors. Points are in the unit square.
    """

    anchors: FloatArray  # (N, 2)
    weights: FloatArray  # (N + 3, 2) of the anchors' kernels, then of 1, x and y

    @classmethod
    def through(cls, before: FloatArray, after: FloatArray) -> "ThinPlate":
        """The one that takes `before` (N, 2) to `after` (N, 2). Where nothing moves it is the identity, bit for bit."""
        n = len(before)
        system, wanted = np.zeros((n + 3, n + 3)), np.zeros((n + 3, 2))
        system[:n, :n], system[:n, n] = _kernel(before, before), 1.0
        system[:n, n + 1 :] = before
        system[n:, :n] = system[:n, n:].T
        wanted[:n] = after - before
        weights = np.linalg.lstsq(system, wanted, rcond=None)[0]  # least squares: anchors may coincide
        return cls(before, weights.astype(np.float64))

    def __call__(self, points: FloatArray) -> FloatArray:
        """(P, 2) where points (P, 2) go."""
        n = len(self.anchors)
        bent = _kernel(points, self.anchors) @ self.weights[:n]
        moved: FloatArray = points + (bent + self.weights[n] + points @ self.weights[n + 1 :])
        return moved


def _kernel(points: FloatArray, anchors: FloatArray) -> FloatArray:
    """(P, N) r² log r² of the distances r."""
    squared = ((points[:, None] - anchors[None]) ** 2).sum(axis=2)
    values: FloatArray = squared * np.log(np.where(squared > 0.0, squared, 1.0))
    return values
