"""What a target source is, and which seeds are for training and which for tests."""

from typing import Protocol

from autopoly_env.errors import ConfigError
from autopoly_env.silhouette import Silhouette

N_SEEDS = 2**32
SPLITS = {"train": range(2**31), "test": range(2**31, N_SEEDS)}


class TargetSource(Protocol):
    """Targets by seed: the same seed gives the same picture, in every process and on every machine."""

    @property
    def name(self) -> str:
        """What the source is called in records of results."""

    def sample(self, seed: int) -> Silhouette:
        """The target of this seed, 0 <= seed < 2**32. Raises ConfigError for any other seed."""


def split_seed(split: str, index: int) -> int:
    """The seed of target number `index` of a split, "train" or "test"; no seed is in both.

    >>> split_seed("train", 7), split_seed("test", 7)
    (7, 2147483655)
    """
    if split not in SPLITS:
        raise ConfigError(f"split {split!r} is unknown; give {' or '.join(SPLITS)}")
    seeds = SPLITS[split]
    if not 0 <= index < len(seeds):
        raise ConfigError(f"index {index} is outside the split {split!r}; give 0..{len(seeds) - 1}")
    return seeds[index]
