"""What a target source is, and which of its seeds are learnt from, measured on while learning, and tested on.

| seeds | range | who draws them |
|---|---|---|
| `LEARNING` | 0 .. 2³⁰ - 1 | everything that learns: environments, samples, data sets, the teacher's constructions |
| `HELD_OUT` | 2³⁰ .. 2³¹ - 1 | whatever measures a network or a policy while it learns, and chooses among them |
| `SPLITS["test"]` | 2³¹ .. 2³² - 1 | what is published: suites, benchmarks |

`SPLITS["train"]` is the first two together.
"""

from typing import Protocol

from autopoly_env.errors import ConfigError
from autopoly_env.silhouette import Silhouette

N_SEEDS = 2**32
SPLITS = {"train": range(2**31), "test": range(2**31, N_SEEDS)}
LEARNING = range(2**30)
HELD_OUT = range(LEARNING.stop, SPLITS["train"].stop)


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
