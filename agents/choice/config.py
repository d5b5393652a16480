"""What ChoiceNet and the agent that uses it can be told; nothing in this room needs torch."""

import math
from dataclasses import dataclass
from typing import Literal

from agents.search.config import MctsConfig
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import FaceRule
from autopoly_env.operators import PRESETS


def classes_of(*presets: str) -> tuple[str, ...]:
    """What actions of some presets are told apart as, each once (`Operator.classes`)."""
    operators = [operator for name in presets for operator in PRESETS[name]]
    return tuple(dict.fromkeys(name for operator in operators for name in operator.classes))


@dataclass(frozen=True)
class ChoiceConfig:
    """The network, and what it may be asked about: the rest is masked (operators) or refused (rule, price)."""

    classes: tuple[str, ...] = classes_of("modeller", "full")  # of actions, by name
    rules: tuple[FaceRule, ...] = ("any", "quads")  # rules of faces that it has learnt
    w_sc: tuple[float, float] = (0.1, 1.5)  # prices of an element, from and to
    side: int = 8  # of the patches around each action, in points
    width: int = 60  # of the first layer; two thirds of it in the others

    def __post_init__(self) -> None:
        if not self.classes or len(set(self.classes)) < len(self.classes):
            raise ConfigError(f"classes {', '.join(self.classes)}: expected one or more, none twice")
        if not self.rules:
            raise ConfigError(f"rules={self.rules}: expected one or more")
        if not 0.0 < self.w_sc[0] <= self.w_sc[1] < math.inf:
            raise ConfigError(f"w_sc={self.w_sc}: expected two prices above 0, the lower first")
        if not 2 <= self.side <= 32:
            raise ConfigError(f"side={self.side}: expected 2 to 32 points")
        if not 6 <= self.width <= 1024:
            raise ConfigError(f"width={self.width}: expected 6 to 1024 numbers")


@dataclass(frozen=True)
class ChoicePriorConfig(MctsConfig):
    """`choice-prior`: the tree with ChoiceNet's priors and exact refits, from the best seed and from the rectangle."""

    seeds: tuple[str, ...] = ("trace", "quads")
    n_simulations: int = 8
    n_expanded: int = 1
    exploration: float = 1.0  # a step that does not pay yet is gone on from where the prior likes it
    tree_share: float = 0.5
    prior: Literal["choice"] = "choice"  # type: ignore[assignment]
    weights: str = ""  # a .safetensors file; empty for the one that comes with the project
    with_nfap: bool = False  # the prior is the geometric mean of ChoiceNet's and nFAP-Net's, which needs torch
    nfap_weights: str = ""  # of nFAP-Net, as `weights`
    temperature: float = 1.0  # of the prior: above 1 it is flatter

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.temperature < math.inf:
            raise ConfigError(f"temperature = {self.temperature}: expected a finite number above 0")
