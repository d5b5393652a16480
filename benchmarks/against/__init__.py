"""Another revision of this repository beside this one, measured in turn: `python -m benchmarks.against REV`."""
