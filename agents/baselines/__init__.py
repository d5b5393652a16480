"""Agents that others are measured by: chance, greedy and beam search, fixed topologies, the reach of the operators."""
