"""Data sets: shards that are whole or not there, and what goes into them."""

from training.datasets.shards import Example, Manifest, read_manifest, read_shard, read_shards

__all__ = ["Example", "Manifest", "read_manifest", "read_shard", "read_shards"]
