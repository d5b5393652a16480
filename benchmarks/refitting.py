"""Rows about the refit: a 16-gon from a circle to the horse, against gradient descent with DEODR and with our op."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import loss_and_gradient
from autopoly_env.refit import RefitTarget, refit
from autopoly_env.score import self_intersections
from autopoly_env.silhouette import Target
from benchmarks.report import Must, Row, faster, not_measured
from benchmarks.shapes import horse_silhouette, regular
from benchmarks.timing import least_seconds

RESOLUTION = 64
N_STEPS = 200
DEODR_SPEED = Must(">=", 20.0)
TORCH_SPEED = Must(">=", 5.0)
NO_WORSE = Must("<=", 1.0)
_RATES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 5.0)  # Adam's learning rates that are tried, in pixels

Descent = Callable[[float], FloatArray]  # learning rate in pixels -> vertices (V, 2), unit square


@dataclass(frozen=True)
class _Tuned:
    """A peer at its best learning rate."""

    descend: Callable[[], FloatArray]
    rate: float
    mesh: PolyMesh
    loss: float  # exact

    def __str__(self) -> str:
        return f"{_condition(self.mesh)}; best of {len(_RATES)} rates, {self.rate:g} px"


def refit_rows() -> Iterator[Row]:
    """Time and exact loss of one refit, against 200 steps of Adam (at the rate that ends best) with each peer."""
    start = regular(16, radius=0.4, turn=0.0)
    pyramid = RefitTarget.of(horse_silhouette(), RESOLUTION)
    target = horse_silhouette().target(RESOLUTION)
    fitted = refit(start, pyramid).mesh
    loss = _exact_loss(fitted, target)
    yield Row("our refit: exact loss", loss, note=_condition(fitted))
    for name, make, bound in (("DEODR", _deodr_descent, DEODR_SPEED), ("our op in torch", _torch_descent, TORCH_SPEED)):
        label = f"{name}, {N_STEPS} Adam steps"
        try:
            peer = _tune(make(start, target), start, target)
        except (ImportError, NameError) as problem:
            yield not_measured(label, str(problem))
            continue
        # minima: of a short and a long call, a busy machine cuts the long one more often
        ours, theirs = least_seconds(lambda: refit(start, pyramid), peer.descend, rounds=21)
        yield faster(f"{label}: time", ours, theirs, bound)
        yield Row(f"{label}: exact loss", loss, peer.loss, loss / peer.loss, NO_WORSE, note=str(peer))


def _exact_loss(mesh: PolyMesh, target: Target) -> float:
    return float(loss_and_gradient(mesh, target)[0])


def _condition(mesh: PolyMesh) -> str:
    crossings = self_intersections(mesh)
    return f"{crossings} self-intersection{'' if crossings == 1 else 's'}"


def _tune(descent: Descent, start: PolyMesh, target: Target) -> _Tuned:
    results = []
    for rate in _RATES:
        mesh = start.with_vertices(descent(rate))
        results.append((_exact_loss(mesh, target), rate, mesh))
    loss, rate, mesh = min(results, key=lambda result: result[0])
    return _Tuned(lambda: descent(rate), rate, mesh, loss)


def _deodr_descent(start: PolyMesh, target: Target) -> Descent:
    """Adam (Kingma and Ba 2015) in place in numpy; the polygon is cut into triangles anew before every step."""
    renderer = import_module("benchmarks.deodr_peer").DeodrPolygons(start.vertices[None], target.coverage)

    def descend(rate: float) -> FloatArray:
        points = renderer.positions(start.vertices[None])
        mean, square, change = np.zeros_like(points), np.zeros_like(points), np.empty_like(points)
        best, least = points.copy(), np.inf
        for step in range(1, N_STEPS + 1):
            renderer.retriangulate(points)
            losses, gradient = renderer.losses_and_gradient(points)
            if losses[0] < least:
                least = losses[0]
                best[:] = points
            mean += 0.1 * (gradient - mean)
            square += 0.001 * (gradient * gradient - square)
            np.sqrt(square, out=change)
            change *= (1.0 - 0.999**step) ** -0.5
            change += 1e-8
            np.divide(mean, change, out=change)
            change *= rate / (1.0 - 0.9**step)
            points -= change
        return best / target.resolution

    return descend


def _torch_descent(start: PolyMesh, target: Target) -> Descent:
    """torch's own Adam, its fused kernel, on our differentiable coverage."""
    torch = import_module("torch")
    coverage = import_module("autopoly_env.raster.autograd").coverage
    edges = torch.from_numpy(start.topology.boundary_half_edges.copy())
    wanted = torch.from_numpy(target.coverage.copy())[None]
    torch.set_num_threads(1)  # nothing here is large enough to share; waiting for a second thread costs milliseconds

    def descend(rate: float) -> FloatArray:
        vertices = torch.tensor(start.vertices[None], requires_grad=True)
        optimiser = torch.optim.Adam([vertices], lr=rate / target.resolution, fused=True)
        best, least = start.vertices, np.inf
        for _ in range(N_STEPS):
            optimiser.zero_grad()
            loss = (coverage(vertices, edges, target.resolution) - wanted).square().sum()
            loss.backward()
            if loss.item() < least:
                least = loss.item()
                best = vertices.detach().numpy()[0].copy()
            optimiser.step()
        return best

    return descend
