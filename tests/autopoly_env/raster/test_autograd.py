"""The rasteriser as a torch operation: derivatives, batches of unlike shapes, dtypes and refusals."""

from collections.abc import Iterator

import numpy as np
import pytest

from autopoly_env.compute import set_threads
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import loss_and_gradient
from autopoly_env.silhouette import Target
from tests.helpers.shapes import frame, hourglass, loop, polygon, star

pytest.importorskip("torch")

import torch

from autopoly_env.raster import rasteriser as raster
from autopoly_env.raster.autograd import coverage

RING = frame(star(3, 5), 0.5 + 0.4 * (star(3, 5) - 0.5))


@pytest.fixture(autouse=True)
def default_threads() -> Iterator[None]:
    yield
    set_threads(None)


def boundary(mesh: PolyMesh) -> torch.Tensor:
    return torch.tensor(mesh.topology.boundary_half_edges)


def positions(*meshes: PolyMesh) -> torch.Tensor:
    return torch.tensor(np.stack([mesh.vertices for mesh in meshes])).requires_grad_()


def gradient_of(leaf: torch.Tensor) -> torch.Tensor:
    assert leaf.grad is not None
    return leaf.grad


def test_coverage__passes_gradcheck_for_shapes_that_share_their_edges() -> None:
    shapes = [polygon(star(seed, 6)) for seed in range(3)]
    assert torch.autograd.gradcheck(lambda v: coverage(v, boundary(shapes[0]), 5), positions(*shapes))


def test_coverage__passes_gradcheck_for_a_ring_that_leaves_the_image() -> None:
    ring = RING.with_vertices(RING.vertices + (0.31, -0.27))
    assert torch.autograd.gradcheck(lambda v: coverage(v, boundary(ring), 4), positions(ring))


def test_coverage__passes_gradcheck_for_shapes_with_edges_of_their_own_and_padding() -> None:
    vertices = torch.tensor(np.stack([star(4, 7), np.concatenate((star(5, 5), np.zeros((2, 2))))])).requires_grad_()
    edges = torch.full((2, 7, 2), -1)
    edges[0], edges[1, 1:6] = torch.tensor(loop(7)), torch.tensor(loop(5))
    assert torch.autograd.gradcheck(lambda v: coverage(v, edges, 6), vertices)
    images = coverage(vertices, edges, 6)
    np.testing.assert_array_equal(images[1].detach(), raster.coverage(polygon(star(5, 5)), 6))
    images.sum().backward()
    assert not gradient_of(vertices)[1, 5:].any()


@pytest.mark.parametrize("mesh", [RING, hourglass(), polygon(star(0, 12))], ids=["ring", "pinch", "concave"])
def test_backward__equals_the_gradient_of_the_loss(mesh: PolyMesh) -> None:
    target = Target(np.random.default_rng(0).random((33, 33)))
    vertices = positions(mesh)
    loss = ((coverage(vertices, boundary(mesh), 33)[0] - torch.tensor(target.coverage)) ** 2).sum()
    loss.backward()
    expected_loss, expected = loss_and_gradient(mesh, target)
    assert loss.item() == pytest.approx(expected_loss, rel=1e-12)
    np.testing.assert_allclose(gradient_of(vertices)[0], expected, rtol=1e-9, atol=1e-9)


def test_coverage__does_not_depend_on_the_number_of_threads() -> None:
    shapes = [polygon(star(seed, 6)) for seed in range(300)]
    weights = torch.rand((300, 50, 50), dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    results = []
    for threads in (1, 2, 3):
        set_threads(threads)
        vertices = positions(*shapes)
        images = coverage(vertices, boundary(shapes[0]), 50)
        (images * weights).sum().backward()
        results.append((images.detach().numpy().tobytes(), gradient_of(vertices).numpy().tobytes()))
    assert results[0] == results[1] == results[2]
    np.testing.assert_array_equal(images.detach()[299], raster.coverage(shapes[299], 50))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float16, torch.bfloat16])
