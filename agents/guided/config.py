"""What the networks and the agents that use them can be told; nothing here needs torch.

Letters: S pixels a side of a network's pictures, n stages of nFAP-Net, K operator classes, M x M grid of WarpNet.
"""

import math
from dataclasses import dataclass
from typing import Literal

from agents.search.config import MctsConfig
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import FaceRule
from autopoly_env.operators import STOP, Action, operator_named

Input = Literal["current", "target", "difference", "edges", "vertices"]
Regions = Literal["one", "each"]

# What an action head tells apart: stopping, and what the operators do (`Operator.classes`). Weights name their own
# classes; these are those of weights that do not, and what training begins with.
CLASSES = (
    "stop",
    "edge_subdivide",
    "edge_extrude",
    "face_split",
    "face_delete",
    "face_hole_3",
    "face_hole_4",
    "vertex_dissolve",
    "edge_dissolve",
)
STOP_CLASS = 0
UNKNOWN = -1


def class_of(action: Action, classes: tuple[str, ...] = CLASSES) -> int:
    """The index in `classes` of what an action does; UNKNOWN where it is not among them."""
    if action == STOP:
        return STOP_CLASS
    operator = operator_named(action.operator)
    name = operator.classes[action.element % operator.element.n_each]
    return classes.index(name) if name in classes else UNKNOWN


def _check_network(size: int, widths: tuple[int, ...], feature: int) -> None:
    if size not in (32, 64, 128):
        raise ConfigError(f"image_size {size}: expected 32, 64 or 128 pixels a side")
    if len(widths) != 4 or min(widths) < 4:
        raise ConfigError(f"widths {widths}: expected four numbers of channels of at least 4")
    if feature < 8:
        raise ConfigError(f"feature {feature}: expected at least 8 numbers")


@dataclass(frozen=True)
class NfapConfig:
    """nFAP-Net. The defaults are the paper's, where it says anything."""

    n: int = 3  # stages: actions that are foreseen
    image_size: int = 64  # S
    inputs: tuple[Input, ...] = ("current", "target")  # channels of the picture
    feature: int = 128  # numbers in the encoder's feature and in the LSTM's state
    widths: tuple[int, int, int, int] = (16, 32, 48, 64)  # channels at S/2, S/4, S/8, S/16
    skips: bool = False  # the decoders see the encoder's feature maps, too
    regions: Regions = "one"  # action-region images a stage: one, or one for each operator class
    residual: bool = False  # the prior is a learned correction of the residual prior, not the networks' alone
    judge: bool = False  # a head looks at each action's own place and measures, and corrects what the regions say
    classes: tuple[str, ...] = CLASSES  # of actions, by name; "stop" first
    rules: tuple[FaceRule, ...] = ()  # rules of faces that it is told and knows; none: it is not told the rule
    w_sc: tuple[float, float] | None = None  # prices that it is told and knows, from and to; None: it is not told

    def __post_init__(self) -> None:
        if self.classes[:1] != ("stop",) or len(set(self.classes)) < len(self.classes):
            raise ConfigError(f"classes {', '.join(self.classes)}: expected stop first, and none twice")
        if len(set(self.rules)) < len(self.rules):
            raise ConfigError(f"rules {', '.join(self.rules)}: expected none twice")
        if self.w_sc is not None and not 0.0 < self.w_sc[0] <= self.w_sc[1] < math.inf:
            raise ConfigError(f"w_sc={self.w_sc}: expected two prices above 0, the lower first")
        _check_network(self.image_size, self.widths, self.feature)
        if not 1 <= self.n <= 16:
            raise ConfigError(f"n {self.n}: expected 1 to 16 stages")
        if not self.inputs or len(set(self.inputs)) < len(self.inputs):
            raise ConfigError(f"inputs {self.inputs}: expected at least one channel and none twice")

    @property
    def n_told(self) -> int:
        """How many numbers it is told beside the pictures."""
        return len(self.rules) + (self.w_sc is not None)

    @property
    def middle_price(self) -> float:
        """Of the prices that it knows, the one in the middle of their logarithms; 1 where it is told none."""
        return 1.0 if self.w_sc is None else math.sqrt(self.w_sc[0] * self.w_sc[1])

    def told(self, faces: FaceRule, w_sc: float) -> tuple[float, ...]:
        """The numbers: 1 for the rule and 0 for others; last the logarithm of the price, 0 for the middle one."""
        rules = tuple(float(faces == rule) for rule in self.rules)
        return rules if self.w_sc is None else (*rules, math.log(w_sc / self.middle_price))


@dataclass(frozen=True)
class WarpConfig:
    """WarpNet. The defaults are the paper's, which leaves M open."""

    image_size: int = 64  # S
    grid: int = 6  # M
    deformation: Literal["global", "local"] = "global"  # from the feature alone, or from feature maps around each point
    passes: int = 1  # warps in a row, each of what the one before it has made
    feature: int = 128
    widths: tuple[int, int, int, int] = (16, 32, 48, 64)

    def __post_init__(self) -> None:
        _check_network(self.image_size, self.widths, self.feature)
        if not 2 <= self.grid <= 16:
            raise ConfigError(f"grid {self.grid}: expected 2 to 16 control points a side")
        if not 1 <= self.passes <= 8:
            raise ConfigError(f"passes {self.passes}: expected 1 to 8 warps in a row")


@dataclass(frozen=True)
class NfapPriorConfig(MctsConfig):
    """`nfap-prior`: the search with nFAP-Net's priors and exact refits.

    A good prior is best trusted: children are made one by one, and a step is committed soon.
    """

    seeds: tuple[str, ...] = ("trace", "quads")  # whichever of them the rule of faces suits
    n_simulations: int = 4
    n_expanded: int = 1
    tree_share: float = 0.5
    prior: Literal["nfap"] = "nfap"  # type: ignore[assignment]
    nfap_weights: str = ""  # a .safetensors file; empty for the one that comes with the project
    n: int = 3  # stages that the weights must have been trained with
    temperature: float = 1.0  # of the prior: above 1 it is flatter

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.temperature < math.inf:
            raise ConfigError(f"temperature = {self.temperature}: expected a finite number above 0")


@dataclass(frozen=True)
class NfapMctsConfig(NfapPriorConfig):
    """`nfap-mcts`: the paper's Algorithm 1, whole refits only where a step is committed.

    In the tree vertices go where a quick refit takes them, or, as in the paper, WarpNet.
    """

    seeds: tuple[str, ...] = ()
    n_simulations: int = 16
    n_expanded: int = 4
    patience: int = 3
    hop_patience: int = 0
    n_rollout: int = 0  # the paper plays on from a leaf; measured, that gives nothing here and takes four times as long
    geometry: Literal["quick", "warpnet"] = "quick"
    warpnet_weights: str = ""  # as nfap_weights; for geometry=warpnet
    start: Literal["placed", "plain"] = "placed"  # new vertices begin at the disagreement, or where the operator puts

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.seeds:
            raise ConfigError(f"seeds {self.seeds}: nfap-mcts begins at the rectangle; leave them out")
        if self.warpnet_weights and self.geometry != "warpnet":
            raise ConfigError(f"warpnet_weights are not used with geometry={self.geometry}: give geometry=warpnet")
