"""The players: everything that chooses actions. Search, networks, RL policies and baselines."""

from agents.commands.starting import guard_imports, is_starting

if is_starting():
    guard_imports()
