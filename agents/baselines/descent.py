"""Plain gradient descent on the vertices, as with a differentiable renderer; needs torch, so import it lazily.

It is what the paper compares with: no pyramid, no elastic term, no second derivatives. A vertex that does not show in
the picture has no gradient and stays where it is. Letters: V vertices, R pixels a side.
"""

import torch

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import FaceRule, PolyMesh, is_sane
from autopoly_env.raster.autograd import coverage
from autopoly_env.silhouette import Target


class Descent:
    """Adam (Kingma and Ba 2015) on the weighted sum of squared differences of a mesh's rendering and a target (R, R).

    `mesh` is the best so far, of those without crossings and flipped faces unless `allow_defects`, and of those that
    keep the rule `faces`.
    """

    def __init__(
        self, mesh: PolyMesh, target: Target, learning_rate: float, allow_defects: bool, faces: FaceRule = "any"
    ) -> None:
        self.mesh = mesh
        self._least = float("inf")
        self._allow_defects, self._faces = allow_defects and faces == "any", faces
        self._wanted = torch.from_numpy(target.coverage.copy())
        self._weights = None if target.weights is None else torch.from_numpy(target.weights.copy())
        self._edges = torch.from_numpy(mesh.topology.boundary_half_edges.copy())
        self._vertices = torch.tensor(mesh.vertices[None], requires_grad=True)
        self._optimiser = torch.optim.Adam([self._vertices], lr=learning_rate)

    def run(self, iterations: int) -> None:
        """So many steps; what the last one leads to is looked at, too."""
        for _ in range(iterations):
            self._optimiser.zero_grad()
            self._loss().backward()
            self._optimiser.step()
        with torch.no_grad():
            self._loss()

    def _loss(self) -> torch.Tensor:
        """The loss where the vertices are; the mesh is kept if it is the best so far."""
        images = coverage(self._vertices, self._edges, len(self._wanted))
        errors = (images[0] - self._wanted).square()
        loss = (errors if self._weights is None else self._weights * errors).sum()
        if loss.item() < self._least:
            points: FloatArray = self._vertices.detach().numpy()[0].copy()
            mesh = self.mesh.with_vertices(points)
            if self._allow_defects or is_sane(mesh, self._faces):
                self._least, self.mesh = loss.item(), mesh
        return loss
