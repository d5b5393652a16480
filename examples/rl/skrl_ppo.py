"""PPO of skrl. Nothing of the info reaches its models: the mask goes into the observation, a line into the model.

pip install -e . -r examples/rl/requirements/skrl.txt
python -m examples.rl.skrl_ppo
"""

import gymnasium
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import CategoricalMixin, Model
from skrl.trainers.torch import SequentialTrainer
from skrl.utils.model_instantiators.torch import deterministic_model
from skrl.utils.spaces.torch import flatten_tensorized_space, tensorize_space, unflatten_tensorized_space

from autopoly_env.wrappers import FlatObservation, MaskInObservation
from examples.rl.measuring import N_STEPS, NAME, SETTINGS, r_all_of
from examples.rl.nets import Net


def wrap(env):
    return MaskInObservation(FlatObservation(env), dtype="float32")


class Masked(CategoricalMixin, Model):
    def __init__(self, **spaces):
        Model.__init__(self, **spaces)
        CategoricalMixin.__init__(self)
        self.net = Net(self.observation_space["observation"], self.num_actions)

    def compute(self, inputs, role=""):
        seen = unflatten_tensorized_space(self.observation_space, inputs["observations"])
        return self.net(seen["observation"]).masked_fill(seen["action_mask"] == 0, -1e8), {}


envs = wrap_env(gymnasium.make_vec(NAME, num_envs=4, vectorization_mode="sync", wrappers=[wrap], **SETTINGS))
spaces = {"observation_space": envs.observation_space, "action_space": envs.action_space, "device": "cpu"}
layers = [{"name": "net", "input": "OBSERVATIONS['observation']", "layers": [128], "activations": "tanh"}]
models = {"policy": Masked(**spaces), "value": deterministic_model(network=layers, output="ONE", **spaces)}
settings = PPO_CFG(rollouts=64, learning_epochs=4, mini_batches=2, learning_rate=3e-4, entropy_loss_scale=0.01)
settings.experiment.write_interval = settings.experiment.checkpoint_interval = 0  # no files
agent = PPO(models=models, memory=RandomMemory(memory_size=64, num_envs=4), cfg=settings, **spaces)


def act(observation, mask):
    seen = flatten_tensorized_space(tensorize_space(envs.observation_space, observation, device="cpu"))
    return models["policy"].compute({"observations": seen})[0].argmax()


print("r_all before:", r_all_of(act, wrap))
SequentialTrainer(env=envs, agents=agent, cfg={"timesteps": N_STEPS // 4, "disable_progressbar": True}).train()
print("r_all after:", r_all_of(act, wrap))
