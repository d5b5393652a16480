"""Settings of environments, of the policy network and of the agents that use it; nothing here needs torch.

Letters: N `max_vertices`, R pixels a side of the observed pictures.
"""

import math
from dataclasses import dataclass, fields
from typing import Any, Literal

from agents.search.config import MctsConfig
from autopoly_env.arguments import above, at_least
from autopoly_env.errors import ConfigError
from autopoly_env.mesh import FaceRule
from autopoly_env.operators import PRESETS, preset
from autopoly_env.shown import short
from autopoly_env.targets import ConstructionTargets, TargetSource, make_targets

# What policies are trained with by default: frozen, so that weights and observations stay what they are.
OPERATORS = (
    "edge_subdivide",
    "edge_extrude",
    "face_split",
    "face_delete",
    "face_hole",
    "vertex_dissolve",
    "edge_dissolve",
)
ALGORITHMS = ("maskable_ppo", "ppo", "a2c", "dqn")


@dataclass(frozen=True)
class NetConfig:
    """The network. Widths are numbers of channels."""

    widths: tuple[int, int, int] = (24, 32, 48)  # of the feature maps at R/4, R/8, R/16
    width: int = 64  # of what is known of a half-edge, and of the whole
    n_rounds: int = 2  # of messages between neighbouring half-edges

    def __post_init__(self) -> None:
        at_least(4, widths=min(self.widths), width=self.width)
        if not 0 <= self.n_rounds <= 8:
            raise ConfigError(f"n_rounds={short(self.n_rounds)}: expected 0 to 8")


@dataclass(frozen=True)
class SpaceSpec:
    """The observation and action spaces that a policy was made for, and the rules and prices that it was trained under.

    Weights from before those were noted have neither: they are asked under any, and are not told the rule.
    """

    operators: tuple[str, ...] = OPERATORS
    max_vertices: int = 48  # N
    obs_resolution: int = 64  # R
    max_steps: int = 24  # of a construction; after them it stops
    faces: tuple[FaceRule, ...] = ()  # rules of faces; none: not noted, and no input
    w_sc: tuple[float, float] | tuple[()] = ()  # prices of an element, from and to; none: not noted

    def __post_init__(self) -> None:
        preset(self.operators)
        if self.w_sc:
            check_prices(self.w_sc)
        at_least(4, max_vertices=self.max_vertices)
        at_least(1, max_steps=self.max_steps)
        if self.obs_resolution % 16 or not 16 <= self.obs_resolution <= 256:
            raise ConfigError(
                f"obs_resolution {self.obs_resolution}: expected a multiple of 16, 16 to 256 pixels a side"
            )

    def check_same(self, other: "SpaceSpec", ours: str, theirs: str) -> None:
        """Raise ConfigError, which names both settings, unless `other`, of `theirs`, is what these, of `ours`, are.

        `other` may lack operators and know other rules and prices: what it lacks is learnt anew (`agents.rl.growing`).
        """
        for name in (field.name for field in fields(self) if field.name not in ("faces", "w_sc")):
            value, found = getattr(self, name), getattr(other, name)
            if found != value and not (name == "operators" and set(found) <= set(value)):
                raise ConfigError(f"{theirs}: {name} {_shown(found)}; {ours}: {name} {_shown(value)}: make them agree")

    def check_operators(self, operators: tuple[str, ...], name: str) -> None:
        """Raise ConfigError, which names both, unless the policy knows some of these operators; others are masked."""
        if not set(operators) & set(self.operators):
            raise ConfigError(
                f"{name} was trained with operators {_shown(self.operators)} and knows none of {_shown(operators)}: "
                f"give operators={_shown(self.operators)} or other weights"
            )

    def check_rule(self, faces: FaceRule, w_sc: float) -> None:
        """Raise ConfigError unless the policy was trained under this rule of faces and at such a price."""
        if self.faces and faces not in self.faces:
            known = ", ".join(self.faces)
            raise ConfigError(f"these weights know faces={known}, not {faces}: give one of them, or others")
        if self.w_sc and not self.w_sc[0] <= w_sc <= self.w_sc[1]:
            low, high = self.w_sc
            raise ConfigError(f"these weights know w_sc {low:g} to {high:g}, not {w_sc:g}: give others")


Rules = SpaceSpec  # by which name the pickled part of older zips of Stable-Baselines3 knows it


