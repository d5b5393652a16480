"""Config files of agents: those in the repository say what the code does by default; bad ones are refused in a line."""

import re
from dataclasses import asdict
from pathlib import Path

import pytest
import yaml

from agents.baselines.beam import BeamConfig, GreedyConfig
from agents.registry import AGENTS, find_agent, make_agent
from autopoly_env.errors import ConfigError
from tests.helpers.paths import ROOT
from tests.helpers.solving import simulator

FOLDER = ROOT / "configs" / "agent"
NAMES = ("mcts", "mcts_paper", "greedy", "beam", "trace", "climb")


def written(folder: Path, text: str | bytes, name: str = "beam.yaml") -> str:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return str(path)


def test_folder__holds_these() -> None:
    assert sorted(path.name for path in FOLDER.iterdir()) == sorted(f"{name}.yaml" for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_file__says_everything_as_it_is_by_default(name: str) -> None:
    path = FOLDER / f"{name}.yaml"
    default = AGENTS[name].default
    assert find_agent(str(path)).config() == default
    assert list(yaml.safe_load(path.read_text())) == list(asdict(default))


@pytest.mark.parametrize("name", NAMES)
def test_file__begins_with_its_command_and_what_that_gives(name: str) -> None:
    first = (FOLDER / f"{name}.yaml").read_text().splitlines()[0]
    assert re.fullmatch(rf"# python -m agents\.solve examples --agent {name} .*: mean r_all \d+\.\d", first)


def test_options__that_are_left_out_are_at_their_default(tmp_path: Path) -> None:
    assert find_agent(written(tmp_path, "width: 3\n")).config() == BeamConfig(width=3)
    assert find_agent(written(tmp_path, "# nothing\n")).config() == BeamConfig()
    greedy = find_agent(written(tmp_path, "patience: 2\n", "greedy.yaml"))
    assert greedy.config() == GreedyConfig(width=1, patience=2)
    assert greedy.config(width=3) == GreedyConfig(width=3, patience=2)
    assert find_agent(written(tmp_path, "seeds: [trace]\n", "mcts.yaml")).config().seeds == ("trace",)


def test_make_agent__of_a_file_is_the_agent_with_these_options(tmp_path: Path) -> None:
    agent, game = make_agent(written(tmp_path, "width: 2\npatience: 1\n")), simulator("house")
    assert agent.name == "beam"
    assert agent.solve(game).sequence == make_agent("beam", width=2, patience=1).solve(game).sequence


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("witdh: 3", r"unknown option 'witdh'; the options of beam are width, patience, stuck_discount, merge_grid$"),
        ("3: 3", "unknown option 3; the options of beam are width"),
        ("width: wide", "option width: .* got 'wide'"),
        ("width: 0", "width=0: expected a number of at least 1"),
        ("width: [1", "not YAML .* write one 'option: value' a line"),
        ("width: !!python/object:os.system 1", "not YAML"),
        ("a: &a [*a]\n\tb", "not YAML"),
        ("[" * 5000, "not YAML"),
        ("when: 2020-13-45", "not YAML"),
        ("- width", "holds a list; write one 'option: value' a line"),
        ("width", "holds a str"),
        (b"\xff\xfe\xff", "not UTF-8"),
        (b"width: \x00", "not YAML"),
    ],
)
def test_broken_file__is_told_in_one_line(tmp_path: Path, text: str | bytes, complaint: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ConfigError, match=complaint) as caught:
        find_agent(path)
    assert "\n" not in str(caught.value) and path in str(caught.value)


def test_file__has_to_be_named_after_an_agent(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no agent is called 'bean'; name the file after one of .*\bbeam\b"):
        make_agent(written(tmp_path, "", "bean.yaml"))
    with pytest.raises(ConfigError, match=r"cannot read .*beam\.yaml \(No such file or directory\)"):
        make_agent(str(tmp_path / "beam.yaml"))
    with pytest.raises(ConfigError, match=r"cannot read .*beam\.yml \(Is a directory\)"):
        (tmp_path / "beam.yml").mkdir()
        find_agent(str(tmp_path / "beam.yml"))
