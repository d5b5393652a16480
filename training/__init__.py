"""The workshop: scripts with side effects. Datasets, training, evaluation, comparison."""

from agents.commands.starting import guard_imports, is_starting

if is_starting():
    guard_imports()
