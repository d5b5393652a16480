"""nFAP-Net: the next n actions, where they work, and what the shape looks like after each (paper, section 4.1).

Letters: B batch, n stages, S pixels a side, K operator classes, A actions, P points and M measures of each, D numbers
in the feature, C channels, T numbers that the network is told beside the pictures (`NfapConfig.told`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from agents.guided.config import NfapConfig
from agents.guided.layers import Decoder, Encoder
from agents.guided.measures import N_MEASURES

_MAX_LOG_ODDS = 8.0
_RARE = -3.0  # log-odds of a pixel to lie in a region, before anything is learnt


@dataclass(frozen=True)
class Foresight:
    """What nFAP-Net says, as logits; `images` and `regions` become shares by a sigmoid."""

    operators: Tensor  # (B, n, K)
    regions: Tensor  # (B, n, K or 1, S, S)
    images: Tensor | None  # (B, n, S, S), of the shape after the stage's action
    feature: Tensor  # (B, D) the LSTM's state of stage 1
    told: Tensor  # (B, T)
    maps: Tensor  # (B, C, S/2, S/2) what the regions of stage 1 are drawn from

    def row(self, k: int) -> "Foresight":
        """What is said of one sample, as a batch of one; copies, so that the others can be forgotten."""
        images = None if self.images is None else self.images[k : k + 1].clone()
        parts = (self.operators, self.regions, self.feature, self.told, self.maps)
        operators, regions, feature, told, maps = (part[k : k + 1].clone() for part in parts)
        return Foresight(operators, regions, images, feature, told, maps)


@dataclass(frozen=True)
class Candidates:
    """The legal actions of a batch of states; rows whose class is -1 are padding, or of an unknown operator."""

    points: Tensor  # (B, A, P, 2) where to read the regions, unit square
    classes: Tensor  # (B, A)
    log_residual: Tensor  # (B, A)
    spots: Tensor  # (B, A, P, 2) and (B, A, M): see `agents.guided.measures`
    measures: Tensor
    added: Tensor  # (B, A) elements (vertices, edges, faces) that each adds, at most


class _Judge(nn.Module):
    """A correction of the logit of each action, 0 before anything is learnt.

    It reads the decoder's maps at the action's spots (mean and maximum of what a layer makes of each, so their order
    does not matter), the action's class and measures, the residual prior, the feature of the whole, what the network is
    told, and, where that ends with a price, how many elements the action adds and what they cost.
    """

    def __init__(self, n_maps: int, feature: int, n_classes: int, n_told: int, priced: bool, width: int = 48) -> None:
        super().__init__()
        self.priced = priced
        self.place = nn.Linear(n_maps, width)
        self.whole = nn.Linear(feature + n_told, width)
        self.kind = nn.Embedding(n_classes, width)
        self.first = nn.Linear(4 * width + N_MEASURES + 1 + 2 * priced, 2 * width)
        self.second = nn.Linear(2 * width, width)
        self.last = nn.Linear(width, 1)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)

    def forward(self, maps: Tensor, feature: Tensor, told: Tensor, candidates: Candidates) -> Tensor:
        """(B, A)"""
        at = 2.0 * candidates.spots.to(maps.dtype) - 1.0
        seen = functional.grid_sample(maps, at, padding_mode="border", align_corners=False)  # (B, C, A, P)
        places = functional.relu(self.place(seen.permute(0, 2, 3, 1)))
        kinds = self.kind(candidates.classes.clamp(min=0))
        whole = functional.relu(self.whole(torch.cat((feature, told), -1)))[:, None].expand_as(kinds)
        measures = 4.0 * candidates.measures.to(maps.dtype)
        residual = candidates.log_residual.to(maps.dtype)[..., None] / 4.0
        x = torch.cat((places.mean(2), places.amax(2), kinds, whole, measures, residual), -1)
        if self.priced:
            added = candidates.added.to(maps.dtype)[..., None] / 4.0
            x = torch.cat((x, added, told[:, -1:, None].exp() * added), -1)
        x = functional.relu(self.second(functional.relu(self.first(x))))
        return self.last(x)[..., 0]


class NfapNet(nn.Module):
    """CNN encoder, an LSTM that is fed the same feature at every stage, decoders and an action head.

    What it is told (rule of faces, price of an element) joins the feature.
    """

    def __init__(self, config: NfapConfig) -> None:
        super().__init__()
        self.config = config
        size, widths, feature = config.image_size, config.widths, config.feature
        n_classes = len(config.classes)
        self.encoder = Encoder(len(config.inputs), widths, feature, size)
        self.memory = nn.LSTMCell(feature + config.n_told, feature)
        self.image_decoder = Decoder(1, widths, feature, size, config.skips)
        n_regions = 1 if config.regions == "one" else n_classes
        self.region_decoder = Decoder(n_regions, widths, feature, size, config.skips)
        self.action_head = nn.Sequential(nn.Linear(feature, feature), nn.ReLU(), nn.Linear(feature, n_classes))
        self.region_weight = nn.Parameter(torch.ones(n_classes))
        self.residual_weight = nn.Parameter(torch.ones(())) if config.residual else None
        self.region_decoder.begin_with(_RARE)
        width, priced = self.region_decoder.n_last, config.w_sc is not None
        self.judge = _Judge(width, feature, n_classes, config.n_told, priced) if config.judge else None

    def forward(
        self, pictures: Tensor, told: Tensor, n_stages: int | None = None, with_images: bool = True
    ) -> Foresight:
        """Foresee `n_stages` (by default n) from pictures (B, C, S, S) and what is told beside them (B, T)."""
        feature, maps = self.encoder(pictures)
        state = torch.zeros_like(feature), torch.zeros_like(feature)
        operators, regions, images, firsts = [], [], [], []
        for _ in range(n_stages or self.config.n):
            state = self.memory(torch.cat((feature, told.to(feature.dtype)), -1), state)
            operators.append(self.action_head(state[0]))
            last = self.region_decoder.last_maps(state[0], maps)
            firsts.append((state[0], last))
            regions.append(self.region_decoder.draw(last))
            if with_images:
                images.append(self.image_decoder(state[0], maps)[:, 0])
        drawn = torch.stack(images, 1) if images else None
        first, last = firsts[0]
        return Foresight(torch.stack(operators, 1), torch.stack(regions, 1), drawn, first, told, last)

    def choose(self, said: Foresight, candidates: Candidates) -> Tensor:
        """How promising each legal action is (B, A), from stage 1: `choice_logits`, corrected by the judge if any."""
        logits = self.choice_logits(
            said.operators[:, 0], said.regions[:, 0], candidates.points, candidates.classes, candidates.log_residual
        )
        if self.judge is not None:
            logits = logits + self.judge(said.maps.float(), said.feature.float(), said.told.float(), candidates)
        return logits

    def choice_logits(
        self, operators: Tensor, regions: Tensor, points: Tensor, classes: Tensor, log_residual: Tensor
    ) -> Tensor:
        """How promising each legal action is: (B, A).

        log p(operator) - log(its legal elements) + w_op * (mean log-odds of the predicted region at the element's
        points) + w_r * log(residual prior). `operators` (B, K) and `regions` (B, 1 or K, S, S) are one stage's,
        `points` (B, A, P, 2) unit square, `classes` (B, A) indices, -1 where a row is padding (whose logit is
        -infinity), `log_residual` (B, A). The weights w are learnt with the network, and are 1 at first.
        """
        real = classes >= 0
        index = classes.clamp(min=0)
        n_alike = functional.one_hot(index, len(self.config.classes)).mul(real[..., None]).sum(1)
        share = operators.float().log_softmax(-1) - n_alike.clamp(min=1).float().log()
        read = read_at(regions.float().clamp(-_MAX_LOG_ODDS, _MAX_LOG_ODDS), points)
        own = read[:, 0] if regions.shape[1] == 1 else read.gather(1, index[:, None]).squeeze(1)
        logits = share.gather(1, index) + self.region_weight[index] * own
        if self.residual_weight is not None:
            logits = logits + self.residual_weight * log_residual
        return logits.masked_fill(~real, -torch.inf)


def read_at(maps: Tensor, points: Tensor) -> Tensor:
    """The mean of maps (B, K, S, S) over each action's points (B, A, P, 2), bilinearly: (B, K, A)."""
    return functional.grid_sample(
        maps, 2.0 * points.to(maps.dtype) - 1.0, padding_mode="border", align_corners=False
    ).mean(-1)


