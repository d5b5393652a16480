"""Agents from outside: found by module and name or in a file of options, and told of in one line where they fail."""

import itertools
import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from agents import solve
from agents.base import Agent, Decision
from agents.baselines.beam import BeamAgent, GreedyAgent
from agents.conformance import check_agent
from agents.names import AGENT_NAMES
from agents.registry import AGENTS, find_agent, make_agent, register_agent
from autopoly_env.errors import ConfigError
from autopoly_env.operators import STOP
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.simulator import Simulator, State
from tests.helpers.commands import Run, runner, without_pulses
from tests.helpers.paths import ROOT
from tests.helpers.solving import simulator
from training import evaluate

CHAIR = ROOT / "examples" / "chair.png"
QUICK = ("--resolution", 32, "--refits", 20, "--quiet")
HASTY, CHECK, *_ = re.findall(
    r"```python\n(.*?)```", (ROOT / "docs" / "agents.md").read_text(encoding="utf-8"), re.DOTALL
)

# A module with an agent that does whatever a test wants in `act`, and one that returns whatever from `solve`.
TEMPLATE = """
from dataclasses import dataclass
from agents.base import Agent, Decision
from agents.baselines.beam import BeamAgent
from autopoly_env.operators import STOP

@dataclass(frozen=True)
class Config:
    n: int = 1
    seed: int = 3

class Mine(Agent):
    name = "mine"
    config_class = Config
    def __init__(self, config):
        self.config = config
    def act(self, simulator, state):
        {act}

class Whole(Mine):
    def solve(self, simulator, budget=None, on_progress=None):
        {solve}
"""

_numbers = itertools.count()


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs `agents.solve` in this process; gives `code`, `out` and `err`."""
    return runner(solve.main, capsys)


@pytest.fixture
def measure(capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs `training.evaluate` in this process."""
    return runner(evaluate.main, capsys)


def module(act: str = "return Decision(STOP)", solve: str = "return None", text: str = "") -> str:
    """Writes a module; returns its name."""
    name = f"brought_{next(_numbers)}"
    Path(f"{name}.py").write_text(text or TEMPLATE.format(act=act, solve=solve))
    return name


def boxes(*names: str) -> list[Path]:
    """Pictures of a box each, which the first rectangle matches: no agent is asked."""
    for name in names:
        picture = Image.new("L", (64, 64))
        picture.paste(255, (8, 8, 40, 56))
        picture.save(name)
    return [Path(name) for name in names]


# --- the one in the documentation


@pytest.mark.slow
def test_documented_agent__solves_from_the_command_line(tmp_path: Path) -> None:
    Path("hasty.py").write_text(HASTY)
    assert len([line for line in HASTY.splitlines() if line.strip()]) <= 25
    command = [sys.executable, "-m", "agents.solve", str(CHAIR), "--agent", "hasty:Hasty", "--option", "n_tries=2"]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([*command, "--json", "--resolution", "64"], env=env, capture_output=True, text=True)
    assert (done.returncode, without_pulses(done.stderr)) == (0, ["Open out/chair/steps.png"])
    record = json.loads(done.stdout)
    assert (record["agent"], record["settings"]["options"]) == ("hasty:Hasty", {"n_tries": 2})
    assert record["r_sm"] > 0.6 and record["actions"] > 0
    assert ConstructionSequence.load(record["files"]["sequence.json"]).settings["agent"] == "hasty:Hasty"


@pytest.mark.slow
def test_documented_check__passes() -> None:
    Path("hasty.py").write_text(HASTY)
    exec(CHECK, {})


@pytest.mark.slow
def test_documented_agent__is_found_by_spawned_workers(measure: Run) -> None:
    Path("hasty.py").write_text(HASTY)
    boxes("images.png")
    suite = "targets: {kind: construction, n: 2, resolution: 64}\nresolution: 32\nbudget: {refits: 10}\nagents:\n"
    suite += "  - {agent: 'hasty:Hasty', label: mine, options: {n_tries: 1}}\n  - {agent: random}\n"
    Path("mine.yaml").write_text(suite)
    done = measure("mine.yaml", "--engine", "process", "--workers", 1, "--quiet", "--json", "--out", "run")
    rows = [json.loads(line) for line in done.out.splitlines()]
    assert done.code == 0 and [row["agent"] for row in rows][1:] == ["mine", "random"]
    assert not any(row["failed"] for row in rows)


# --- ways to name one


