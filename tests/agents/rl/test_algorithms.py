"""The algorithms: only legal actions, and a policy's network is the policy."""

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
import torch

from agents.rl.algorithms import MaskedDqn, make_model
from agents.rl.envs import TaskSpec, make_vec_env
from agents.rl.network import NEVER, MeshNet
from agents.rl.policies import net_of, put_net
from tests.helpers.policies import ALGORITHMS, config, factory

torch.set_num_threads(1)  # as tests run beside each other

pytestmark = pytest.mark.slow  # every algorithm plays


@pytest.mark.parametrize("name", ALGORITHMS)
def test_algorithm__never_takes_an_illegal_action(name: str) -> None:
    settings = config(f"algorithm={name}", "dqn.exploration_final_eps=0.9")
    envs = make_vec_env(factory(), [TaskSpec()], 4, "native", seed=0)
    taken: list[bool] = []

    def noted(actions: Any, step: Any = envs.step_async) -> None:
        masks = np.stack(envs.env_method("action_masks"))
        taken.extend(masks[np.arange(4), actions].tolist())
        step(actions)

    envs.step_async = noted  # type: ignore[method-assign]
    model = make_model(
        name, envs, settings.net, settings.env.spec(), lambda _: 1e-3, asdict(settings.options()), 0, "cpu"
    )
    model.learn(128)
    assert len(taken) == 128 and all(taken)
    seen = envs.reset()
    masks = np.stack(envs.env_method("action_masks"))
    for _ in range(10):
        given = {"action_masks": masks} if name == "maskable_ppo" else {}
        actions, _ = model.predict(seen, deterministic=False, **given)
        assert masks[np.arange(4), actions].all()


def test_dqn__hopes_for_legal_actions_only() -> None:
    settings = config("algorithm=dqn")
    envs = make_vec_env(factory(), [TaskSpec()], 2, "native", seed=0)
    model: Any = make_model(
        "dqn", envs, settings.net, settings.env.spec(), lambda _: 1e-3, asdict(settings.dqn), 0, "cpu"
    )
    assert isinstance(model, MaskedDqn)
    seen = {name: torch.from_numpy(array) for name, array in envs.reset().items()}
    with torch.no_grad():
        q = model.q_net(seen)
    assert torch.equal(q > 0.5 * NEVER, seen["action_mask"] > 0)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_network_of_a_policy__is_the_policy(name: str) -> None:
    settings = config(f"algorithm={name}")
    envs = make_vec_env(factory(), [TaskSpec()], 2, "native", seed=0)
    model: Any = make_model(
        name, envs, settings.net, settings.env.spec(), lambda _: 1e-3, asdict(settings.options()), 0, "cpu"
    )
    net = MeshNet(settings.net, settings.env.spec())
    for parameter in net.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    put_net(model.policy, net)
    seen = {key: torch.from_numpy(array) for key, array in envs.reset().items()}
    with torch.no_grad():
        logits, value = net(seen)
        again, _ = net_of(model.policy)(seen)
        assert torch.equal(logits, again)
        if name == "dqn":
            legal = seen["action_mask"] > 0
            assert torch.allclose(model.q_net(seen)[legal], (logits + value[:, None])[legal], atol=1e-5)
        else:
            said = model.policy.get_distribution(seen).distribution.logits
            assert torch.allclose(said, logits.log_softmax(-1), atol=1e-4)
            assert torch.allclose(model.policy.predict_values(seen)[:, 0], value, atol=1e-5)
