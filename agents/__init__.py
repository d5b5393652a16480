"""The players: everything that chooses actions. Search, networks, RL policies and baselines."""
