"""Actor-critic with its loop in the open, as CleanRL writes it; tensors by NumpyToTorch of Gymnasium.

pip install -e . -r examples/rl/requirements/cleanrl.txt
python -m examples.rl.cleanrl_a2c
"""

import gymnasium
import torch
from gymnasium.wrappers.vector import NumpyToTorch
from torch.distributions import Categorical

from examples.rl.measuring import N_STEPS, NAME, SEED, SETTINGS, r_all_of
from examples.rl.nets import Net, as_batch

envs = NumpyToTorch(gymnasium.make_vec(NAME, num_envs=8, **SETTINGS))
net = Net(envs.single_observation_space, 1 + envs.single_action_space.n)
optimiser = torch.optim.Adam(net.parameters(), 2e-3)


def look(observation, mask):
    output = net(*observation.values())
    return Categorical(logits=output[:, 1:].masked_fill(mask == 0, -1e8)), output[:, 0]  # the policy, the value


def act(observation, mask):
    return look(*as_batch(observation, mask))[0].probs.argmax()


print("r_all before:", r_all_of(act))
(observation, info), over = envs.reset(seed=SEED), torch.zeros(8, dtype=torch.bool)
for _ in range(N_STEPS // 64):
    steps = []
    for _ in range(8):
        (policy, value), begins = look(observation, info["action_mask"]), over  # after an end a step is but a reset
        observation, reward, terminated, truncated, info = envs.step(action := policy.sample())
        over = terminated | truncated
        steps.append((value, policy.log_prob(action), policy.entropy(), 0.1 * reward.float(), over, ~begins))
    gain, loss = look(observation, info["action_mask"])[1].detach(), 0.0
    for value, log_prob, entropy, reward, ended, counts in reversed(steps):
        gain = reward + 0.99 * gain * ~ended
        loss += (((gain - value) ** 2 - (gain - value.detach()) * log_prob - 0.01 * entropy) * counts).mean()
    optimiser.zero_grad()
    loss.backward()
    optimiser.step()
print("r_all after:", r_all_of(act))
