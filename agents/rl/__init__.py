"""Reinforcement learning: a network that reads meshes, the algorithms that train it, and the agents it makes."""
