"""PPO of RLlib on its new API, with the module for masks that it ships as an example.

pip install -e . -r examples/rl/requirements/rllib.txt
python -m examples.rl.rllib_ppo
"""

import ray
import torch
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.rl_module import RLModuleSpec
from ray.rllib.examples.rl_modules.classes.action_masking_rlm import ActionMaskingTorchRLModule
from ray.tune.registry import register_env

from autopoly_env.wrappers import FlatObservation, MaskInObservation
from examples.rl.measuring import N_STEPS, SEED, make, r_all_of


def wrap(env):
    return MaskInObservation(FlatObservation(env), observation_key="observations", dtype="float32")


ray.init("local", include_dashboard=False)  # whatever cluster there is on this machine
register_env("masked", lambda config: wrap(make()))
spec = RLModuleSpec(module_class=ActionMaskingTorchRLModule, model_config={"fcnet_hiddens": [128]})
config = PPOConfig().environment("masked").env_runners(num_env_runners=0).rl_module(rl_module_spec=spec)
config = config.training(train_batch_size_per_learner=N_STEPS // 4, minibatch_size=128, num_epochs=4, lr=3e-4)
algorithm = config.debugging(seed=SEED).build_algo()


def act(observation, mask):
    seen = {name: torch.from_numpy(array)[None] for name, array in observation.items()}
    return algorithm.get_module().forward_inference({"obs": seen})["action_dist_inputs"].argmax()


print("r_all before:", r_all_of(act, wrap))
for _ in range(4):
    algorithm.train()
print("r_all after:", r_all_of(act, wrap))
