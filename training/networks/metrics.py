"""Held-out metrics of the two networks, and of what they are to be measured against.

Letters: B batch, A actions, K operator classes, S pixels a side.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

from agents.guided.config import CLASSES
from agents.guided.nfap import Foresight, NfapNet, candidates_of
from training.networks.streams import Batch

TOP = 3


def mean_rows(rows: Sequence[dict[str, float]]) -> dict[str, float]:
    """The mean of every number that the rows have in common, NaN left out."""
    means = {}
    for name in rows[0]:
        values = [row[name] for row in rows if row[name] == row[name]]
        means[name] = sum(values) / len(values) if values else float("nan")
    return means


def nfap_metrics(net: NfapNet, foresight: Foresight, batch: Batch, dearer: float = 0.0) -> dict[str, float]:
    """How good stage 1 is.

    `dearer` is subtracted from the logit of an action for every element that it adds: the correction for another price
    than that of the labels that the network has learnt from, where it is told none.

    operator_accuracy: the likeliest operator class is the label's (*_majority: always saying the batch's commonest
    class). element_top3: given the label's operator, the label's element is among the first three (*_residual: by the
    residual prior, *_chance: by drawing lots). action_top3: the same over all legal actions. gain_top3: what the best
    of the first three actions adds to r_all, as a share of what the best of all does, where the outcomes are known.
    choice_least: the least that the loss term "choice" can be, the entropy of the labels. choice_excess: how far the
    network's own is above it, in states in which there is something to choose.
    """
    truth = batch["first"].argmax(-1)
    majority = torch.bincount(truth, minlength=len(CLASSES)).argmax()
    rows = batch["policy"].sum(-1) > 0
    found = {
        "operator_accuracy": _share(foresight.operators[:, 0].argmax(-1) == truth),
        "operator_accuracy_majority": _share(truth == majority),
        "choice_least": float(torch.special.entr(batch["policy"]).sum(-1).mean()),
    }
    if not bool(rows.any()):
        return found | dict.fromkeys(_ranked_names(), float("nan"))
    prior = (net.choose(foresight, candidates_of(batch)) - dearer * batch["added"])[rows]
    found["choice_excess"] = _excess(prior, batch["policy"][rows])
    residual = batch["log_residual"][rows].masked_fill(batch["classes"][rows] < 0, -torch.inf)
    for suffix, logits in (("", prior), ("_residual", residual)):
        found |= {name + suffix: value for name, value in _ranked(logits, batch, rows).items()}
    return found | _chance(batch, rows)


def _ranked_names() -> list[str]:
    names = ("element_top3", "action_top3", "gain_top3")
    return ["choice_excess", *names, *(f"{name}_residual" for name in names), *(f"{name}_chance" for name in names[:2])]


def _excess(logits: Tensor, policy: Tensor) -> float:
    """The mean Kullback-Leibler divergence of the softmax of logits (B, A) from labels (B, A)."""
    log_prior = logits.log_softmax(-1).masked_fill(policy == 0.0, 0.0)
    return float((-(policy * log_prior) - torch.special.entr(policy)).sum(-1).mean())


def _best_and_alike(batch: Batch, rows: Tensor) -> tuple[Tensor, Tensor]:
    """The label's action (B,), and which actions have its operator (B, A)."""
    best = batch["policy"][rows].argmax(-1)
    classes = batch["classes"][rows]
    return best, classes == classes.gather(1, best[:, None])


def _ranked(logits: Tensor, batch: Batch, rows: Tensor) -> dict[str, float]:
    best, alike = _best_and_alike(batch, rows)
    first = logits.topk(min(TOP, logits.shape[1]), -1).indices
    gains = batch["gains"][rows]
    known = gains.max(-1).values > 0.0
    reached = gains.gather(1, first).max(-1).values.clamp(min=0.0)[known].sum()
    return {
        "element_top3": _share(_rank(logits.masked_fill(~alike, -torch.inf), best) < TOP),
        "action_top3": _share(_rank(logits, best) < TOP),
        "gain_top3": float(reached / gains.max(-1).values[known].sum()) if bool(known.any()) else float("nan"),
    }


def _rank(logits: Tensor, best: Tensor) -> Tensor:
    """How many actions are likelier than the best (B,); of equals half."""
    own = logits.gather(1, best[:, None])
    return (logits > own).sum(-1) + 0.5 * ((logits == own).sum(-1) - 1)


def _chance(batch: Batch, rows: Tensor) -> dict[str, float]:
    _, alike = _best_and_alike(batch, rows)
    legal = (batch["classes"][rows] >= 0).sum(-1)
    return {
        "element_top3_chance": float((TOP / alike.sum(-1)).clamp(max=1.0).mean()),
        "action_top3_chance": float((TOP / legal).clamp(max=1.0).mean()),
    }


def _share(mask: Tensor) -> float:
    return float(mask.float().mean())


def warp_metrics(shown: Tensor, batch: Batch) -> dict[str, float]:
    """IoU before, after the warp, and after a full refit; "share": how much of the refit's gain the warp has.

    `shown` (B, S, S) is the rendering after the warp.

    "share_kept": the same where the warped mesh is used only if it is better than the one before it, as the search
    does.
    """
    target = batch["pictures"][:, 1]
    warped = _iou(shown, target)
    before, full = _iou(batch["pictures"][:, 0], target), _iou(batch["full"], target)
    gain = float((full - before).sum())
    return {
        "iou_before": float(before.mean()),
        "iou_warped": float(warped.mean()),
        "iou_full": float(full.mean()),
        "share": float((warped - before).sum()) / gain if gain > 0.0 else float("nan"),
        "share_kept": float((warped - before).clamp(min=0.0).sum()) / gain if gain > 0.0 else float("nan"),
    }


def _iou(shown: Tensor, target: Tensor) -> Tensor:
    """(B,) of pictures (B, S, S), binarised at 0.5."""
    one, other = shown >= 0.5, target >= 0.5
    return (one & other).sum((1, 2)) / (one | other).sum((1, 2)).clamp(min=1)
