#!/usr/bin/env bash
# Stable-Baselines3 2.9.2: an overridden `extract_features` of a policy is heard in training and not in `predict`.
#
# Input: PPO on CartPole-v1 with an ActorCriticPolicy whose `extract_features` counts its calls, as one that reads an action
# mask there would be written.
# Guess: every way to the features goes through the method of the subclass.
# Seen: `forward` (roll-outs) and `evaluate_actions` (updates) call it; `predict` and `predict_values` call
# `super().extract_features` and pass it by, without a word: a policy may learn with a mask and act without.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check stable-baselines3==2.9.2 torch==2.13.0 gymnasium==1.4.0 numpy==2.4.6
venv/bin/python - <<'PYTHON'
import sys

from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy


class Counting(ActorCriticPolicy):
    n_calls = 0

    def extract_features(self, obs, features_extractor=None):
        Counting.n_calls += 1
        return super().extract_features(obs, features_extractor)


model = PPO(Counting, "CartPole-v1", n_steps=32, batch_size=32, n_epochs=1, seed=0)
model.learn(32)
learning, Counting.n_calls = Counting.n_calls, 0
observation = model.get_env().reset()
model.predict(observation)
model.policy.predict_values(model.policy.obs_to_tensor(observation)[0])
print(f"calls of the policy's own extract_features: {learning} in learn(32), {Counting.n_calls} in predict and predict_values")
sys.exit(learning < 32 or Counting.n_calls != 0)
PYTHON
