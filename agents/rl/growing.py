"""A policy that goes on as one that knows more: other rules of faces and prices, more operators.

What it knew it keeps, by the names of its operators; what is new begins flat.
"""

import torch

from agents.rl.config import SpaceSpec
from agents.rl.network import MeshNet


def grown(net: MeshNet, spec: SpaceSpec) -> MeshNet:
    """The network for other spaces; itself where nothing differs. `spec.check_same(net.spec)` must have passed."""
    if net.spec == spec:
        return net
    made = MeshNet(net.config, spec)
    known = net.state_dict()
    with torch.no_grad():
        for name, tensor in made.state_dict().items():
            old = known.get(name)
            if old is None:
                continue  # of a kind of element that no operator worked on
            if name == "features_extractor.facts.weight":
                tensor.zero_()
                shared = min(tensor.shape[1], old.shape[1])
                tensor[:, :shared] = old[:, :shared]
            elif name.startswith("action_net.logits."):
                kind = name.split(".")[2]
                rows = net.action_net.columns(kind)
                for row, column in enumerate(made.action_net.columns(kind)):
                    if column in rows:
                        tensor[row] = old[rows.index(column)]
            else:
                tensor.copy_(old)
    return made.train(net.training)
