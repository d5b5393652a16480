"""PPO of Stable-Baselines3 itself, which knows no masks: the policy reads them in the observation.

pip install -e . -r examples/rl/requirements/sb3.txt
python -m examples.rl.sb3_ppo
"""

from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from stable_baselines3.common.torch_layers import CombinedExtractor

from autopoly_env.wrappers import MaskInObservation
from examples.rl.measuring import N_STEPS, NAME, SEED, SETTINGS, r_all_of


class Features(CombinedExtractor):
    def forward(self, observations):
        self.mask = observations["action_mask"] > 0
        return super().forward(observations)


class MaskedPolicy(MultiInputActorCriticPolicy):
    def _get_action_dist_from_latent(self, latent_pi):
        logits = self.action_net(latent_pi).masked_fill(~self.features_extractor.mask, -1e8)
        return self.action_dist.proba_distribution(logits)


envs = make_vec_env(NAME, 4, seed=SEED, env_kwargs=SETTINGS, wrapper_class=MaskInObservation)
features = {"features_extractor_class": Features}
model = PPO(MaskedPolicy, envs, n_steps=128, batch_size=128, n_epochs=4, policy_kwargs=features, seed=SEED)


def act(observation, mask):
    return model.predict(observation, deterministic=True)[0]


print("r_all before:", r_all_of(act, MaskInObservation))
model.learn(N_STEPS)
print("r_all after:", r_all_of(act, MaskInObservation))
