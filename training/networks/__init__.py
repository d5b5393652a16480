"""Training of nFAP-Net and WarpNet: samples, labels, the trainer, what the networks reach and cost.

What is given here needs no torch; the trainer and what goes with it are imported by their files.
"""

from training.networks.labelling import SourceConfig, build_trajectory
from training.networks.trajectories import Labelled, Shard, Trajectory

__all__ = ["Labelled", "Shard", "SourceConfig", "Trajectory", "build_trajectory"]
