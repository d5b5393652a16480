"""ChoiceNet in torch, to be trained; `agents.choice.network` is the same in NumPy, and a test holds the two together.

Letters: S states of a batch, A actions of all of them together.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from agents.choice.config import ChoiceConfig
from agents.choice.network import ChoiceBatch, shapes_of
from autopoly_env.arrays import AnyArray

_DROPPED = 0.3  # of the inputs of an action, while it learns


class ChoiceModule(nn.Module):
    """The tensors of `shapes_of`, as parameters."""

    def __init__(self, config: ChoiceConfig) -> None:
        super().__init__()
        self.config = config
        made = {}
        for name, shape in shapes_of(config).items():
            scale = 0.0 if name.endswith("bias") or not shape else (2.0 / shape[0]) ** 0.5
            if name in ("kinds", "choose", "gain.weight"):
                scale = 0.1
            made[name.replace(".", "_")] = nn.Parameter(scale * torch.randn(shape))
        self.tensors = nn.ParameterDict(made)

    def tensor(self, name: str) -> Tensor:
        """A tensor by its name in the file."""
        found: Tensor = self.tensors[name.replace(".", "_")]
        return found

    def arrays(self) -> dict[str, AnyArray]:
        """All tensors, as they are written."""
        return {name: self.tensor(name).detach().cpu().numpy().copy() for name in shapes_of(self.config)}

    def fill(self, arrays: dict[str, AnyArray]) -> None:
        """Go on from these tensors."""
        with torch.no_grad():
            for name, array in arrays.items():
                self.tensor(name).copy_(torch.from_numpy(np.array(array)))

    def choose(self, batch: "TensorBatch") -> Tensor:
        """(A,) the logit of each action among those of its state."""
        inputs = functional.dropout(batch.inputs, _DROPPED, self.training)
        whole = batch.whole @ self.tensor("rules.weight")
        x = inputs @ self.tensor("read.weight") + self.tensor("kinds")[batch.classes] + whole[batch.owners]
        h = functional.relu(x + self.tensor("read.bias"))
        h = functional.relu(h @ self.tensor("think.weight") + self.tensor("think.bias"))
        n_states, width = len(batch.whole), h.shape[1]
        rows = batch.owners[:, None].expand_as(h)
        empty = h.new_zeros(n_states, width)
        pooled = torch.cat(
            (
                empty.scatter_reduce(0, rows, h, "mean", include_self=False),
                empty.scatter_reduce(0, rows, h, "amax", include_self=False),
            ),
            1,
        )
        beside = (pooled @ self.tensor("beside.weight"))[batch.owners]
        z = functional.relu(h @ self.tensor("judge.weight") + beside + self.tensor("judge.bias"))
        return z @ self.tensor("choose")

    def gains(self, whole: Tensor, value: Tensor) -> Tensor:
        """(S,) points of r_all that search adds to each state, at least 0."""
        x = torch.cat((value, whole), 1)
        h = functional.relu(x @ self.tensor("value1.weight") + self.tensor("value1.bias"))
        h = functional.relu(h @ self.tensor("value2.weight") + self.tensor("value2.bias"))
        return functional.softplus(h @ self.tensor("gain.weight") + self.tensor("gain.bias"))


@dataclass(frozen=True)
class TensorBatch:
    """`ChoiceBatch` as tensors."""

    classes: Tensor
    inputs: Tensor
    owners: Tensor
    whole: Tensor
    value: Tensor

    @classmethod
    def of(cls, batch: ChoiceBatch) -> "TensorBatch":
        return cls(*(torch.from_numpy(np.ascontiguousarray(array)) for array in batch))
