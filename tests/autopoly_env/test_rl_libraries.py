"""Other people's algorithms: stable-baselines3 and sb3-contrib check the environments and train on them."""

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest

from autopoly_env.wrappers import FlatObservation
from tests.helpers.paths import ROOT

pytestmark = pytest.mark.slow  # every library trains

IDS = {"AutoPoly-v0": {}, "AutoPolyObjects-v0": {}, "AutoPolyFolder-v0": {"targets": str(ROOT / "examples")}}
SMALL: dict[str, Any] = {"resolution": 16, "obs_resolution": 36, "max_vertices": 16, "reward_mode": "improvement"}
N_STEPS = 2000
TINY_NETS = {"net_arch": [16], "features_extractor_kwargs": {"cnn_output_dim": 8}}

sb3 = pytest.importorskip("stable_baselines3", reason="needs stable-baselines3 (pip install -e '.[dev]')")


@pytest.fixture(autouse=True)
def one_thread() -> Any:
    torch = pytest.importorskip("torch")
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def make() -> Any:
    return gymnasium.make("autopoly_env:AutoPoly-v0", **SMALL)


def check_trained(model: Any) -> None:
    """It has taken all its steps, learned from some of them, and acts."""
    assert model.num_timesteps >= N_STEPS
    assert model._n_updates > 0
    action, _ = model.predict(make().reset(seed=0)[0])
    assert make().action_space.contains(np.int64(action))


@pytest.mark.parametrize("name", IDS)
def test_sb3s_check__passes_without_a_warning(name: str) -> None:
    from stable_baselines3.common.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(f"autopoly_env:{name}", **IDS[name]).unwrapped, warn=True)


def test_ppo__trains() -> None:
    model = sb3.PPO(
        "MultiInputPolicy", make(), n_steps=500, batch_size=250, n_epochs=1, policy_kwargs=TINY_NETS, seed=0
    )
    check_trained(model.learn(N_STEPS))


def test_a2c__trains() -> None:
    model = sb3.A2C("MultiInputPolicy", make(), n_steps=100, policy_kwargs=TINY_NETS, seed=0)
    check_trained(model.learn(N_STEPS))


def test_dqn__trains() -> None:
    settings = {"buffer_size": 500, "learning_starts": 100, "train_freq": 50, "policy_kwargs": TINY_NETS, "seed": 0}
    check_trained(sb3.DQN("MultiInputPolicy", make(), **settings).learn(N_STEPS))


def test_maskable_ppo__trains_and_never_takes_an_illegal_action() -> None:
    contrib = pytest.importorskip("sb3_contrib", reason="needs sb3-contrib (pip install -e '.[dev]')")
    from stable_baselines3.common.callbacks import BaseCallback

    class Watch(BaseCallback):
        n_illegal = 0

        def _on_step(self) -> bool:
            self.n_illegal += sum(info["invalid_action"] for info in self.locals["infos"])
            return True

    watch = Watch()
    settings = {"n_steps": 500, "batch_size": 250, "n_epochs": 1, "policy_kwargs": TINY_NETS, "seed": 0}
    check_trained(contrib.MaskablePPO("MultiInputPolicy", make(), **settings).learn(N_STEPS, callback=watch))
    assert watch.n_illegal == 0


def test_ppo__trains_on_the_flat_observation_in_a_vectorised_env() -> None:
    from stable_baselines3.common.env_util import make_vec_env

    envs = make_vec_env("autopoly_env:AutoPoly-v0", 2, seed=0, env_kwargs=SMALL, wrapper_class=FlatObservation)
    model = sb3.PPO("MlpPolicy", envs, n_steps=100, batch_size=100, n_epochs=1, policy_kwargs={"net_arch": [8]})
    model.learn(200)
    assert model.num_timesteps == 200


@pytest.mark.parametrize("kind", ["single", "native", "sync"])
def test_gymnasiums_numpy_to_torch__carries_all_of_the_info(kind: str) -> None:
    torch = pytest.importorskip("torch")
    pytest.importorskip("array_api_compat", reason="needs array-api-compat (pip install -e '.[dev]')")
    from gymnasium.wrappers import NumpyToTorch
    from gymnasium.wrappers.vector import NumpyToTorch as VectorNumpyToTorch

    mode = {"native": "vector_entry_point"}.get(kind, kind)
    name, settings = "autopoly_env:AutoPoly-v0", {**SMALL, "max_steps": 2}
    if kind == "single":
        env: Any = NumpyToTorch(gymnasium.make(name, **settings))
    else:
        env = VectorNumpyToTorch(gymnasium.make_vec(name, num_envs=2, vectorization_mode=mode, **settings))
    _, info = env.reset(seed=0)
    assert all(isinstance(value, torch.Tensor) for value in info.values())
    assert info["invalid_action"].dtype == torch.bool and info["end"].dtype == torch.int64
    for _ in range(1 if kind == "single" else 4):  # an end and a reset among them
        *_, info = env.step(torch.ones(() if kind == "single" else (2,), dtype=torch.int64))
        assert all(isinstance(value, torch.Tensor) for value in info.values())
