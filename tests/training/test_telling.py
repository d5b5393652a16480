"""What trainings say: signs of life, settings with what they mean, metrics beside what they are measured against."""

import re

import pytest

from autopoly_env.errors import ConfigError
from training.networks.labelling import SourceConfig
from training.options import read_config
from training.policies.clone_samples import CloneConfig
from training.policies.config import TrainRlConfig
from training.policies.run_state import RunState
from training.run_log import known
from training.telling import duration, settings_of, table_of
from training.train_nfap import TrainNfapConfig
from training.train_warpnet import TrainWarpnetConfig


@pytest.mark.parametrize("kind", [TrainRlConfig, CloneConfig, TrainNfapConfig, TrainWarpnetConfig, SourceConfig])
def test_settings__are_all_listed_and_can_be_given_as_they_are_named(kind: type) -> None:
    lines = [line for line in settings_of(kind()) if line and not line.startswith("#")]
    names = [line.partition(" = ")[0] for line in lines]
    assert len(names) == len(set(names)) > 3 and all(" = " in line for line in lines)
    given = [line.partition("  # ")[0].replace(" = ", "=", 1) for line in lines]
    assert read_config(None, given, kind()) == kind()  # none is cut


@pytest.mark.parametrize("kind", [TrainRlConfig, CloneConfig, TrainNfapConfig, TrainWarpnetConfig, SourceConfig])
def test_setting__that_is_no_finite_number_is_told_alone(kind: type) -> None:
    lines = [line for line in settings_of(kind()) if re.match(r"[\w.]+ = [-\de.]+(?:  #|$)", line)]
    for name, key in ((line.partition(" = ")[0], line.partition(" = ")[0].rpartition(".")[2]) for line in lines):
        with pytest.raises(ConfigError, match=rf"\b{key}\b.*\bnan$|\b{key} ?=? ?nan: expected ") as caught:
            read_config(None, [f"{name}=.nan"], kind())
        assert len(str(caught.value)) < 150, name


def test_training__ends_with_a_whole_rollout() -> None:
    config = read_config(None, ["run.total_steps=1"], TrainRlConfig())
    assert config.rollout == 32 * 64
    assert [config.last_step(done) for done in (0, 1, 900)] == [2048, 1, 900]
    config = read_config(None, ["run.total_steps=4096", "run.n_envs=2", "algorithm=dqn"], TrainRlConfig())
    assert config.rollout == 2 * 4
    assert [config.last_step(done) for done in (0, 4095)] == [4096, 4103]


def test_settings__say_what_they_mean() -> None:
    lines = settings_of(TrainRlConfig())
    assert "run.eval_every = 50000  # steps" in lines
    assert "ppo.n_steps = 64  # of each environment between updates" in lines
    assert "# ppo: SB3's own arguments of PPO and MaskablePPO." in lines


def test_metrics__stand_beside_their_baselines() -> None:
    table = table_of({"loss": 0.5, "top3": 0.75, "top3_residual": 0.5, "top3_chance": 0.125, "choice": 1.0})
    rows = [line.split(None, 2) for line in table.splitlines()]
    assert rows[1:] == [["loss", "0.5"], ["top3", "0.75", "residual 0.5, chance 0.125"], ["choice", "1"]]


def test_metrics__that_samples_have_nothing_to_measure_by_are_left_out() -> None:
    assert known({"loss": 0.5, "gain_share": float("nan"), "lost": float("inf")}) == {"loss": 0.5, "lost": float("inf")}


def test_policy__that_is_worth_no_more_than_the_rectangle_has_not_learnt() -> None:
    assert RunState(best=60.0, rectangle=50.0).has_learnt
    assert not RunState(best=50.0, rectangle=50.0).has_learnt


def test_duration__is_in_words() -> None:
    assert [duration(seconds) for seconds in (3.4, 204.0, 7560.0)] == ["3 s", "3.4 min", "2.1 h"]
