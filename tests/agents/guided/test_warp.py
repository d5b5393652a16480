"""WarpNet: splines with known answers, the sampler and the transport against oracles, and that it learns."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.interpolate import RBFInterpolator
from scipy.ndimage import map_coordinates

from agents.guided.config import WarpConfig
from agents.guided.tps import (
    apply_spline,
    control_grid,
    fit_spline,
    pixel_centres,
    sample_bilinear,
    transport,
    warp_pictures,
)
from agents.guided.warp import Theta, WarpNet, loss_terms, move_grid
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import coverage

torch.set_num_threads(1)  # as tests run beside each other

SMALL = WarpConfig(image_size=32, grid=4, feature=16, widths=(4, 4, 8, 8))
AFFINE = torch.tensor([[0.9, -0.2, 0.1], [0.3, 1.1, -0.15]], dtype=torch.float64)


def points(n: int, seed: int = 0) -> torch.Tensor:
    return torch.from_numpy(np.random.default_rng(seed).random((1, n, 2)))


def affine_of(at: torch.Tensor) -> torch.Tensor:
    return at @ AFFINE[:, :2].T + AFFINE[:, 2]


def moved_grid(m: int, seed: int = 1, amount: float = 0.1) -> tuple[torch.Tensor, torch.Tensor]:
    rest = control_grid(m).double()[None]
    return rest, rest + amount * (points(m * m, seed) - 0.5)


def test_control_grid__is_even_and_row_by_row() -> None:
    assert control_grid(3)[[0, 1, 2, 3, 8]].tolist() == [[0, 0], [0.5, 0], [1, 0], [0, 0.5], [1, 1]]


def test_spline__without_a_move_is_the_identity() -> None:
    rest, at = control_grid(5).double()[None], points(50)
    assert torch.allclose(apply_spline(fit_spline(rest, rest), rest, at), at, atol=1e-9)


def test_spline__reproduces_an_affine_map() -> None:
    rest, at = control_grid(5).double()[None], points(50)
    assert torch.allclose(apply_spline(fit_spline(rest, affine_of(rest)), rest, at), affine_of(at), atol=1e-9)


def test_spline__takes_control_points_where_they_belong() -> None:
    rest, goals = moved_grid(5)
    assert torch.allclose(apply_spline(fit_spline(rest, goals), rest, rest), goals, atol=1e-4)


def test_spline__agrees_with_scipy_between_control_points() -> None:
    rest, goals = moved_grid(5)
    at = points(60, 2)
    expected = RBFInterpolator(rest[0].numpy(), goals[0].numpy(), kernel="thin_plate_spline")(at[0].numpy())
    assert np.abs(apply_spline(fit_spline(rest, goals), rest, at)[0].numpy() - expected).max() < 1e-4


def test_spline__bears_control_points_that_fall_together() -> None:
    rest, _ = moved_grid(3)
    goals = torch.full_like(rest, 0.5)
    assert bool(torch.isfinite(fit_spline(goals, rest)).all())


def test_sampler__agrees_with_scipy() -> None:
    picture = np.random.default_rng(3).random((16, 16))
    at = points(200, 4)
    inside = 0.5 / 16 + at * 15 / 16  # between the centres of the outermost pixels
    found = sample_bilinear(torch.from_numpy(picture)[None, None], inside)[0, 0].numpy()
    columns, rows = (inside[0].numpy() * 16 - 0.5).T
    assert np.allclose(found, map_coordinates(picture, [rows, columns], order=1), atol=1e-9)


def test_sampler__reads_nothing_outside_the_picture() -> None:
    picture = torch.ones(1, 1, 8, 8)
    assert sample_bilinear(picture, torch.tensor([[[-0.2, 0.5], [0.5, 1.3]]])).tolist() == [[[0.0, 0.0]]]


def test_warp_pictures__moves_what_is_shown_with_the_grid() -> None:
    picture = torch.zeros(1, 1, 16, 16)
    picture[0, 0, 4:8, 2:6] = 1.0
    rest = control_grid(4)
    warped = warp_pictures(picture, (rest + torch.tensor([3 / 16, 5 / 16]))[None], rest)
    expected = torch.zeros(16, 16)
    expected[9:13, 5:9] = 1.0  # three pixels to the right, five down
    assert torch.allclose(warped[0, 0], expected, atol=1e-3)


def test_transport__without_a_move_leaves_points_where_they_are() -> None:
    at = 3.0 * points(80) - 1.0  # outside the grid as well
    assert torch.allclose(transport(at, control_grid(6).double()[None], 6), at, atol=1e-6)


def test_transport__carries_along_an_affine_map() -> None:
    at = 3.0 * points(80) - 1.0
    assert torch.allclose(transport(at, affine_of(control_grid(6).double()[None]), 6), affine_of(at), atol=1e-6)


def test_transport__keeps_barycentric_coordinates_in_the_triangle() -> None:
    goals = control_grid(2).double()[None].clone()
    goals[0, 3] = torch.tensor([2.0, 3.0])  # the lower right corner, which only the lower triangle has
    at = torch.tensor([[[0.25, 0.25], [0.75, 0.5], [1.0, 1.0]]], dtype=torch.float64)
    # (0.75, 0.5) is 1/4 of the lower right, 1/2 of the upper right and 1/4 of the lower left corner
    expected = [[0.25, 0.25], [0.25 * 2.0 + 0.5 * 1.0, 0.25 * 3.0 + 0.25 * 1.0], [2.0, 3.0]]
    assert torch.allclose(transport(at, goals, 2)[0], torch.tensor(expected, dtype=torch.float64))


def test_transport__meets_the_spline_at_the_control_points() -> None:
    rest, goals = moved_grid(5)
    spline = apply_spline(fit_spline(rest, goals), rest, rest)
    assert torch.allclose(transport(rest, goals, 5), spline, atol=1e-4)


def test_transport__moves_a_mesh_as_the_picture_moves() -> None:
    mesh, size = PolyMesh.rectangle(0.3, 0.25, 0.6, 0.7), 64
    rest = control_grid(5).double()
    middle = torch.tensor([0.5, 0.5], dtype=torch.float64)
    goals = (middle + 1.2 * (rest - middle) + torch.tensor([0.05, -0.03]))[None]
    carried = transport(torch.from_numpy(mesh.vertices.copy())[None], goals, 5)[0].numpy()
    warped = warp_pictures(torch.from_numpy(coverage(mesh, size))[None, None], goals, rest)[0, 0].numpy()
    difference = np.abs(coverage(mesh.with_vertices(carried), size) - warped)
    assert difference.mean() < 0.01 and (difference > 0.6).sum() == 0


def test_transport__has_the_right_gradient() -> None:
    at, goals = points(6, 5), moved_grid(3)[1].requires_grad_()
    assert torch.autograd.gradcheck(lambda g: transport(at, g, 3), (goals,))


def test_move_grid__is_the_affine_map_and_then_the_deformation() -> None:
    rest = control_grid(3).double()
    deformation = points(9, 6)
    found = move_grid(Theta(AFFINE[None], deformation), rest)
    assert torch.allclose(found, affine_of(rest[None]) + deformation)


def batch_of(n: int = 8) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Rectangles, and where they are to go: pictures, vertices, edges."""
    rng = np.random.default_rng(7)
    begin = [PolyMesh.rectangle(*(0.3 + 0.1 * rng.random(2)), *(0.6 + 0.2 * rng.random(2))) for _ in range(n)]
    goals = [mesh.with_vertices(mesh.vertices + 0.15 * (rng.random((4, 2)) - 0.5)) for mesh in begin]
    pictures = np.array([[coverage(a, 32), coverage(b, 32)] for a, b in zip(begin, goals, strict=True)], np.float32)
    vertices = np.array([mesh.vertices for mesh in begin], np.float32)
    edges = np.array([mesh.topology.boundary_half_edges for mesh in begin])
    return torch.from_numpy(pictures), torch.from_numpy(vertices), torch.from_numpy(edges)


