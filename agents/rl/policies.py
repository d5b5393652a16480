"""The policy network in the clothes of Stable-Baselines3: one class of policy for each kind of algorithm.

Their feature extractor, action net and value net are the parts of `MeshNet`, by the same names. Illegal actions are
masked inside the policy, by the key `action_mask` of the observation, whatever the algorithm.
"""

from typing import Any, ClassVar

import gymnasium
import torch
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from stable_baselines3.common.policies import ActorCriticPolicy, BasePolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.type_aliases import Schedule
from stable_baselines3.dqn.policies import DQNPolicy, QNetwork
from torch import Tensor, nn

from agents.rl.config import NetConfig, SpaceSpec
from agents.rl.network import NEVER, Encoded, MeshEncoder, MeshNet, PointerHead, ValueHead, begin_flat

PARTS = ("features_extractor", "action_net", "value_net")


class MeshFeatures(BaseFeaturesExtractor):
    """`MeshEncoder` as a features extractor; what it gives is no tensor but `Encoded`."""

    def __init__(self, observation_space: gymnasium.Space[Any], net: NetConfig, spec: SpaceSpec) -> None:
        super().__init__(observation_space, features_dim=net.width)
        self.encoder = MeshEncoder(net, spec)

    def forward(self, observations: dict[str, Tensor]) -> Encoded:
        encoded: Encoded = self.encoder(observations)
        return encoded


class _Split(nn.Module):
    """Where SB3 has layers between features and heads: all for the actor, what is known of the whole for the critic."""

    def forward(self, encoded: Encoded) -> tuple[Encoded, Tensor]:
        return encoded, encoded.whole

    def forward_actor(self, encoded: Encoded) -> Encoded:
        return encoded

    def forward_critic(self, encoded: Encoded) -> Tensor:
        return encoded.whole


class _Pointing(BasePolicy):
    """What the policies of all algorithms share: how they are built, and built again from a zip."""

    _more: ClassVar[dict[str, Any]] = {}  # settings of SB3's class

    def __init__(
        self,
        observation_space: gymnasium.Space[Any],
        action_space: gymnasium.Space[Any],
        lr_schedule: Schedule,
        net: NetConfig,
        spec: SpaceSpec | None = None,
        **kwargs: Any,
    ) -> None:
        spec = spec or kwargs.pop("rules")  # as older zips call it
        self.net_config, self.spec = net, spec
        given = {
            "features_extractor_class": MeshFeatures,
            "features_extractor_kwargs": {"net": net, "spec": spec},
            "normalize_images": False,  # the network scales pictures by itself
        }
        super().__init__(observation_space, action_space, lr_schedule, **{**given, **self._more, **kwargs})

    def _get_constructor_parameters(self) -> dict[str, Any]:
        ours = ("features_extractor_class", "features_extractor_kwargs")
        parameters = {k: v for k, v in super()._get_constructor_parameters().items() if k not in ours}
        return {**parameters, "net": self.net_config, "spec": self.spec}


class _ActorCritic(_Pointing):
    """A pointer head for the actor and a value head for the critic, where SB3 would build layers of its own."""

    _more: ClassVar[dict[str, Any]] = {"ortho_init": False}

    def _build(self, lr_schedule: Schedule) -> None:
        policy: Any = self  # SB3 declares its own layers in these places
        policy.mlp_extractor = _Split()
        policy.action_net = PointerHead(self.net_config, self.spec)
        policy.value_net = ValueHead(self.net_config)
        begin_flat(policy.action_net)
        policy.optimizer = policy.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)


class PointerPolicy(_ActorCritic, ActorCriticPolicy):
    """For PPO and A2C."""


class MaskablePointerPolicy(_ActorCritic, MaskableActorCriticPolicy):
    """For MaskablePPO."""


class PointerQNetwork(QNetwork):
    """Q of an action: what is still to be gained, and how much better than that the action is."""

    def __init__(self, *args: Any, net: NetConfig, spec: SpaceSpec, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.q_net = nn.Sequential()  # SB3's own layers are not used
        self.action_net = PointerHead(net, spec)
        self.value_net = ValueHead(net)
        begin_flat(self.action_net)

    def forward(self, obs: Any) -> Tensor:
        encoded: Any = self.extract_features(obs, self.features_extractor)
        better: Tensor = self.action_net(encoded)
        return torch.where(better > 0.5 * NEVER, better + self.value_net(encoded.whole), NEVER)


class PointerDqnPolicy(_Pointing, DQNPolicy):
    """For DQN."""

    _more: ClassVar[dict[str, Any]] = {"net_arch": []}

    def make_q_net(self) -> QNetwork:
        net_args = self._update_features_extractor(self.net_args, features_extractor=None)
        return PointerQNetwork(**net_args, net=self.net_config, spec=self.spec).to(self.device)


def net_of(policy: Any) -> MeshNet:
    """The network of a policy, as a copy on the CPU."""
    inner = getattr(policy, "q_net", policy)
    net = MeshNet(policy.net_config, policy.spec)
    for name in PARTS:
        part = getattr(inner, name)
        part = part.encoder if isinstance(part, MeshFeatures) else part
        getattr(net, name).load_state_dict({k: v.detach().cpu() for k, v in part.state_dict().items()})
    return net.eval()


def put_net(policy: Any, net: MeshNet) -> None:
    """Let a policy go on from a network."""
    for inner in [getattr(policy, "q_net", policy), getattr(policy, "q_net_target", None)]:
        for name in PARTS if inner is not None else ():
            part = getattr(inner, name)
            part = part.encoder if isinstance(part, MeshFeatures) else part
            part.load_state_dict(getattr(net, name).state_dict())
