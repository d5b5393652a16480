"""Monte Carlo tree search: tree, selection, expansion, simulation and backup, each in its own file."""
