"""The workshop: scripts with side effects. Datasets, training, evaluation, comparison."""
