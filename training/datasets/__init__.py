"""Data sets: shards that are whole or not there, and what goes into them."""
