"""Gumbel MuZero of mujax. It wants a vector, the autoreset mode SAME_STEP, and masks of what is not legal.

pip install -e . -r examples/rl/requirements/mujax.txt
python -m examples.rl.mujax_gmz
"""

import tempfile

import gymnasium
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from mujax import CheckpointingConfig, ExperimentConfig, GMZConfig, load_policy, run_experiment

from autopoly_env.wrappers import FlatObservation
from examples.rl.measuring import N_STEPS, make, r_all_of


class Forbidding(gymnasium.Wrapper):
    def reset(self, **options):
        observation, info = self.env.reset(**options)
        return observation, info | {"invalid_actions": 1 - info["action_mask"]}

    def step(self, action):
        *outcome, info = self.env.step(action)
        return *outcome, info | {"invalid_actions": 1 - info["action_mask"]}


def envs(n):
    made = [lambda: Forbidding(FlatObservation(make()))] * n
    return SyncVectorEnv(made, autoreset_mode=AutoresetMode.SAME_STEP)


def learned(n_learner_steps):
    """The policy; with batches of 64 and a replay ratio of 2, a learner step comes with 32 steps of environments."""
    with tempfile.TemporaryDirectory() as folder:
        settings = GMZConfig(
            batch_size=64,
            num_simulations=8,
            num_unroll_steps=2,
            num_bootstrapping=3,
            min_replay_size=256,
            max_replay_size=8192,
        )
        experiment = ExperimentConfig(
            config=settings.with_size("XS").with_num_steps(n_learner_steps),
            environment_factory=lambda seed: envs(8),
            eval_environment_factory=lambda seed: envs(1),
            max_num_learner_steps=n_learner_steps,
            checkpointing=CheckpointingConfig(directory=folder),
        )
        run_experiment(experiment)
        return load_policy(folder)


def act(observation, mask):
    return policy.act(observation, 1 - mask)


policy = learned(1)
print("r_all before:", r_all_of(act, FlatObservation))
policy = learned(N_STEPS // 32)
print("r_all after:", r_all_of(act, FlatObservation))
