"""Expert iteration: a search plays, a network learns what the search found in the end, and plays on with it."""
