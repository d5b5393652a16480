"""A new nFAP-Net that begins with what an earlier one has learnt, though it knows more operators and is told more.

Classes are matched by name. What is new begins as it would anew, but for what the network is told: that has no say at
first, so that the new network says of the old one's classes what the old one did.
"""

from dataclasses import replace

import torch
from torch import Tensor

from agents.guided.config import NfapConfig
from agents.guided.nfap import NfapNet
from agents.guided.weights import load_nfap
from autopoly_env.errors import ConfigError

_BY_CLASS = ("region_weight", "action_head.2.", "judge.kind.")  # a row for each class
_DRAWN = "region_decoder.end."  # four rows for each class: the quarters of each pixel
_TOLD = ("memory.weight_ih", "judge.whole.weight", "judge.first.weight")  # columns at the end for what it is told


def inherit(net: NfapNet, path: str) -> None:
    """Begin with the weights in a file. Raises ConfigError as `load_nfap`, and if they are of another architecture."""
    old, _ = load_nfap(path)
    ours, theirs = net.config, old.config
    if _bare(ours) != _bare(theirs):
        raise ConfigError(f"{path}: weights of another network than net says: begin with others, or with none")
    lost = [name for name in theirs.classes if name not in ours.classes]
    if lost:
        raise ConfigError(f"{path}: it knows {lost[0]}, the network's classes do not: add it to them with net.classes")
    rows = torch.tensor([ours.classes.index(name) for name in theirs.classes])
    before = old.state_dict()
    with torch.no_grad():
        for name, tensor in net.state_dict().items():
            _take(name, tensor, before[name], rows, ours.regions == "each")


def _take(name: str, new: Tensor, old: Tensor, rows: Tensor, drawn_apart: bool) -> None:
    if name.startswith(_BY_CLASS):
        new[rows] = old
    elif name.startswith(_DRAWN) and drawn_apart:
        new.unflatten(0, (-1, 4))[rows] = old.unflatten(0, (-1, 4))
    elif name in _TOLD:
        new.zero_()
        new[:, : old.shape[1]] = old
    else:
        new.copy_(old)


def _bare(config: NfapConfig) -> NfapConfig:
    """Without what may differ."""
    return replace(config, n=1, classes=("stop",), rules=(), w_sc=None)
