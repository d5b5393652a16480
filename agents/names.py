"""The names of the agents in `agents.registry`, for help texts, which have no time to load them all."""

AGENT_NAMES = (
    *(
        "random",
        "greedy",
        "beam",
        "trace",
        "climb",
        "decimate",
        "quads",
        "mcts",
        "mcts_paper",
        "nfap-prior",
        "nfap-mcts",
        "choice-prior",
    ),
    *("ppo", "maskable-ppo", "a2c", "dqn", "rl-prior", "oracle", "dr-simple", "dr-complex"),
)