def test_option_and_seed__reach_its_config(run: Run) -> None:
    name = module("assert (self.config.n, self.config.seed) == (4, 7), self.config\n        return Decision(STOP)")
    assert run(CHAIR, "--agent", f"{name}:Mine", "--option", "n=4", "--seed", 7, *QUICK).code == 0
    assert run(CHAIR, "--agent", f"{name}:Mine", "--option", "n=4", "--option", "seed=7", *QUICK).code == 0
    done = run(CHAIR, "--agent", f"{name}:Mine", *QUICK, "--json")
    assert done.code == 1 and "Config(n=1, seed=3)" in done.err  # its own defaults


def test_seed__is_what_an_evaluation_draws_for_it(measure: Run) -> None:
    name = module("assert self.config.seed not in (0, 3)\n        return Decision(STOP)")
    boxes("a.png")
    done = measure(CHAIR.parent, "--set", "seeds=[0, 1]", "--agents", f"{name}:Mine", "--budget", "refits=3",
                   "--set", "targets.n=1", "--engine", "serial", "--quiet", "--out", "run")  # fmt: skip
    records = [json.loads(line) for line in Path("run/records.jsonl").read_text().splitlines()]
    assert done.code == 0 and [record["seed"] for record in records] == [0, 1]


def test_function__has_its_parameters_for_options() -> None:
    text = "from agents.baselines.beam import BeamAgent, BeamConfig\n"
    text += "def make(width: int = 2, *, patience=1): return BeamAgent(BeamConfig(width, patience))\n"
    name, game = module(text=text), simulator("house")
    expected = make_agent("beam", width=3, patience=1).solve(game).sequence
    assert make_agent(f"{name}:make", width="3").solve(game).sequence == expected
    assert find_agent(f"{name}:make").options == ("width", "patience")
    with pytest.raises(ConfigError, match=r"make' has no option 'depth'; its options are width, patience$"):
        make_agent(f"{name}:make", depth=1)


@dataclass(frozen=True)
class Wish:
    step: int = 1


class Polite(Agent):
    """Stops at once."""

    def act(self, simulator: Simulator, state: State) -> Decision:
        return Decision(STOP)


class Wishful(Polite):
    config_class = Wish

    def __init__(self, config: Wish) -> None:
        self.step = config.step


def test_make_agent__takes_a_class_with_and_without_options() -> None:
    assert isinstance(make_agent(Polite), Polite)
    wishful, greedy = make_agent(Wishful, step="4"), make_agent(GreedyAgent)
    assert isinstance(wishful, Wishful) and wishful.step == 4
    assert greedy.solve(simulator()).sequence == make_agent("greedy").solve(simulator()).sequence
    assert isinstance(make_agent(f"{__name__}:Wishful"), Wishful)
    with pytest.raises(ConfigError, match=rf"agent '{__name__}:Polite' has no option 'x'; .* are none$"):
        make_agent(Polite, x=1)


def test_seed_of_the_search__may_be_brought(run: Run) -> None:
    name = module("return Decision(STOP)", "return super().solve(simulator, budget, on_progress)")
    few = ("--option", f"seeds=[{name}:Whole]", "--option", "n_simulations=2", "--option", "hop_patience=0")
    assert run(CHAIR, "--agent", "mcts", *few, *QUICK).code == 0
    broken = ("--option", f"seeds=['{module()}:Whole']", *few[2:])
    done = run(CHAIR, "--agent", "mcts", *broken, *QUICK)
    assert done.code == 1 and ":Whole: solve returned None; expected a Solution" in done.err


def test_register_agent__makes_a_name_known_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("agents.registry.AGENTS", dict(AGENTS))
    register_agent("polite", Polite)
    assert isinstance(make_agent("polite"), Polite)
    for name in ("polite", "beam", "my.module:Polite", "polite.yaml"):
        with pytest.raises(ConfigError, match="expected one that is not taken"):
            register_agent(name, Polite)


def test_names__are_those_of_the_registry() -> None:
    assert tuple(AGENTS) == AGENT_NAMES


# --- files of options


