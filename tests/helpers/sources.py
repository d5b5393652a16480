"""Target sources for worker processes, which find them here."""

import numpy as np

from autopoly_env.compute import n_threads
from autopoly_env.silhouette import Silhouette
from autopoly_env.targets import ConstructionTargets


class NamedAfterThreads:
    """Every target is called what the number of threads is where it is drawn."""

    name = "named after threads"

    def sample(self, seed: int) -> Silhouette:
        return Silhouette(np.ones((8, 8), np.bool_), name=str(n_threads()))


class Exhausted:
    """Has no targets."""

    name = "exhausted"

    def sample(self, seed: int) -> Silhouette:
        raise LookupError(f"nothing for\nseed {seed}")


class Unsendable:
    """Holds what does not pickle."""

    name = "unsendable"

    def __init__(self) -> None:
        self.sample = lambda seed: ConstructionTargets().sample(seed)