@dataclass(frozen=True)
class TaskSpec:
    """What is to be built in an environment, and at which price."""

    targets: str = "construction"  # "construction", "objects" or a folder of images
    w_sc: float | tuple[float, float] = 1.0  # price of an element, in points of r_all; from and to: drawn each episode
    difficulty: tuple[int, int] = (1, 5)  # of constructions: how many actions change the outline
    operators: str = "paper"  # that constructions are made with
    faces: FaceRule = "any"  # rule that the policy's meshes keep
    policy_operators: str = ""  # that the policy has in it; empty: those of the environments

    def __post_init__(self) -> None:
        if isinstance(self.w_sc, tuple):
            check_prices(self.w_sc)
            above(0, w_sc=self.w_sc[0])
        elif not self.w_sc >= 0.0:
            raise ConfigError(f"w_sc {self.w_sc}: expected a price of at least 0")
        if self.policy_operators:
            preset(self.policy_operators)

    @property
    def prices(self) -> tuple[float, float]:
        """The lowest price and the highest."""
        return self.w_sc if isinstance(self.w_sc, tuple) else (self.w_sc, self.w_sc)

    def price_at(self, share: float) -> float:
        """The price at a share, 0 to 1, of the way from the lowest to the highest, evenly in its logarithm."""
        low, high = self.prices
        return low if low == high else min(high, max(low, low * (high / low) ** share))

    def operators_of(self, spec: SpaceSpec) -> tuple[str, ...]:
        """The policy's operators that may be used, in the policy's order. Raises ConfigError for others."""
        if not self.policy_operators:
            return spec.operators
        own = {operator.name for operator in preset(self.policy_operators)}
        if not own <= set(spec.operators):
            raise ConfigError(f"policy_operators {self.policy_operators}: the policy has {_shown(spec.operators)} only")
        return tuple(name for name in spec.operators if name in own)

    def source(self, difficulty: tuple[int, int] | None = None) -> TargetSource:
        """The targets; constructions may have another difficulty. Raises ConfigError."""
        if self.targets == "construction":
            return ConstructionTargets(difficulty or self.difficulty, self.operators)
        return make_targets(self.targets)


def check_prices(w_sc: tuple[float, float]) -> None:
    """Raise ConfigError unless these are two prices, the lower first."""
    if not 0.0 <= w_sc[0] <= w_sc[1] < math.inf:
        raise ConfigError(f"w_sc {short(w_sc)}: expected two prices of at least 0, the lower first")


def _shown(value: Any) -> str:
    if not isinstance(value, tuple):
        return str(value)
    known = {name: tuple(operator.name for operator in operators) for name, operators in PRESETS.items()}
    named = [name for name, operators in known.items() if set(operators) == set(value)]
    return named[0] if named else ",".join(map(str, value))


@dataclass(frozen=True)
class RlConfig:
    """How `ppo`, `maskable-ppo`, `a2c` and `dqn` play."""

    weights: str = ""  # a .safetensors file; empty for the one that comes with the project, where one does
    play: Literal["greedy", "sampled"] = "greedy"  # the likeliest action, or one drawn
    k: int = 1  # constructions, of which the best counts; from the second on they are sampled
    temperature: float = 1.0  # of sampling: below 1 it keeps to what is likely
    seed: int = 0

    def __post_init__(self) -> None:
        at_least(1, k=self.k)
        at_least(0, seed=self.seed)
        if not 0.0 < self.temperature < math.inf:
            raise ConfigError(f"temperature = {self.temperature}: expected a finite number above 0")


@dataclass(frozen=True)
class RlPriorConfig(MctsConfig):
    """`rl-prior`: from where the policy's own play ends, the search with its probabilities as priors and exact refits.

    As with `nfap-prior`, children are made one by one, and a step is committed soon.
    """

    seeds: tuple[str, ...] = ("maskable-ppo",)  # which plays with the same weights
    n_simulations: int = 4
    n_expanded: int = 1
    hop_patience: int = 0
    prior: Literal["rl"] = "rl"  # type: ignore[assignment]
    weights: str = ""  # a .safetensors file; empty for that of `maskable-ppo`
    temperature: float = 1.0  # of the prior: above 1 it is flatter

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.temperature < math.inf:
            raise ConfigError(f"temperature = {self.temperature}: expected a finite number above 0")
