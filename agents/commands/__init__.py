"""What the commands of agents share: running, Ctrl-C, solving, results, reports, wishes."""
