"""Cloning good play offline, from a data set of Minari that has the masks.

pip install -e . -r examples/rl/requirements/minari.txt
python -m examples.rl.minari_cloning
"""

import tempfile
from pathlib import Path

import torch
from torch.nn.functional import cross_entropy

from examples.rl.measuring import SETTINGS, r_all_of
from examples.rl.nets import Net, as_batch
from training.datasets.plays import load_plays
from training.make_dataset import main as make_dataset

folder, name = Path(tempfile.mkdtemp()), "autopoly/greedy-v0"
arguments = [f"--env-option={key}={value}" for key, value in SETTINGS.items()]
make_dataset(["minari", "--n=60", "--agent=greedy", f"--name={name}", f"--out={folder}", *arguments])
dataset = load_plays(folder, name)
env, episodes = dataset.recover_environment(), list(dataset)
keys = list(env.unwrapped.observation_space)
parts = {key: [torch.from_numpy(e.observations[key][:-1]) for e in episodes] for key in env.observation_space}
seen = {key: torch.cat(arrays) for key, arrays in parts.items()}
actions = torch.cat([torch.from_numpy(e.actions) for e in episodes])
net = Net(env.unwrapped.observation_space, env.action_space.n)
optimiser = torch.optim.Adam(net.parameters(), 1e-3)


def logits(seen, masks):
    return net(*(seen[key] for key in keys)).masked_fill(masks == 0, -1e8)


def act(observation, mask):
    return logits(*as_batch(observation, mask)).argmax()


print("r_all before:", r_all_of(act))
for _ in range(200):
    optimiser.zero_grad()
    cross_entropy(logits(seen, seen["action_mask"]), actions).backward()
    optimiser.step()
print("r_all after:", r_all_of(act))
