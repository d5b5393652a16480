"""Training of policies: settings, the session between rollouts, evaluation on held-out targets, cloning, export."""
