"""The policy network: it reads the pictures with a small CNN and the mesh along its half-edges, and points at actions.

A half-edge reads rendering and target beside itself, and a feature map of the CNN around itself; in rounds it hears of
its neighbours: the next and the last one around the face, its twin, all of its face, all at its vertex, and the whole
picture. The logit of an action comes from the element that it works on - an edge is the sum of its half-edges, a vertex
the mean of those that leave it, a face the mean of its sides - and from the whole. Renumbering vertices and faces
permutes the logits and leaves the value as it is.

Letters: B meshes; V vertices, E edges, F faces, H half-edges of all of them together; D `width`, G actions, R pixels a
side.
"""

from collections.abc import Mapping
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from agents.rl import reading
from agents.rl.config import NetConfig, SpaceSpec
from agents.rl.links import Links, averaged, links_of, summed, taken
from autopoly_env.mesh import FACE_RULES
from autopoly_env.observation import Observer
from autopoly_env.operators import Action, ActionCodec, operator_named

NEVER = -1e8  # logit of what is not legal
N_FACTS = 10  # numbers about the whole, beside the pictures
N_RULES = 1 + len(FACE_RULES)  # numbers more where the rules are noted: the price's logarithm, and which rule holds


class Elements(NamedTuple):
    """What is known of the elements of one kind, of all meshes."""

    rows: Tensor  # (K, D)
    batch: Tensor  # (K,) mesh
    number: Tensor  # (K,) in the mesh


class Encoded(NamedTuple):
    """What the heads see of a batch."""

    whole: Tensor  # (B, D)
    elements: dict[str, Elements]  # by kind
    mask: Tensor | None  # (B, G) bool, legal actions; None where the observation does not say


