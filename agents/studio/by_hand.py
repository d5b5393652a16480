"""What a hand does to an item: pulls, steps of its own, other options for the picture. Nothing is changed here."""

from agents.studio import edits
from agents.studio.items import Item
from agents.studio.uploads import Opened, reopened
from autopoly_env.errors import ConfigError
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import ObjectOptions


def pull(item: Item, places: dict[int, tuple[float, float]]) -> tuple[ConstructionSequence, tuple[int, ...]]:
    """The version that is looked at with vertices elsewhere, their mirror images too; and the ids that have moved."""
    sequence = _looked_at(item)
    both = edits.with_images(sequence.final(), places, item.axis())
    return edits.pulled(sequence, both, item.scored), tuple(both)


def change(item: Item, asked: edits.Asked) -> ConstructionSequence:
    """The version that is looked at with one step more."""
    return edits.done(_looked_at(item), asked, item.scored)


def _looked_at(item: Item) -> ConstructionSequence:
    if item.version is None:
        raise ConfigError("there is no mesh yet: search first")
    return item.version.sequence


def look_again(item: Item, options: ObjectOptions) -> Opened:
    """The picture with other options for what the object is. Raises ConfigError where there is no picture."""
    if item.picture is None:
        raise ConfigError("this construction came without a picture: drop the picture itself")
    return reopened(item.name, item.picture, options)
