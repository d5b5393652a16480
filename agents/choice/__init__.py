"""ChoiceNet: a prior and a value that a search has taught, small enough for NumPy alone."""