@pytest.mark.slow
def test_file__is_the_agent_with_its_options_and_is_recorded_as_that(run: Run) -> None:
    Path("beam.yaml").write_text("width: 2\npatience: 1\n")
    done = run(CHAIR, "--agent", "beam.yaml", "--option", "patience=2", *QUICK, "--json")
    settings = json.loads(done.out)["settings"]
    assert (settings["agent"], settings["options"], settings["seed"]) == ("beam", {"width": 2, "patience": 2}, 0)
    plain = run(CHAIR, "--agent", "beam", "--option", "width=2", "--option", "patience=2", *QUICK, "--out", "plain")
    assert plain.code == 0
    sequences = [ConstructionSequence.load(f"{folder}/chair/sequence.json") for folder in ("out", "plain")]
    assert sequences[0].steps == sequences[1].steps


@pytest.mark.parametrize(
    ("arguments", "seed"), [((), 5), (("--seed", 6), 6), (("--seed", 6, "--option", "seed=7"), 7), (("--seed", 0), 0)]
)
def test_seed_of_a_file__is_its_default_only(run: Run, arguments: tuple[object, ...], seed: int) -> None:
    Path("random.yml").write_text("seed: 5\nn_steps: 2\n")
    settings = json.loads(run(CHAIR, "--agent", "random.yml", *arguments, *QUICK, "--json").out)["settings"]
    assert settings["seed"] == settings["options"].get("seed", seed) == seed


@pytest.mark.slow
def test_file_in_the_repository__is_the_default(run: Run) -> None:
    done = run(CHAIR, "--agent", ROOT / "configs" / "agent" / "trace.yaml", *QUICK, "--json")
    assert json.loads(done.out)["agent"] == "trace"
    assert run(CHAIR, "--agent", "trace", *QUICK, "--out", "plain").code == 0
    sequences = [ConstructionSequence.load(f"{folder}/chair/sequence.json") for folder in ("out", "plain")]
    assert sequences[0].steps == sequences[1].steps


def test_file_in_a_suite__is_told_whole_in_the_run(measure: Run) -> None:
    Path("random.yaml").write_text("n_steps: 2\nseed: 9\n")
    options = ("--set", "targets.n=1", "--set", "seeds=[0, 1]", "--engine", "serial", "--quiet", "--json")
    done = measure(CHAIR.parent, "--agents", "random.yaml", "--budget", "refits=5", *options, "--out", "run")
    assert done.code == 0
    entry = json.loads(Path("run/run.json").read_text())["suite"]["agents"][-1]
    assert (entry["agent"], entry["label"], entry["options"]) == ("random", "random.yaml", {"n_steps": 2})
    assert len(Path("run/records.jsonl").read_text().splitlines()) == 2  # a seed of the suite each


# --- what can be wrong


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nowhere.to_be:found", "there is no module nowhere; run from the folder that it is in, or put that on PYTH"),
        ("{name}:Other", "{name} has no attribute Other"),
        ("{name}:Config", "expected a subclass of agents.base.Agent, or a function that returns an agent"),
        ("{name}:STOP", "expected a subclass of agents.base.Agent, or a function that returns an agent"),
        ("{name}:", "expected a module and a name in it, such as my.module:name"),
        (":Mine", "expected a module and a name in it"),
        ("bean.yaml", "bean.yaml: no agent is called 'bean'; name the file after one of random, greedy"),
        ("beam.yaml", "cannot read beam.yaml"),
    ],
)
def test_agent_that_is_not_there__is_one_line_and_exit_code_2(run: Run, text: str, message: str) -> None:
    name = module()
    done = run(*boxes("a.png"), "--agent", text.format(name=name), *QUICK)
    assert (done.code, done.out, len(done.err.splitlines())) == (2, "", 1)
    assert message.format(name=name) in done.err and not Path("out").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("import agents.base\n1 / 0\n", "cannot import {name}: ZeroDivisionError: division by zero ({name}.py line 2)"),
        ("import json\njson.loads('')\n", "Expecting value: line 1 column 1 (char 0) ({name}.py line 2)"),
        ("import nowhere_else\n", "ModuleNotFoundError: No module named 'nowhere_else' ({name}.py line 1)"),
        ("def f(:\n", "SyntaxError: invalid syntax ({name}.py, line 1)"),
        ("raise SystemExit(3)\n", "SystemExit: 3 ({name}.py line 1)"),
        ("def Mine(): return 7\n", "agent '{name}:Mine': 7 came out of it; expected a subclass of agents.base.Agent"),
        ("def Mine(n): return n\n", "agent '{name}:Mine': its option 'n' has no default; give it one"),
        ("def Mine():\n    return {{}}['x']\n", "agent '{name}:Mine': KeyError: 'x' ({name}.py line 2)"),
        ("from agents.base import Agent\nclass Mine(Agent): pass\n", "TypeError: Can't instantiate abstract"),
        (
            "from agents.baselines.beam import BeamAgent\nclass Mine(BeamAgent): config_class = 3\n",
            "its config_class is 3; expected a dataclass",
        ),
    ],
)  # fmt: skip
def test_agent_that_cannot_be_made__is_one_line_with_its_place(run: Run, text: str, message: str) -> None:
    name = module(text=text.replace("{{}}", "{}"))
    done = run(*boxes("a.png"), "--agent", f"{name}:Mine", *QUICK)
    assert (done.code, done.out, len(done.err.splitlines())) == (2, "", 1)
    assert message.format(name=name) in done.err


