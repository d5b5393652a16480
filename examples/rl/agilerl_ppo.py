"""PPO of AgileRL. It reads `info["action_mask"]` by itself, that of the native vector environment included.

pip install -e . -r examples/rl/requirements/agilerl.txt
python -m examples.rl.agilerl_ppo
"""

import gymnasium
from agilerl.algorithms import PPO
from agilerl.rollouts import collect_rollouts

from examples.rl.measuring import N_STEPS, NAME, SETTINGS, r_all_of

envs = gymnasium.make_vec(NAME, num_envs=8, **SETTINGS)
spaces = envs.single_observation_space, envs.single_action_space
agent = PPO(*spaces, num_envs=8, learn_step=N_STEPS // 8, batch_size=128)


def act(observation, mask):
    return agent.get_action(observation, mask)[0]


print("r_all before:", r_all_of(act))
for _ in range(8):
    collect_rollouts(agent, envs)
    agent.learn()
print("r_all after:", r_all_of(act))
