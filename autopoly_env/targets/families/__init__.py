"""The families of things that `ObjectTargets` draws, by name. Each drawing is a function of `Dice`."""

from collections.abc import Callable
from dataclasses import dataclass

from autopoly_env.targets.dice import Dice
from autopoly_env.targets.families import furniture, outdoors, tableware, tools, vehicles
from autopoly_env.targets.pencil import Shape

__all__ = ["FAMILIES", "FAMILIES_V0", "Family"]


@dataclass(frozen=True)
class Family:
    """How to draw one of a family, and how it may lie in the picture."""

    draw: Callable[[Dice], Shape]
    any_angle: bool = False  # or upright, give or take a few degrees


_UPRIGHT = (
    furniture.chair,
    furniture.stool,
    furniture.table,
    furniture.bed,
    furniture.sofa,
    furniture.shelf,
    furniture.lamp,
    tableware.mug,
    tableware.bottle,
    tableware.glass,
    tableware.teapot,
    tableware.jug,
    tableware.trophy,
    tableware.pot,
    vehicles.car,
    vehicles.truck,
    vehicles.boat,
    vehicles.bicycle,
    outdoors.house,
    outdoors.fence,
    outdoors.signpost,
    outdoors.anchor,
    outdoors.clock,
    outdoors.camera,
    outdoors.bulb,
    tools.padlock,
    tools.ladder,
)
_ANY_ANGLE = (
    tools.key,
    tools.wrench,
    tools.hammer,
    tools.scissors,
    tools.saw,
    tools.spade,
    tools.umbrella,
    tools.screwdriver,
    tools.brush,
    tableware.pan,
    tableware.cutlery,
    outdoors.guitar,
    vehicles.aeroplane,
    vehicles.rocket,
)
FAMILIES: dict[str, Family] = {draw.__name__: Family(draw) for draw in _UPRIGHT}
FAMILIES |= {draw.__name__: Family(draw, any_angle=True) for draw in _ANY_ANGLE}

# What a seed of version 0 is drawn among: a family is found by its place in here, so that no line may ever change. Who
# adds families to the table above adds them to the tuple of the next version.
# fmt: off
FAMILIES_V0 = (
    "chair", "stool", "table", "bed", "sofa", "shelf", "lamp", "mug", "bottle", "glass", "teapot", "jug", "trophy",
    "pot", "car", "truck", "boat", "bicycle", "house", "fence", "signpost", "anchor", "clock", "camera", "bulb",
    "padlock", "ladder", "key", "wrench", "hammer", "scissors", "saw", "spade", "umbrella", "screwdriver", "brush",
    "pan", "cutlery", "guitar", "aeroplane", "rocket",
)
# fmt: on