def test_coverage__keeps_the_dtype(dtype: torch.dtype) -> None:
    vertices = positions(RING).detach().to(dtype).requires_grad_()
    images = coverage(vertices, boundary(RING), 8)
    exact = raster.coverage(RING.with_vertices(vertices[0].detach().double()), 8)
    np.testing.assert_allclose(images[0].detach().double(), exact, atol=2 * torch.finfo(dtype).eps)
    images.sum().backward()
    assert images.dtype == gradient_of(vertices).dtype == dtype
    assert gradient_of(vertices).any()


def test_backward__is_that_of_the_forward_pass_even_if_the_vertices_move_before_it() -> None:
    expected, moved = positions(RING), positions(RING)
    coverage(expected, boundary(RING), 8)[0, 2].sum().backward()
    images = coverage(moved, boundary(RING), 8)
    with torch.no_grad():
        moved += 0.3
    images[0, 2].sum().backward()
    assert torch.equal(gradient_of(moved), gradient_of(expected))


@pytest.mark.parametrize("edge_type", [torch.int32, torch.int64])
def test_coverage__takes_views_and_either_integer(edge_type: torch.dtype) -> None:
    flipped = torch.tensor(np.ascontiguousarray(RING.vertices[:, ::-1])).flip(-1)[None]
    transposed = boundary(RING).T.contiguous().T.to(edge_type)
    np.testing.assert_array_equal(coverage(flipped, transposed, 8)[0], raster.coverage(RING, 8))


@pytest.mark.parametrize(("n", "v", "b"), [(0, 4, 4), (2, 0, 0), (2, 4, 0)])
def test_coverage__of_nothing_is_empty_or_zero(n: int, v: int, b: int) -> None:
    vertices = torch.zeros((n, v, 2), requires_grad=True)
    images = coverage(vertices, torch.tensor(loop(4)[:b]), 8)
    images.sum().backward()
    assert images.shape == (n, 8, 8) and not images.any()
    assert gradient_of(vertices).shape == (n, v, 2) and not gradient_of(vertices).any()


def test_coverage__has_first_derivatives_only() -> None:
    vertices = positions(RING)
    (gradient,) = torch.autograd.grad(coverage(vertices, boundary(RING), 8).square().sum(), vertices, create_graph=True)
    with pytest.raises(RuntimeError, match="once_differentiable"):
        gradient.sum().backward()


@pytest.mark.parametrize(
    ("vertices", "edges", "resolution", "message"),
    [
        (torch.zeros(4, 2), torch.zeros(4, 2, dtype=torch.long), 8, r"\(N, V, 2\)"),
        (torch.zeros(1, 4, 3), torch.zeros(4, 2, dtype=torch.long), 8, r"\(N, V, 2\)"),
        (torch.zeros(1, 4, 2, dtype=torch.long), torch.zeros(4, 2, dtype=torch.long), 8, "floating point"),
        (torch.zeros(1, 4, 2), torch.zeros(4, dtype=torch.long), 8, r"\(B, 2\) or \(N, B, 2\)"),
        (torch.zeros(1, 4, 2), torch.zeros(4, 3, dtype=torch.long), 8, r"\(B, 2\) or \(N, B, 2\)"),
        (torch.zeros(1, 4, 2), torch.zeros(2, 4, 2, dtype=torch.long), 8, "with N = 1"),
        (torch.zeros(1, 4, 2), torch.zeros(4, 2), 8, "integers"),
        (torch.zeros(1, 4, 2), torch.full((4, 2), 4), 8, "vertex 4, but there are 4"),
        (torch.zeros(1, 4, 2), torch.zeros(4, 2, dtype=torch.long), 0, "resolution 0"),
    ],
)
def test_coverage__refuses_what_it_cannot_draw(
    vertices: torch.Tensor, edges: torch.Tensor, resolution: int, message: str
) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        coverage(vertices, edges, resolution)
    assert "\n" not in str(caught.value)
