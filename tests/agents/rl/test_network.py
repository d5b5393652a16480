"""The policy network: what hangs together, what it sees, that numbering does not matter, that masks hold."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from agents.rl import reading
from agents.rl.config import NetConfig, SpaceSpec
from agents.rl.growing import grown
from agents.rl.links import averaged, links_of, summed
from agents.rl.network import NEVER, MeshNet, observer_of
from agents.rl.player import observation_of
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import FaceRule, PolyMesh
from autopoly_env.operators import OPERATORS, ActionCodec

torch.set_num_threads(1)  # as tests run beside each other

SPEC = SpaceSpec(max_vertices=16, obs_resolution=32, max_steps=8)
CODEC = ActionCodec(SPEC.operators, SPEC.max_vertices)
TARGET = np.zeros((1, 32, 32), np.uint8)
TARGET[0, 8:28, 5:20] = 255
# Two quads side by side and a triangle on top of the right one.
POINTS = [(0.1, 0.3), (0.4, 0.32), (0.75, 0.28), (0.78, 0.8), (0.42, 0.78), (0.12, 0.81), (0.6, 0.05)]
FACES = [(0, 1, 4, 5), (1, 2, 3, 4), (1, 6, 2)]


def network(seed: int = 0) -> MeshNet:
    """One whose heads say something."""
    torch.manual_seed(seed)
    net = MeshNet(NetConfig(widths=(6, 8, 8), width=16), SPEC)
    for parameter in net.action_net.parameters():
        torch.nn.init.normal_(parameter, std=0.5)
    return net.eval()


def batch_of(meshes: Sequence[PolyMesh], w_sc: float = 0.3) -> dict[str, Any]:
    observer = observer_of(SPEC)
    seen = [observation_of(observer.observe(m, TARGET, 5), CODEC.legal_mask(m), w_sc) for m in meshes]
    return {name: torch.from_numpy(np.stack([one[name] for one in seen])) for name in seen[0]}


def mesh() -> PolyMesh:
    return PolyMesh.from_faces(POINTS, FACES)


def renumbered(rng: np.random.Generator) -> tuple[PolyMesh, np.ndarray, np.ndarray, np.ndarray]:
    """The same shape: vertices and faces in another order, faces from other corners. And what became of the elements:
    the new numbers of vertices, of faces, and the old corner for every new one."""
    new_vertex, new_face = rng.permutation(len(POINTS)), rng.permutation(len(FACES))
    points = np.empty((len(POINTS), 2))
    points[new_vertex] = POINTS
    faces: list[tuple[int, ...]] = [()] * len(FACES)
    old_corners: list[list[int]] = [[]] * len(FACES)
    first = np.cumsum([0, *map(len, FACES)])
    for f, face in enumerate(FACES):
        turn = int(rng.integers(len(face)))
        order = [(k + turn) % len(face) for k in range(len(face))]
        faces[new_face[f]] = tuple(int(new_vertex[face[k]]) for k in order)
        old_corners[new_face[f]] = [int(first[f]) + k for k in order]
    return PolyMesh.from_faces(points, faces), new_vertex, new_face, np.concatenate(old_corners)


def actions_in(new: PolyMesh, new_vertex: np.ndarray, new_face: np.ndarray, old_corner: np.ndarray) -> np.ndarray:
    """(G,) the old number of every new action; its own for those without an element."""
    old, order = mesh(), np.arange(CODEC.n_actions)
    lookup = {tuple(pair): e for e, pair in enumerate(np.sort(new.edges, axis=1).tolist())}
    edges = [lookup[tuple(sorted(new_vertex[list(pair)].tolist()))] for pair in old.edges]
    moved = {
        "edge": edges,
        "face": new_face,
        "vertex": new_vertex,
        "corner": np.argsort(old_corner),
        "hole": [2 * new_face[k // 2] + k % 2 for k in range(2 * len(FACES))],
    }
    start = 1
    for name in SPEC.operators:
        kind = OPERATORS[name].element
        for before, after in enumerate(moved[kind.name]):
            order[start + int(after)] = start + before
        start += kind.per_vertex * CODEC.max_vertices
    return order


@pytest.mark.parametrize("seed", range(4))
def test_renumbering__permutes_the_logits_and_leaves_the_value(seed: int) -> None:
    new, *numbers = renumbered(np.random.default_rng(seed))
    net = network(seed)
    with torch.no_grad():
        logits, value = net(batch_of([mesh(), new]))
    assert value[0].item() == pytest.approx(value[1].item(), abs=1e-5)
    before, after = logits.double().numpy()
    assert after == pytest.approx(before[actions_in(new, *numbers)], abs=1e-5)
    legal = before[before > 0.5 * NEVER]
    assert legal.std() > 0.1  # there is something to permute


@pytest.mark.slow
def test_batch__says_of_each_mesh_what_it_says_of_it_alone() -> None:
    small, large = PolyMesh.rectangle(0.2, 0.3, 0.6, 0.7), PolyMesh.grid(2, 0.1, 0.1, 0.9, 0.8)
    net = network()
    with torch.no_grad():
        together, values = net(batch_of([small, mesh(), large]))
        for row, one in enumerate((small, mesh(), large)):
            alone, value = net(batch_of([one]))
            assert torch.allclose(alone[0], together[row], atol=1e-5)
            assert torch.allclose(value[0], values[row], atol=1e-5)


def test_logits__are_never_for_what_is_not_legal() -> None:
    meshes = [PolyMesh.rectangle(0.2, 0.3, 0.6, 0.7), mesh()]
    with torch.no_grad():
        logits, _ = network()(batch_of(meshes))
    for row, one in zip(logits.numpy(), meshes, strict=True):
        assert np.array_equal(row > 0.5 * NEVER, CODEC.legal_mask(one))


@pytest.mark.slow
def test_policy__looks_at_target_price_and_steps() -> None:
    net, seen = network(), batch_of([mesh()])
    with torch.no_grad():
        first, _ = net(seen)
        for name, other in (
            ("target", 255 - seen["target"]),
            ("price", seen["price"] + 1.0),
            ("remaining_steps", seen["remaining_steps"] - 4),
        ):
            assert not torch.allclose(first, net({**seen, name: other})[0])


def test_links__of_two_quads_and_a_triangle() -> None:
    links = links_of(batch_of([PolyMesh.rectangle(0.1, 0.1, 0.9, 0.9), mesh()]))
    own = slice(4, None)  # the rectangle's half-edges come first
    assert (links.tails[own] - 4).tolist() == [v for face in FACES for v in face]
    assert (links.heads[own] - 4).tolist() == [1, 4, 5, 0, 2, 3, 4, 1, 6, 2, 1]
    assert (links.following[own] - 4).tolist() == [1, 2, 3, 0, 5, 6, 7, 4, 9, 10, 8]
    assert (links.preceding[own] - 4).tolist() == [3, 0, 1, 2, 7, 4, 5, 6, 10, 8, 9]
    assert (links.twins[own] - 4).tolist() == [0, 7, 2, 3, 10, 5, 6, 1, 8, 9, 4]
    assert links.on_boundary[own].tolist() == [True, False, True, True, False, True, True, False, True, True, False]
    ends = mesh().edges[(links.edges[own] - 4).numpy()]
    assert [set(pair) for pair in ends.tolist()] == [
        {int(a) - 4, int(b) - 4} for a, b in zip(links.tails[own], links.heads[own], strict=True)
    ]


def test_sums_and_means__go_by_index() -> None:
    rows, index = torch.tensor([[1.0], [2.0], [4.0]]), torch.tensor([2, 0, 2])
    assert summed(rows, index, 3).tolist() == [[2.0], [0.0], [5.0]]
    assert averaged(rows, index, 3).tolist() == [[2.0], [0.0], [2.5]]


def test_reading__is_bilinear_and_nothing_outside() -> None:
    ramp = torch.arange(4.0).expand(1, 1, 4, 4)
    points = torch.tensor([[[0.125, 0.5], [0.5, 0.5], [0.75, 0.2], [2.0, 0.5], [-1.0, 0.5]]])
    here = torch.zeros(1, dtype=torch.long)
    expected = [0.0, 1.5, 2.5, 0.0, 0.0]
    assert reading.read_pictures(ramp, points, (here, here))[0, :, 0].tolist() == pytest.approx(expected)
    groups = points[:, [0, 1, 2, 3, 4, 1]].unflatten(1, (3, 2))
    assert reading.read_mean(ramp, groups, here)[0, :, 0].tolist() == pytest.approx([0.75, 1.25, 0.75])
    assert reading.read_mean(ramp, points[:, :, None], here)[0, :, 0].tolist() == pytest.approx(expected)


def test_reading__of_several_meshes_takes_each_from_its_own_picture() -> None:
    pictures = torch.tensor([1.0, 2.0, 3.0])[:, None, None, None].expand(3, 1, 4, 4).contiguous().requires_grad_()
    points, batch = torch.full((4, 1, 2), 0.5), torch.tensor([0, 2, 2, 1])
    home = batch, torch.tensor([0, 0, 1, 0])
    assert reading.read_pictures(pictures, points, home).flatten().tolist() == [1, 3, 3, 2]
    found = reading.read_mean(pictures, points[:, :, None], batch)
    assert found.flatten().tolist() == [1, 3, 3, 2]
    (slopes,) = torch.autograd.grad(found.sum(), pictures)
    assert slopes.sum((1, 2, 3)).tolist() == [1, 1, 2] and (slopes[1, 0, 1:3, 1:3] == 0.25).all()


def test_near_points__lie_on_both_sides_of_the_edge() -> None:
    seen = batch_of([PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)])
    links = links_of(seen)
    frame = reading.frame_of(seen["vertices"].reshape(-1, 2)[:4], links)
    points = reading.near_points(frame).unflatten(1, (reading.N_ALONG, len(reading.NEAR)))
    inside = ((points > 0.25) & (points < 0.75)).all(-1)
    assert inside[..., :2].all() and not inside[..., 2:].any()


@pytest.mark.parametrize(
    ("other", "complaint"),
    [
        ({"operators": ("edge_cap", "edge_subdivide")}, "operators edge_cap,edge_subdivide; .*operators full"),
        ({"max_vertices": 20}, "max_vertices 20; .*max_vertices 48"),
        ({"obs_resolution": 32}, "obs_resolution 32; .*obs_resolution 64"),
        ({"max_steps": 3}, "max_steps 3; .*max_steps 24"),
    ],
)
def test_rules__that_differ_are_both_named(other: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint):
        SpaceSpec().check_same(SpaceSpec(**other), "this run", "theirs")


# --- rule and price ---

NOTED = replace(SPEC, faces=("any", "quads"), w_sc=(0.1, 1.5))


def asked(net: MeshNet, w_sc: float, faces: FaceRule) -> torch.Tensor:
    """(G,) its logits on the mesh."""
    codec = ActionCodec(net.spec.operators, net.spec.max_vertices)
    seen = observation_of(observer_of(net.spec).observe(mesh(), TARGET, 5), codec.legal_mask(mesh()), w_sc, faces)
    with torch.no_grad():
        return net({name: torch.from_numpy(array[None]) for name, array in seen.items()})[0][0]


def test_rule_and_price__reach_the_network_that_notes_them() -> None:
    torch.manual_seed(0)
    noted = MeshNet(NetConfig(widths=(6, 8, 8), width=16), NOTED)
    plain = asked(noted, 0.3, "any")
    assert not torch.allclose(plain, asked(noted, 0.3, "quads"), atol=1e-6)
    assert not torch.allclose(plain, asked(noted, 0.6, "any"), atol=1e-6)
    assert torch.equal(asked(network(), 0.3, "any"), asked(network(), 0.3, "quads"))


def test_grown_network__says_the_same_of_what_it_knew() -> None:
    net, more = network(), replace(NOTED, operators=("loop_cut", *SPEC.operators[::-1], "vertex_merge"))
    larger = grown(net, more)
    known, codec = asked(net, 0.3, "any"), ActionCodec(more.operators, more.max_vertices)
    for rule in ("any", "quads"):  # which it has yet to learn to tell apart
        said = asked(larger, 0.3, rule)
        assert torch.allclose(said[0], known[0], atol=1e-5)
        for name in SPEC.operators:
            assert torch.allclose(said[codec.indices_of(name)], known[CODEC.indices_of(name)], atol=1e-5), name
    assert grown(net, net.spec) is net
