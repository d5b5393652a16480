"""Data sets of play in the format of Minari: what was done, what might have been, and the environment of it."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from agents.registry import make_agent
from autopoly_env.errors import ConfigError
from autopoly_env.wrappers import action_masks
from tests.helpers.paths import ROOT
from training.datasets.plays import VERSION, PlaySettings, load_plays, record_plays
from training.make_dataset import main

SMALL: dict[str, Any] = {"resolution": 32, "obs_resolution": 16, "max_vertices": 12, "max_steps": 6}
NAME = "autopoly/small-v0"
SETTINGS = PlaySettings(NAME, 3, settings=tuple(SMALL.items()), seed=5)


def test_play__without_minari_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "minari", None)
    monkeypatch.setitem(sys.modules, "jax", None)
    with pytest.raises(ConfigError, match=r"data sets of play need Minari; pip install 'minari\[create,hdf5\]'"):
        record_plays(tmp_path, SETTINGS, make_agent("greedy"))
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("minari", reason="needs Minari (pip install 'minari[create,hdf5]')")
    made: Path = tmp_path_factory.mktemp("minari")
    record_plays(made, SETTINGS, make_agent("greedy"))
    return made


@pytest.mark.slow
def test_data_set__replays_in_the_environment_that_it_recovers(folder: Path) -> None:
    dataset = load_plays(folder, NAME)
    env = dataset.recover_environment()
    for k, episode in enumerate(dataset.iterate_episodes()):
        observation, _ = env.reset(seed=5 + k)
        for step, action in enumerate(episode.actions):
            for key, array in observation.items():
                np.testing.assert_array_equal(episode.observations[key][step], array)
            np.testing.assert_array_equal(observation["action_mask"] == 1, action_masks(env))
            assert observation["action_mask"][action] == 1
            observation, reward, *_ = env.step(int(action))
            assert reward == episode.rewards[step]


@pytest.mark.slow
def test_data_set__is_read_by_a_process_that_knows_minari_alone(folder: Path) -> None:
    script = (
        "import sys, minari\n"
        f"dataset = minari.load_dataset({NAME!r})\n"
        "env = dataset.recover_environment()\n"
        "print(len(dataset), type(env.unwrapped).__name__, sorted(env.reset(seed=5)[0])[0])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={"MINARI_DATASETS_PATH": str(folder), "PYTHONPATH": str(ROOT), "PATH": ""},
        capture_output=True,
        text=True,
        cwd=folder,
        check=True,
    )
    assert done.stdout.split() == ["3", "AutoPolyEnv", "action_mask"]


@pytest.mark.slow
def test_data_set__of_other_operators_or_another_version_is_refused(folder: Path) -> None:
    same = gymnasium.make("autopoly_env:AutoPoly-v0", **SMALL)
    assert load_plays(folder, NAME, same).total_episodes == 3
    full = gymnasium.make("autopoly_env:AutoPoly-v0", **SMALL, operators="full")
    with pytest.raises(ConfigError, match=r"has the operators edge_subdivide,.*, the environment .*face_hole.*same$"):
        load_plays(folder, NAME, full)
    with pytest.raises(ConfigError, match="there is no data set 'autopoly/none-v0'"):
        load_plays(folder, "autopoly/none-v0")
    dataset = load_plays(folder, NAME)
    known = dataset.storage.metadata[VERSION]
    try:
        dataset.storage.update_metadata({VERSION: "0.0.1"})
        with pytest.raises(ConfigError, match=r"data set autopoly/small-v0 is of AutoPoly 0.0.1, this is .*; make it"):
            load_plays(folder, NAME)
    finally:
        dataset.storage.update_metadata({VERSION: known})


@pytest.mark.slow
def test_command__refuses_in_one_line_what_cannot_be(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    common = ["minari", f"--out={folder}", "--quiet"]
    assert main([*common, f"--name={NAME}", "--n=1"]) == 2
    assert main([*common, "--name=autopoly/no-v0", "--n=0"]) == 2
    assert main([*common, "--name=autopoly/no-v0", "--n=1", "--env-option=resolution"]) == 2
    assert main([*common, "--name=autopoly/no-v0", "--n=1", "--env-option=colour=red"]) == 2
    assert main([*common, "--name=autopoly/no-v0", "--n=1", "--env=CartPole-v1"]) == 2
    assert main([*common, "--name=no version", "--n=1"]) == 2
    assert main([*common, "--name=autopoly/no-v0", "--n=1", "--agent=trace"]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    expected = (
        f"has a data set {NAME} already",
        "expected at least 1 episode",
        "expected key=value",
        "'colour'",
        "env='CartPole-v1': expected one of 'AutoPoly-v0'",
        "expected NAMESPACE/NAME-vN",
        "trace finds outlines as a whole",
    )
    assert len(lines) == len(expected)
    for line, text in zip(lines, expected, strict=True):
        assert text in line
