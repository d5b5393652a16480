"""Training of ChoiceNet on lessons, and how good it is on those of targets that it has not learnt from."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from agents.choice.config import ChoiceConfig
from agents.choice.network import batch_of
from autopoly_env.arguments import above, at_least
from autopoly_env.arrays import AnyArray
from autopoly_env.errors import ConfigError, RunError
from autopoly_env.shown import short
from training.improvement.lessons import Lesson, drawn
from training.improvement.network import ChoiceModule, TensorBatch

TOP = 3
_GAIN_SCALE = 5.0  # points of r_all


@dataclass(frozen=True)
class LearnConfig:
    """AdamW with a cosine to 0."""

    lr: float = 2e-3
    weight_decay: float = 1e-2
    n_steps: int = 1500
    batch_size: int = 48  # states
    value: float = 0.3  # weight of the value's loss beside the prior's
    measured: float = 0.1  # share of the targets that is kept to measure with

    def __post_init__(self) -> None:
        above(0, lr=self.lr)
        at_least(0, weight_decay=self.weight_decay, value=self.value)
        at_least(1, n_steps=self.n_steps, batch_size=self.batch_size)
        if not 0.0 < self.measured < 1.0:
            raise ConfigError(f"measured={short(self.measured)}: expected a share above 0, below 1")


def learn(
    lessons: Sequence[Lesson],
    network: ChoiceConfig,
    config: LearnConfig,
    seed: int,
    on_step: Callable[[int, float], None] = lambda step, loss: None,
) -> tuple[dict[str, AnyArray], dict[str, float]]:
    """The tensors that the lessons teach, and how good they are on those that are kept back.

    Depends on the arguments alone. Raises RunError where there are too few lessons, or the loss is not a number.
    """
    kept, learnt = split(lessons, config.measured)
    if not kept or not learnt:
        raise RunError(
            f"{len(lessons)} lessons are too few to learn from and to measure with; play more (play.n_first)"
        )
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    net, rng = ChoiceModule(network).train(), np.random.default_rng(seed)
    optimizer = torch.optim.AdamW(net.parameters(), lr=config.lr, weight_decay=config.weight_decay)
    for step in range(config.n_steps):
        for group in optimizer.param_groups:
            group["lr"] = 0.5 * config.lr * (1.0 + math.cos(math.pi * step / config.n_steps))
        optimizer.zero_grad(set_to_none=True)
        loss = loss_of(net, drawn(learnt, rng, config.batch_size), config.value)
        number = float(loss.detach())
        if not math.isfinite(number):
            raise RunError(f"the loss is {number} at step {step}: give a lower learn.lr, or look at the plays")
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimizer.step()
        on_step(step + 1, number)
    return net.arrays(), measure(net.eval(), kept)


def split(lessons: Sequence[Lesson], share: float) -> tuple[list[Lesson], list[Lesson]]:
    """Lessons of a share of the targets, and the others; by the targets' names alone."""
    groups = sorted({lesson.group for lesson in lessons})
    chosen = set(groups[:: max(2, round(1.0 / share))])
    return [one for one in lessons if one.group in chosen], [one for one in lessons if one.group not in chosen]


def loss_of(net: ChoiceModule, lessons: Sequence[Lesson], value_weight: float) -> Tensor:
    """Cross entropy of the choice, and how far off the gains are."""
    batch = TensorBatch.of(batch_of([lesson.seen for lesson in lessons]))
    logits = net.choose(batch)
    policy = torch.from_numpy(np.concatenate([one.policy[one.seen.classes >= 0] for one in lessons]))
    teaching = max(1, sum(bool(one.policy.any()) for one in lessons))
    loss = -(policy * _log_softmax(logits, batch.owners, len(lessons))).sum() / teaching
    gain = torch.tensor([one.gain for one in lessons])
    known = torch.isfinite(gain)
    if bool(known.any()):
        foreseen = net.gains(batch.whole, batch.value)[known]
        loss = loss + value_weight * functional.smooth_l1_loss(foreseen / _GAIN_SCALE, gain[known] / _GAIN_SCALE)
    return loss


def _log_softmax(logits: Tensor, owners: Tensor, n_states: int) -> Tensor:
    """(A,) among the actions of the same state."""
    most = logits.new_full((n_states,), -torch.inf).scatter_reduce(0, owners, logits.detach(), "amax")
    shifted = logits - most[owners]
    sums = logits.new_zeros(n_states).scatter_add(0, owners, shifted.exp())
    return shifted - sums.clamp(min=1e-30).log()[owners]


@torch.no_grad()
def measure(net: ChoiceModule, lessons: Sequence[Lesson]) -> dict[str, float]:
    """On each state with something to choose: is the best action first, or among the first three, what share of the
    best gain do the first one and the first three have; the same of the residual prior. `value_rank`: Spearman's
    correlation of foreseen and found gains; `value_error`: their mean distance, in points of r_all."""
    choosing = [one for one in lessons if one.policy.any()]
    rows: dict[str, list[float]] = {}
    for one in choosing:
        known = np.flatnonzero(one.seen.classes >= 0)
        logits = net.choose(TensorBatch.of(batch_of([one.seen]))).numpy()
        gains = np.maximum(one.found[known] - one.total, 0.0)
        for suffix, said in (("", logits), ("_residual", one.seen.numbers[known, -1])):
            order = np.argsort(-said, kind="stable")
            first = gains[order]
            rows.setdefault("best_first" + suffix, []).append(float(first[0] >= gains.max()))
            rows.setdefault("best_in_top3" + suffix, []).append(float(first[:TOP].max() >= gains.max()))
            rows.setdefault("gain_first" + suffix, []).append(float(first[0] / gains.max()))
            rows.setdefault("gain_top3" + suffix, []).append(float(first[:TOP].max() / gains.max()))
    metrics = {name: float(np.mean(values)) for name, values in rows.items()}
    metrics["loss"] = float(loss_of(net, choosing, 0.0)) if choosing else math.nan
    searched = [one for one in lessons if math.isfinite(one.gain)]
    if len(searched) > TOP:
        batch = TensorBatch.of(batch_of([one.seen for one in searched]))
        foreseen, found = net.gains(batch.whole, batch.value).numpy(), np.array([one.gain for one in searched])
        metrics["value_rank"] = _rank_correlation(foreseen, found)
        metrics["value_error"] = float(np.abs(foreseen - found).mean())
    return metrics | {"n_states": float(len(lessons)), "n_choices": float(len(choosing))}


def _rank_correlation(one: AnyArray, other: AnyArray) -> float:
    """Spearman's."""
    first, second = (np.argsort(np.argsort(values)).astype(float) for values in (one, other))
    return float(np.corrcoef(first, second)[0, 1])