NETS = pytest.mark.parametrize("config", [SMALL, replace(SMALL, deformation="local", passes=2)], ids=["paper", "local"])


@NETS
def test_net__untrained_leaves_everything_where_it_is(config: WarpConfig) -> None:
    net, (pictures, vertices, edges) = WarpNet(config), batch_of()
    warps = net.warps(pictures, vertices, edges)
    assert len(warps) == config.passes
    assert torch.allclose(net.goals(warps[0].theta), net.rest.expand(8, -1, -1))
    assert torch.allclose(warps[-1].vertices, vertices, atol=1e-6)
    start = float((pictures[:, 0] - pictures[:, 1]).square().mean())
    assert loss_terms(net, warps)["mesh"].item() == pytest.approx(start, rel=1e-3)


@pytest.mark.slow
@NETS
def test_net__learns_one_batch(config: WarpConfig) -> None:
    torch.manual_seed(0)
    net, batch = WarpNet(config), batch_of()
    optimizer = torch.optim.Adam(net.parameters(), lr=6e-3)
    losses = []
    for _ in range(60):
        terms = loss_terms(net, net.warps(*batch))
        losses.append({name: term.item() for name, term in terms.items()})
        optimizer.zero_grad()
        (terms["image"] + terms["mesh"]).backward()
        optimizer.step()
    assert losses[-1]["image"] < 0.5 * losses[0]["image"]
    assert losses[-1]["mesh"] < 0.5 * losses[0]["mesh"]


def test_warps__each_pass_sees_what_the_one_before_has_made() -> None:
    torch.manual_seed(0)
    net, (pictures, vertices, edges) = WarpNet(replace(SMALL, passes=3)), batch_of()
    torch.nn.init.normal_(net.head.weight, std=0.01)
    first, second, third = net.warps(pictures, vertices, edges)
    for before, after in ((first, second), (second, third)):
        assert torch.equal(after.pictures[:, 0], before.shown.clamp(0.0, 1.0)) and not after.pictures.requires_grad
        assert torch.equal(after.pictures[:, 1], pictures[:, 1])
        carried = net.carry(net.goals(after.theta), before.vertices)
        assert torch.allclose(after.vertices, carried) and not torch.allclose(carried, before.vertices)


@pytest.mark.parametrize(
    "change", [{"grid": 1}, {"image_size": 48}, {"widths": (2, 2, 2, 2)}, {"feature": 0}, {"passes": 0}]
)
def test_config__refuses_what_cannot_be(change: dict[str, int]) -> None:
    with pytest.raises(ConfigError, match="expected"):
        WarpConfig(**change)


def test_pixel_centres__are_row_by_row() -> None:
    assert pixel_centres(2).tolist() == [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]