BROKEN = {  # the class, what stands in its method, what is said of it
    "act that raises": ("Mine", "x = 1\n        raise ValueError('a\\nb')", "ValueError: a b ({name}.py line 19)"),
    "act that returns none": ("Mine", "return None", "{name}:Mine: act returned None; expected a Decision with an"),
    "act that returns an action": ("Mine", "return STOP", "{name}:Mine: act returned Action("),
    "act that decides for nothing": ("Mine", "return Decision('left')", "act returned Decision(action='left'"),
    "act that is illegal": ("Mine", "return Decision(type(STOP)('edge_extrude', 99))", "IllegalActionError:"),
    "solve that returns none": ("Whole", "return None", "{name}:Whole: solve returned None; expected a Solution"),
    "solve that returns a number": ("Whole", "return 3", "{name}:Whole: solve returned 3; expected a Solution"),
    "solve that exits": ("Whole", "raise SystemExit(0)", "SystemExit: 0 ({name}.py line 23)"),
    "solve that raises": ("Whole", "return simulator.none", "has no attribute 'none' ({name}.py line 23)"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_contract__is_one_line_with_its_module_and_the_others_go_on(run: Run, case: str) -> None:
    kind, body, message = BROKEN[case]
    if kind == "Whole":  # works for small pictures
        body = f"if simulator.silhouette.resolution < 100: return super().solve(simulator)\n        {body}"
    name = module(**{"solve" if kind == "Whole" else "act": body})
    done = run(CHAIR, *boxes("a.png"), "--agent", f"{name}:{kind}", *QUICK)
    assert (done.code, len(done.err.splitlines()), os.listdir("out")) == (1, 1, ["a"])
    assert done.err.startswith(f"error: {CHAIR}: ") and message.format(name=name) in done.err and name in done.err


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["serial", "process"])
def test_broken_contract__is_in_the_record_and_the_other_tasks_go_on(measure: Run, engine: str) -> None:
    name = module("raise ValueError('no idea')")
    suite = "targets: {kind: folder, root: images}\nresolution: 32\nbudget: {refits: 5}\nagents:\n"
    suite += f"  - {{agent: '{name}:Mine', label: mine}}\n  - {{agent: trace}}\n"
    Path("mine.yaml").write_text(suite)
    Path("images").mkdir()
    (Path("images") / "chair.png").write_bytes(CHAIR.read_bytes())
    boxes("images/a.png")
    done = measure("mine.yaml", "--engine", engine, "--workers", 1, "--quiet", "--json", "--out", "run")
    assert done.code == 1 and "1 of 4 tasks failed" in done.err
    records = [json.loads(line) for line in Path("run/records.jsonl").read_text().splitlines()]
    (failed,) = [record for record in records if record["error"]]
    assert (failed["agent"], failed["target"]) == ("mine", "chair")
    assert f"ValueError: no idea ({name}.py line 18), from {name}:Mine; expected a Solution" in failed["error"]
    assert measure(CHAIR.parent, "--agents", f"{name}:Other", "--out", "other").code == 2


def test_exception_in_a_helper__is_told_with_the_line_of_the_agents_module(run: Run) -> None:
    name = module("import json\n        return json.loads('{')")
    done = run(CHAIR, "--agent", f"{name}:Mine", *QUICK)
    assert f"({name}.py line 19), from {name}:Mine" in done.err


def test_our_own_agents__raise_what_they_raise(monkeypatch: pytest.MonkeyPatch) -> None:
    from agents.contract import solved

    def fail(*_: Any) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(BeamAgent, "_search", fail)
    with pytest.raises(ZeroDivisionError):
        solved(make_agent("beam"), simulator())


def test_polite__conforms() -> None:
    check_agent(Polite())
