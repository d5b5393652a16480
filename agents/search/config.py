"""`MctsConfig`: every choice of the search, and the paper's choices."""

import math
from dataclasses import dataclass
from typing import Literal

from autopoly_env.errors import ConfigError


@dataclass(frozen=True)
class MctsConfig:
    """How `mcts` searches."""

    seeds: tuple[str, ...] = ("trace", "climb", "decimate", "quads")  # whose best it goes on from; those that suit
    n_simulations: int = 16  # before a step is committed
    prior: Literal["residual", "uniform"] = "residual"
    formula: Literal["puct", "uct"] = "puct"
    exploration: float = 0.02  # the formula's constant, for values normalised to 0..1
    n_expanded: int = 4  # children made at once, the most promising first
    widening: float = 0.5  # a node has at most n_expanded * visits ** widening children; 1 is no limit
    n_rollout: int = 0  # steps of a roll-out, the paper's N_sim
    value: Literal["best", "final", "discounted", "foreseen"] = "best"  # of a leaf and its roll-out, or its evaluator's
    discount: float = 1.0  # per step, of what is backed up and of value "discounted"
    backup: Literal["max", "mean"] = "max"
    commit: Literal["value", "visits"] = "value"  # of the root children, the one that has most is taken
    halving: bool = False  # sequential halving at the root
    reuse_tree: bool = True  # keep what is below the child that is taken
    merge: bool = True  # do not go on from a shape that the tree has already
    patience: int = 4  # committed steps in a row that may fail to improve the best shape
    tree_share: float = 0.25  # of what the seeds leave of the budget, that a tree may use at most where hops follow
    hop_patience: int = 60  # hops in a row, from outline to outline, that may; 0: the search ends with the tree
    n_refits: int = 1500  # where the budget sets no limit
    seed: int = 0

    def __post_init__(self) -> None:
        positive = dict.fromkeys(("n_simulations", "n_expanded", "patience"), 1)
        least = positive | dict.fromkeys(("n_rollout", "exploration", "seed", "hop_patience", "n_refits"), 0)
        for name, bound in least.items():
            if not getattr(self, name) >= bound:
                raise ConfigError(f"{name} = {getattr(self, name)}: expected at least {bound}")
        if not math.isfinite(self.exploration):
            raise ConfigError(f"exploration = {self.exploration}: expected a finite number")
        if not 0.0 <= self.tree_share <= 1.0:
            raise ConfigError(f"tree_share = {self.tree_share}: expected a share, 0 to 1")
        if not 0.0 <= self.widening <= 1.0:
            raise ConfigError(f"widening = {self.widening}: expected an exponent, 0 to 1")
        if not 0.0 < self.discount <= 1.0:
            raise ConfigError(f"discount = {self.discount}: expected above 0, at most 1")


# A new tree for every step, random expansion by one child, random roll-outs of three steps, mean of the final r_all.
PAPER = MctsConfig(
    seeds=(),
    n_simulations=50,
    prior="uniform",
    formula="uct",
    exploration=0.5,
    n_expanded=1,
    widening=1.0,
    n_rollout=3,
    value="final",
    backup="mean",
    reuse_tree=False,
    merge=False,
    hop_patience=0,
)
