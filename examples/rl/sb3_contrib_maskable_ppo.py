"""MaskablePPO of sb3-contrib. It asks the environment's `action_masks()` by itself.

pip install -e . -r examples/rl/requirements/sb3.txt
python -m examples.rl.sb3_contrib_maskable_ppo
"""

from sb3_contrib import MaskablePPO
from stable_baselines3.common.env_util import make_vec_env

from examples.rl.measuring import N_STEPS, NAME, SEED, SETTINGS, r_all_of

envs = make_vec_env(NAME, 4, seed=SEED, env_kwargs=SETTINGS)  # SB3's own: it refuses those of gymnasium.make_vec
model = MaskablePPO("MultiInputPolicy", envs, n_steps=128, batch_size=128, n_epochs=4, seed=SEED)


def act(observation, mask):
    return model.predict(observation, action_masks=mask, deterministic=True)[0]


print("r_all before:", r_all_of(act))
model.learn(N_STEPS)
print("r_all after:", r_all_of(act))
