"""Settings that the training of both networks has: where samples come from."""

from dataclasses import dataclass, field

from autopoly_env.errors import ConfigError
from training.networks.labelling import SourceConfig
from training.networks.samples import Live, Trajectories, stored


@dataclass(frozen=True)
class DataConfig:
    """Where samples come from."""

    shards: str = ""  # a folder of make_expert; empty: every sample is made when it is needed
    held_out: str = ""  # such a folder of held-out targets
    n_held_out: int = 512  # samples to measure with, rounded up to whole batches of 64
    source: SourceConfig = field(default_factory=SourceConfig)  # of samples that are not in shards

    def __post_init__(self) -> None:
        if self.n_held_out < 1:
            raise ConfigError(f"n_held_out {self.n_held_out}: expected at least 1 sample")

    def trajectories(self) -> tuple[Trajectories, Trajectories]:
        """To train with, and to measure with. Raises ConfigError if a folder has no shards."""
        learn: Trajectories = stored(self.shards) if self.shards else Live(self.source)
        test: Trajectories = stored(self.held_out, held_out=True) if self.held_out else Live(self.source, held_out=True)
        return learn, test
