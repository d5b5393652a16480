"""nFAP-Net: the next n actions, where they work, and what the shape looks like after each (paper, section 4.1).

Letters: B batch, n stages, S pixels a side, K operator classes, A actions, P points of each.
"""

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from agents.guided.config import CLASSES, NfapConfig
from agents.guided.layers import Decoder, Encoder

_MAX_LOG_ODDS = 8.0
_RARE = -3.0  # log-odds of a pixel to lie in a region, before anything is learnt


@dataclass(frozen=True)
class Foresight:
    """What nFAP-Net says, as logits; `images` and `regions` become shares by a sigmoid."""

    operators: Tensor  # (B, n, K)
    regions: Tensor  # (B, n, K or 1, S, S)
    images: Tensor | None  # (B, n, S, S), of the shape after the stage's action


class NfapNet(nn.Module):
    """CNN encoder, an LSTM that is fed the same feature at every stage, decoders and an action head."""

    def __init__(self, config: NfapConfig) -> None:
        super().__init__()
        self.config = config
        size, widths, feature = config.image_size, config.widths, config.feature
        self.encoder = Encoder(len(config.inputs), widths, feature, size)
        self.memory = nn.LSTMCell(feature, feature)
        self.image_decoder = Decoder(1, widths, feature, size, config.skips)
        n_regions = 1 if config.regions == "one" else len(CLASSES)
        self.region_decoder = Decoder(n_regions, widths, feature, size, config.skips)
        self.action_head = nn.Sequential(nn.Linear(feature, feature), nn.ReLU(), nn.Linear(feature, len(CLASSES)))
        self.region_weight = nn.Parameter(torch.ones(len(CLASSES)))
        self.residual_weight = nn.Parameter(torch.ones(())) if config.residual else None
        self.region_decoder.begin_with(_RARE)

    def forward(self, pictures: Tensor, n_stages: int | None = None, with_images: bool = True) -> Foresight:
        """Foresee `n_stages` (by default n) from pictures (B, C, S, S)."""
        feature, maps = self.encoder(pictures)
        state = torch.zeros_like(feature), torch.zeros_like(feature)
        operators, regions, images = [], [], []
        for _ in range(n_stages or self.config.n):
            state = self.memory(feature, state)
            operators.append(self.action_head(state[0]))
            regions.append(self.region_decoder(state[0], maps))
            if with_images:
                images.append(self.image_decoder(state[0], maps)[:, 0])
        return Foresight(torch.stack(operators, 1), torch.stack(regions, 1), torch.stack(images, 1) if images else None)

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
        n_alike = functional.one_hot(index, len(CLASSES)).mul(real[..., None]).sum(1)
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
    points: Tensor  # (B, A, P, 2)
    classes: Tensor  # (B, A), -1 is padding
    log_residual: Tensor  # (B, A)
    policy: Tensor  # (B, A) probabilities of the actions at stage 1; all 0 where it is right to stop


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
    logits = net.choice_logits(
        said.operators[:, 0], said.regions[:, 0], truth.points, truth.classes, truth.log_residual
    )
    log_choice = logits.log_softmax(-1).masked_fill(truth.classes < 0, 0.0)
    return {
        "image": n * functional.mse_loss(said.images.float().sigmoid(), truth.images),
        "operator": first + (n - 1) * later,
        "region": n * functional.mse_loss(own[:, :, 0].float().sigmoid(), truth.regions),
        "choice": -(truth.policy * log_choice).sum(-1).mean(),
    }