@dataclass(frozen=True)
class NfapLabels:
    """The truth of a batch. Stages after a construction's end are "stop", with the last image and no region."""

    images: Tensor  # (B, n, S, S)
    regions: Tensor  # (B, n, S, S)
    operators: Tensor  # (B, n) classes
    first: Tensor  # (B, K) probabilities of the operator classes at stage 1
    candidates: Candidates
    policy: Tensor  # (B, A) probabilities of the actions at stage 1; all 0 where it is right to stop

    @classmethod
    def of(cls, batch: Mapping[str, Tensor]) -> "NfapLabels":
        """From the arrays of `training.networks.samples.nfap_sample`."""
        candidates = candidates_of(batch)
        own = {name: batch[name] for name in cls.__dataclass_fields__ if name != "candidates"}
        return cls(candidates=candidates, **own)


def candidates_of(batch: Mapping[str, Tensor]) -> Candidates:
    """The legal actions among a batch's arrays."""
    return Candidates(**{name: batch[name] for name in Candidates.__dataclass_fields__})


def loss_terms(net: NfapNet, said: Foresight, truth: NfapLabels) -> dict[str, Tensor]:
    """The three terms of the paper's loss, summed over the stages, and the cross entropy of the choice at stage 1.

    The pictures' terms are means over the pixels. Where the label of stage 1 is a distribution (that of a teacher
    who tried every action), its cross entropy takes the place of the paper's.
    """
    n = truth.operators.shape[1]
    if said.images is None:
        raise ValueError("the images were left out; call the network with them")
    own = said.regions
    if own.shape[2] > 1:
        own = own.gather(2, truth.operators[..., None, None, None].expand(-1, -1, 1, *own.shape[-2:]))
    later = (
        functional.cross_entropy(said.operators[:, 1:].flatten(0, 1), truth.operators[:, 1:].flatten())
        if n > 1
        else 0.0
    )
    first = -(truth.first * said.operators[:, 0].float().log_softmax(-1)).sum(-1).mean()
    log_choice = net.choose(said, truth.candidates).log_softmax(-1).masked_fill(truth.candidates.classes < 0, 0.0)
    return {
        "image": n * functional.mse_loss(said.images.float().sigmoid(), truth.images),
        "operator": first + (n - 1) * later,
        "region": n * functional.mse_loss(own[:, :, 0].float().sigmoid(), truth.regions),
        "choice": -(truth.policy * log_choice).sum(-1).mean(),
    }
