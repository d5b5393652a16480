"""DQN of Tianshou. It looks for the keys `obs` and `mask` in the observation; its PPO looks for no mask.

pip install -e . -r examples/rl/requirements/tianshou.txt
python -m examples.rl.tianshou_dqn
"""

from tianshou.algorithm import DQN
from tianshou.algorithm.modelfree.dqn import DiscreteQLearningPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Batch, Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv
from tianshou.trainer import OffPolicyTrainerParams
from tianshou.utils.net.common import Net

from autopoly_env.wrappers import FlatObservation, MaskInObservation
from examples.rl.measuring import N_STEPS, make, r_all_of


def wrap(env):
    return MaskInObservation(FlatObservation(env), key="mask", observation_key="obs", dtype=bool)


env = wrap(make())  # for its spaces: those of a vector environment of Tianshou are of what is inside all wrappers
net = Net(state_shape=env.observation_space["obs"].shape, action_shape=env.action_space.n, hidden_sizes=(128, 128))
policy = DiscreteQLearningPolicy(model=net, action_space=env.action_space, eps_training=0.2)
algorithm = DQN(policy=policy, optim=AdamOptimizerFactory(lr=1e-3), target_update_freq=200)
envs = DummyVectorEnv([lambda: wrap(make())] * 4)
collector = Collector(policy, envs, VectorReplayBuffer(N_STEPS, 4), exploration_noise=True)
settings = OffPolicyTrainerParams(
    training_collector=collector,
    max_epochs=1,
    epoch_num_steps=N_STEPS,
    collection_step_num_env_steps=64,
    update_step_num_gradient_steps_per_sample=0.25,
    show_progress=False,
)


def act(observation, mask):
    return policy(Batch(obs=Batch(obs=observation["obs"][None], mask=observation["mask"][None]), info=Batch())).act


print("r_all before:", r_all_of(act, wrap))
algorithm.run_training(settings)
print("r_all after:", r_all_of(act, wrap))
