"""PPO of TorchRL on the native vector environment. `MaskedCategorical` takes the mask of the info, once it is bool.

pip install -e . -r examples/rl/requirements/torchrl.txt
python -m examples.rl.torchrl_ppo
"""

import gymnasium
import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torchrl.data import Unbounded
from torchrl.envs import DTypeCastTransform, GymWrapper, TransformedEnv, default_info_dict_reader
from torchrl.modules import MaskedCategorical, ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss

from examples.rl.measuring import N_STEPS, NAME, SETTINGS, r_all_of
from examples.rl.nets import Net, as_batch

envs = gymnasium.make_vec(NAME, num_envs=8, autoreset_mode="Disabled", **SETTINGS)  # TorchRL resets by itself
space, keys = envs.single_observation_space, list(envs.single_observation_space)
mask_spec = Unbounded((8, envs.single_action_space.n), dtype=torch.int8)
reader = default_info_dict_reader(["action_mask"], [mask_spec])  # auto_register_info_dict() would try illegal actions
env = GymWrapper(envs, categorical_action_encoding=True).set_info_dict_reader(reader)
env = TransformedEnv(env, DTypeCastTransform(torch.int8, torch.bool, in_keys=["action_mask"]))
logits = TensorDictModule(Net(space, envs.single_action_space.n), keys, ["logits"])
mask = {"logits": "logits", "mask": "action_mask"}
actor = ProbabilisticActor(logits, in_keys=mask, distribution_class=MaskedCategorical, return_log_prob=True)
loss = ClipPPOLoss(actor, ValueOperator(Net(space, 1), keys))
optimiser = torch.optim.Adam(loss.parameters(), 5e-4)


def act(observation, mask):
    seen, mask = as_batch(observation, mask)
    return logits(TensorDict(seen, [1]))["logits"].masked_fill(mask == 0, -1e8).argmax()


print("r_all before:", r_all_of(act))
for _ in range(8):
    steps = env.rollout(N_STEPS // 64, actor, break_when_any_done=False).detach()
    loss.make_value_estimator(gamma=0.99)
    for _ in range(4):
        values = loss(steps)
        optimiser.zero_grad()
        sum(values[name] for name in ("loss_objective", "loss_critic", "loss_entropy")).backward()
        optimiser.step()
print("r_all after:", r_all_of(act))
