"""ChoiceNet in NumPy: how promising each legal action is, and what a state gains by search.

Every action is read by the same two layers, all actions of a state are pooled, and a third layer judges each of them
beside the others. Letters: S states of a batch, A actions of all of them together, H numbers of a layer.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from agents.choice.config import ChoiceConfig
from agents.choice.features import N_CHANNELS, N_GLOBALS, N_NUMBERS, N_VALUE, Look
from autopoly_env.arrays import AnyArray, Float32Array, FloatArray, IntArray

Tensors = Mapping[str, AnyArray]


class ChoiceBatch(NamedTuple):
    """Some states and all of their actions, one state after the other."""

    classes: IntArray  # (A,) of known actions
    inputs: Float32Array  # (A, F) numbers and patches
    owners: IntArray  # (A,) the state of each action, ascending
    whole: Float32Array  # (S, G)
    value: Float32Array  # (S, Q)


def batch_of(looks: Sequence[Look]) -> ChoiceBatch:
    """The actions that the network knows, of all the states."""
    known = [seen.classes >= 0 for seen in looks]
    return ChoiceBatch(
        np.concatenate([seen.classes[rows] for seen, rows in zip(looks, known, strict=True)]),
        np.concatenate([seen.inputs[rows] for seen, rows in zip(looks, known, strict=True)]),
        np.repeat(np.arange(len(looks)), [int(rows.sum()) for rows in known]),
        np.stack([seen.whole for seen in looks]),
        np.stack([seen.value for seen in looks]),
    )


def shapes_of(config: ChoiceConfig) -> dict[str, tuple[int, ...]]:
    """Every tensor of the network and its shape."""
    first, then = config.width, 2 * config.width // 3
    n_inputs = N_NUMBERS + 2 * N_CHANNELS * config.side**2
    return {
        "read.weight": (n_inputs, first),
        "kinds": (len(config.classes), first),
        "rules.weight": (N_GLOBALS, first),
        "read.bias": (first,),
        "think.weight": (first, then),
        "think.bias": (then,),
        "judge.weight": (then, then),
        "beside.weight": (2 * then, then),
        "judge.bias": (then,),
        "choose": (then,),
        "value1.weight": (N_VALUE + N_GLOBALS, then),
        "value1.bias": (then,),
        "value2.weight": (then, then),
        "value2.bias": (then,),
        "gain.weight": (then,),
        "gain.bias": (),
    }


def choose(tensors: Tensors, batch: ChoiceBatch) -> Float32Array:
    """(A,) the logit of each action among those of its state."""
    if not len(batch.classes):
        return np.empty(0, np.float32)
    whole = batch.whole @ tensors["rules.weight"]
    x = batch.inputs @ tensors["read.weight"] + tensors["kinds"][batch.classes] + whole[batch.owners]
    h = _relu(_relu(x + tensors["read.bias"]) @ tensors["think.weight"] + tensors["think.bias"])
    firsts = np.flatnonzero(np.diff(batch.owners, prepend=-1))
    sizes = np.diff(np.append(firsts, len(batch.owners)))
    means = np.add.reduceat(h, firsts, axis=0) / sizes[:, None].astype(np.float32)
    pooled = np.concatenate((means, np.maximum.reduceat(h, firsts, axis=0)), axis=1) @ tensors["beside.weight"]
    z = _relu(h @ tensors["judge.weight"] + np.repeat(pooled, sizes, axis=0) + tensors["judge.bias"])
    logits: Float32Array = z @ tensors["choose"]
    return logits


def gains(tensors: Tensors, whole: Float32Array, value: Float32Array) -> FloatArray:
    """(S,) points of r_all that search adds to each state, at least 0, of `whole` (S, G) and `value` (S, Q)."""
    x = np.concatenate((value, whole), axis=1)
    h = _relu(x @ tensors["value1.weight"] + tensors["value1.bias"])
    h = _relu(h @ tensors["value2.weight"] + tensors["value2.bias"])
    found: FloatArray = np.logaddexp(0.0, (h @ tensors["gain.weight"] + tensors["gain.bias"]).astype(np.float64))
    return found


def _relu(x: AnyArray) -> AnyArray:
    return np.maximum(x, 0.0)
