"""The line between learning and examination: which seeds everything that draws targets asks its sources for."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.guided.config import NfapConfig, WarpConfig
from agents.rl.config import SpaceSpec, TaskSpec
from agents.rl.envs import EnvFactory, NativeVecEnv, make_vec_env
from autopoly_env.errors import ConfigError
from autopoly_env.targets import HELD_OUT, LEARNING, SPLITS
from autopoly_env.targets.dice import Dice
from training import make_expert
from training.datasets.build import MAX_N, MAX_SEED, DatasetSettings
from training.networks.labelling import SourceConfig, build_trajectory
from training.networks.samples import LabelConfig
from training.networks.streams import Live, NfapStream, WarpStream, stored
from training.policies.config import EnvConfig
from training.policies.evaluation import evaluations_of

TEST = SPLITS["test"]
NUMBERS = st.integers(0, 2**63 - 1)
SOURCES = st.builds(
    SourceConfig,
    source=st.sampled_from(["teacher", "simulator", "search"]),
    targets=st.sampled_from(["both", "construction", "objects"]),
    seed=st.integers(0, 2**32),
)


class _AskedError(Exception):
    """A target was asked for, and that is all we wanted to know."""


@contextmanager
def recorded(*, playing: bool = False) -> Iterator[list[int]]:
    """The seeds that targets are made of, all of which roll `Dice`; unless `playing`, none is made."""
    seeds: list[int] = []
    begin = Dice.__init__

    def record(dice: Dice, salt: int, seed: int) -> None:
        seeds.append(seed)
        if not playing:
            raise _AskedError
        begin(dice, salt, seed)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Dice, "__init__", record)
        yield seeds


def test_what_is_learnt_from_held_out_and_tested_on__have_nothing_in_common() -> None:
    assert LEARNING.start == 0 and LEARNING.stop == HELD_OUT.start and HELD_OUT.stop == TEST.start


# --- what learns ---


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_environments_to_learn_in__draw_learning_seeds_only(seed: int) -> None:
    factory = EnvFactory(SpaceSpec(max_vertices=16, obs_resolution=32, max_steps=2), resolution=32)
    envs = make_vec_env(factory, [TaskSpec(), TaskSpec("objects", 0.3)], 2, "native", seed=seed % 2**31)
    assert isinstance(envs, NativeVecEnv)
    with recorded() as seeds:
        for env in envs.envs:
            for number in range(40):
                env.set_difficulty(1 + number % 5)
                with suppress(_AskedError):
                    env.reset(seed=seed if number == 20 else None)
    assert len(seeds) == 80 and all(one in LEARNING for one in seeds)


def test_environments_that_play_on__draw_learning_seeds_only() -> None:
    factory = EnvFactory(SpaceSpec(max_vertices=16, obs_resolution=32, max_steps=1), resolution=32)
    envs = make_vec_env(factory, [TaskSpec()], 2, "native", seed=3)
    with recorded(playing=True) as seeds:
        envs.reset()
        for _ in range(25):
            envs.step(np.zeros(2, np.int64))  # STOP, and so the next target
    assert len(seeds) == len(set(seeds)) == 52 and all(one in LEARNING for one in seeds)


@given(source=SOURCES, number=NUMBERS)
def test_labelled_constructions__are_of_learning_seeds_or_of_held_out_ones(source: SourceConfig, number: int) -> None:
    for held_out, allowed in ((False, LEARNING), (True, HELD_OUT)):
        with recorded() as seeds, suppress(_AskedError):
            build_trajectory(source, number, held_out)
        assert len(seeds) == 1 and seeds[0] in allowed


@given(source=SOURCES, seed=st.integers(0, 2**32), number=NUMBERS)
def test_live_samples_of_networks__are_of_learning_seeds_or_of_held_out_ones(
    source: SourceConfig, seed: int, number: int
) -> None:
    for held_out, allowed in ((False, LEARNING), (True, HELD_OUT)):
        live = Live(source, held_out)
        for stream in (NfapStream(live, NfapConfig(), LabelConfig(), seed), WarpStream(live, WarpConfig(), seed)):
            with recorded() as seeds, suppress(_AskedError):
                stream[number]
            assert len(seeds) == 1 and seeds[0] in allowed


@given(
    kind=st.sampled_from(["constructions", "objects"]),
    seed=st.integers(0, MAX_SEED),
    index=st.integers(0, MAX_N - 1),
)
def test_data_sets__keep_to_the_seeds_of_their_split(kind: Any, seed: int, index: int) -> None:
    for split, allowed in (("train", LEARNING), ("validation", HELD_OUT), ("test", TEST)):
        with recorded() as seeds, suppress(_AskedError):
            DatasetSettings(kind, split, seed).example(index)
        assert seeds == [allowed[seed * MAX_N + index]]


def test_shards_that_clones_and_networks_learn_from__are_of_learning_seeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(make_expert, "SHARD_SIZE", 8)
    source = ["source=simulator", "targets=construction", "difficulty=[1,1]", "resolution=64"]
    for name, allowed, more in (("learn", LEARNING, []), ("test", HELD_OUT, ["--held-out"])):
        with recorded(playing=True) as seeds:
            assert make_expert.main([str(tmp_path / name), *source, "--n", "8", "--engine", "serial", *more]) == 0
        assert len(seeds) >= 8 and all(one in allowed for one in seeds)
    assert len(stored(str(tmp_path / "learn"))) == len(stored(str(tmp_path / "test"), held_out=True)) == 8
    with pytest.raises(ConfigError, match=r"has shards of held-out targets \(meta\.json\); .* without --held-out"):
        stored(str(tmp_path / "test"))
    with pytest.raises(ConfigError, match=r"has shards of targets to learn from \(meta\.json\); .* with --held-out"):
        stored(str(tmp_path / "learn"), held_out=True)


# --- what examines ---


def test_evaluations_of_policies__are_on_held_out_seeds() -> None:
    with recorded(playing=True) as seeds:
        evaluations_of(EnvConfig(), 3, 32)
    assert seeds == [*HELD_OUT[:3], *HELD_OUT[:3]]