class Pictures(nn.Module):
    """Rendering and target (B, 2, R, R) to a feature map (B, C, R/4, R/4) that knows the wider surroundings, and to the
    whole (B, D)."""

    def __init__(self, config: NetConfig, resolution: int) -> None:
        super().__init__()
        fine, middle, coarse = config.widths
        self.patches = nn.Conv2d(2, fine, 4, stride=4)
        self.down = nn.Conv2d(fine, middle, 3, stride=2, padding=1)
        self.further = nn.Conv2d(middle, coarse, 3, stride=2, padding=1)
        self.up = nn.Conv2d(coarse, middle, 1)
        self.further_up = nn.Conv2d(middle, fine, 1)
        self.whole = nn.Linear(coarse * (resolution // 16) ** 2, config.width)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        at_4 = functional.relu(self.patches(pictures - 0.5))
        at_8 = functional.relu(self.down(at_4))
        at_16 = functional.relu(self.further(at_8))
        at_8 = functional.relu(at_8 + _twice(self.up(at_16)))
        at_4 = functional.relu(at_4 + _twice(self.further_up(at_8)))
        return at_4, self.whole(at_16.flatten(1))


class Round(nn.Module):
    """One round of messages between the half-edges (H, D)."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.messages = nn.Linear(width, 6 * width)
        self.whole = nn.Linear(width, width, bias=False)
        self.out = nn.Linear(width, width)

    def forward(self, rows: Tensor, whole: Tensor, links: Links) -> Tensor:
        own, to_next, to_last, to_twin, to_face, to_vertex = self.messages(rows).chunk(6, -1)
        heard = own + taken(to_next, links.preceding) + taken(to_last, links.following)
        heard = heard + taken(to_twin, links.twins) * (~links.on_boundary)[:, None]
        heard = heard + taken(averaged(to_face, links.faces, len(links.homes["face"][0])), links.faces)
        heard = heard + taken(averaged(to_vertex, links.tails, len(links.homes["vertex"][0])), links.tails)
        return rows + self.out(functional.relu(heard + taken(self.whole(whole), links.batch)))


class MeshEncoder(nn.Module):
    """Observations to what is known of their elements and of the whole."""

    def __init__(self, config: NetConfig, spec: SpaceSpec) -> None:
        super().__init__()
        self.config, self.spec = config, spec
        width = config.width
        self.pictures = Pictures(config, spec.obs_resolution)
        n_points = reading.N_NEAR + reading.N_FAR + reading.N_INNER
        n_read = 2 * n_points + 2 * config.widths[0] + reading.N_SHAPE
        self.begin = nn.Sequential(nn.Linear(n_read, width), nn.ReLU(), nn.Linear(width, width))
        self.facts = nn.Linear(N_FACTS + N_RULES * bool(spec.faces), width)
        self.rounds = nn.ModuleList(Round(width) for _ in range(config.n_rounds))
        self.end = nn.Sequential(nn.Linear(3 * width, width), nn.ReLU())

    def forward(self, observation: Mapping[str, Tensor]) -> Encoded:
        links = links_of(observation)
        pictures = torch.cat((observation["rendering"], observation["target"]), 1).float() / 255.0
        maps, seen = self.pictures(pictures)
        of_mesh, number = links.homes["vertex"]
        vertices = observation["vertices"].float().unflatten(1, (-1, 2))[of_mesh, number]
        whole = functional.relu(seen + self.facts(self._facts(observation, pictures)))
        rows = self.begin(self._read(pictures, maps, vertices, links))
        for layer in self.rounds:
            rows = layer(rows, whole, links)
        mean = averaged(rows, links.batch, len(pictures))
        most = torch.full_like(mean, -1e4).scatter_reduce(0, links.batch[:, None].expand_as(rows), rows, "amax")
        mask = observation.get("action_mask")
        whole = self.end(torch.cat((whole, mean, most), -1))
        return Encoded(whole, _elements(rows, links), None if mask is None else mask > 0)

    def _read(self, pictures: Tensor, maps: Tensor, vertices: Tensor, links: Links) -> Tensor:
        """(H, n_read) what the half-edges see and what shape they have."""
        frame = reading.frame_of(vertices, links)
        wide = reading.wide_points(frame)
        near = reading.read_pictures(pictures, reading.near_points(frame), links.homes["corner"])
        coarse = reading.read_pictures(functional.avg_pool2d(pictures, 4), wide, links.homes["corner"])
        around = reading.read_mean(maps, wide.unflatten(1, (2, -1)), links.batch)  # far outside, then inside
        seen = (near, coarse, around)
        return torch.cat((*(some.flatten(1) for some in seen), reading.shape_values(frame, links)), -1)

    def _facts(self, observation: Mapping[str, Tensor], pictures: Tensor) -> Tensor:
        """(B, N_FACTS, and N_RULES more) counts, steps left, price, how far rendering and target agree; price, rule."""
        shown, target = pictures.unbind(1)
        union = torch.maximum(shown, target).mean((1, 2))
        common = torch.minimum(shown, target).mean((1, 2))
        areas = torch.stack((common / union.clamp(min=1e-6), union - common, common, shown.mean((1, 2))), -1)
        counts = observation["counts"].float() / 16.0
        left = observation["remaining_steps"].float() / self.spec.max_steps
        price = observation["price"].float()
        facts = [counts, left, price, areas]
        if self.spec.faces:
            facts += [price.clamp(min=1e-3).log10(), observation["rule"].float()]
        return torch.cat(facts, -1)


class PointerHead(nn.Module):
    """Logits (B, G) of the actions, in the order of the codec; those that are not legal are NEVER."""

    def __init__(self, config: NetConfig, spec: SpaceSpec) -> None:
        super().__init__()
        codec = ActionCodec(spec.operators, spec.max_vertices)
        self.n_actions = codec.n_actions
        # by kind of element: of each output the number of the first element's action, and the step to the next's
        self._places: dict[str, list[tuple[int, int]]] = {}
        self._bases: dict[str, str] = {}  # by kind: the elements of the mesh that it lies at
        self._columns: dict[str, list[tuple[str, int]]] = {}
        for name in spec.operators:
            kind = operator_named(name).element
            start = codec.encode(Action(name, 0))
            self._places.setdefault(kind.name, []).extend((start + k, kind.n_each) for k in range(kind.n_each))
            self._bases[kind.name] = kind.base
            self._columns.setdefault(kind.name, []).extend((name, k) for k in range(kind.n_each))
        width = config.width
        self.elements = nn.ModuleDict({kind: nn.Linear(width, width) for kind in self._places})
        self.whole = nn.ModuleDict({kind: nn.Linear(width, width, bias=False) for kind in self._places})
        self.logits = nn.ModuleDict({kind: nn.Linear(width, len(places)) for kind, places in self._places.items()})
        self.stop = nn.Sequential(nn.Linear(width, width), nn.ReLU(), nn.Linear(width, 1))

    def columns(self, kind: str) -> list[tuple[str, int]]:
        """What each output for an element of a kind is the logit of: an operator, and which of the elements there."""
        return self._columns[kind]

    def forward(self, encoded: Encoded) -> Tensor:
        whole = encoded.whole
        values, index = [self.stop(whole)[:, 0]], [torch.arange(len(whole), device=whole.device) * self.n_actions]
        for kind, places in self._places.items():
            rows, batch, number = encoded.elements[self._bases[kind]]
            hidden = self.elements[kind](rows) + taken(self.whole[kind](whole), batch)
            logits = self.logits[kind](functional.relu(hidden))
            for column, (start, n_each) in enumerate(places):
                values.append(logits[:, column])
                index.append(batch * self.n_actions + start + n_each * number)
        flat = whole.new_full((len(whole) * self.n_actions,), NEVER)
        logits = flat.scatter(0, torch.cat(index), torch.cat(values)).unflatten(0, (len(whole), self.n_actions))
        return logits if encoded.mask is None else logits.masked_fill(~encoded.mask, NEVER)


class ValueHead(nn.Module):
    """What is still to be gained: (B, 1), in units of reward."""

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(config.width, config.width), nn.ReLU(), nn.Linear(config.width, 1))

    def forward(self, whole: Tensor) -> Tensor:
        value: Tensor = self.layers(whole)
        return value


class MeshNet(nn.Module):
    """Encoder and heads; the names of its parts are those of a policy of Stable-Baselines3."""

    def __init__(self, config: NetConfig, spec: SpaceSpec) -> None:
        super().__init__()
        self.config, self.spec = config, spec
        self.features_extractor = MeshEncoder(config, spec)
        self.action_net = PointerHead(config, spec)
        self.value_net = ValueHead(config)
        begin_flat(self.action_net)

    def forward(self, observation: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Logits (B, G) and value (B,)."""
        encoded = self.features_extractor(observation)
        return self.action_net(encoded), self.value_net(encoded.whole)[:, 0]


def begin_flat(head: PointerHead) -> None:
    """Let all actions be about as likely before anything is learnt."""
    for layer in (*head.logits.values(), head.stop[-1]):
        assert isinstance(layer, nn.Linear)
        nn.init.normal_(layer.weight, std=0.01)
        nn.init.zeros_(layer.bias)


def observer_of(spec: SpaceSpec) -> Observer:
    """Makes the observations of a space."""
    return Observer(spec.max_vertices, spec.obs_resolution, spec.max_steps)


def _elements(rows: Tensor, links: Links) -> dict[str, Elements]:
    """What is known of every element, from what is known of the half-edges (H, D)."""
    sizes = {kind: len(batch) for kind, (batch, _) in links.homes.items()}
    known = {
        "corner": rows,
        "edge": summed(rows, links.edges, sizes["edge"]),
        "face": averaged(rows, links.faces, sizes["face"]),
        "vertex": averaged(rows, links.tails, sizes["vertex"]),
    }
    return {kind: Elements(known[kind], *home) for kind, home in links.homes.items()}


def _twice(maps: Tensor) -> Tensor:
    return functional.interpolate(maps, scale_factor=2.0, mode="nearest")
