#!/usr/bin/env bash
# Tianshou 2.0.1: the spaces of a DummyVectorEnv are those of the environment inside all wrappers, not what it returns.
#
# Input: two CartPole-v1 in a wrapper that makes the observation a Dict of the observation and an action mask.
# Guess: `envs.observation_space[0]` is the space of what `envs.reset()` gives, a Dict.
# Seen: the Box of the bare CartPole: attributes are read from `env.unwrapped`, steps and resets go through the wrappers.
# A network sized from the vector environment, as in the examples, is sized for observations that never come.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check tianshou==2.0.1 torch==2.13.0 gymnasium==1.4.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

import gymnasium
import numpy as np
from tianshou.env import DummyVectorEnv


class Masked(gymnasium.ObservationWrapper):
    def __init__(self, env):
        super().__init__(env)
        mask = gymnasium.spaces.Box(0, 1, (2,), bool)
        self.observation_space = gymnasium.spaces.Dict({"obs": env.observation_space, "mask": mask})

    def observation(self, observation):
        return {"obs": observation, "mask": np.ones(2, bool)}


envs = DummyVectorEnv([lambda: Masked(gymnasium.make("CartPole-v1"))] * 2)
space, (observations, _) = envs.observation_space[0], envs.reset()
seen = type(space).__name__, sorted(observations[0])
print(f"observation_space[0] is a {seen[0]}; what reset() gives has the keys {seen[1]}")
sys.exit(seen != ("Box", ["mask", "obs"]))
PYTHON
