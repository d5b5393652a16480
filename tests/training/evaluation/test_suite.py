"""Suites: what their files may say, which targets they name, and the seeds they give."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from agents.budget import Budget, Progress
from agents.registry import AGENTS
from autopoly_env.errors import ConfigError
from autopoly_env.score import ScoreWeights
from training.evaluation.suite import FOLDER, GROUND_TRUTH, Printed, chosen, find_suite, task_seed, with_budget
from training.evaluation.tasks import Curve, EvalTask, solve_task
from training.options import plain

SUITES = sorted(path.stem for path in FOLDER.glob("*.yaml"))
MINIMAL = "targets: {kind: construction, n: 2}\nagents: [{agent: trace}]\n"
PRINTED = MINIMAL.replace("}]", ", printed: {r_sm: NUMBER, r_sc: 1, r_si: 0, r_all: 3}}]")


def written(folder: Path, text: str) -> str:
    path = folder / "mine.yaml"
    path.write_text(text)
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize("name", SUITES)
def test_shipped_suite__can_be_read_and_names_agents_that_there_are(name: str) -> None:
    suite = find_suite(name)
    assert suite.name == name
    suite.check()
    missing = suite.missing()
    assert all(entry.agent in AGENTS or entry.label in missing for entry in suite.agents)
    assert (FOLDER / f"{name}.yaml").read_text().startswith("# python -m training.evaluate ")


def test_paper_suite__is_the_papers_test(tmp_path: Path) -> None:
    suite = find_suite("paper")
    assert suite.weights == ScoreWeights(100.0, 1.0, 5.0)
    assert len(suite.targets.targets()) == 50
    assert suite.entry("w/o shape complexity").weights == {"w_sc": 0.0}
    assert suite.entry("w/o self-intersection").weights == {"w_si": 0.0}
    assert suite.entry("mcts_paper").operators == "paper"


def test_printed_rows__add_up_but_for_two() -> None:
    suite = find_suite("paper")
    off = {
        entry.label: round(entry.printed.sum(suite.weights), 1)
        for entry in suite.agents
        if entry.printed and abs(entry.printed.sum(suite.weights) - entry.printed.r_all) > 0.1
    }
    assert off == {"DR simple": 64.2, "DR complex": 17.8}
    assert Printed(0.964, 12.1, 0.7, 80.8).sum(suite.weights) == pytest.approx(80.8)


def test_suite__read_back_from_its_plain_values_is_the_same(tmp_path: Path) -> None:
    suite = find_suite("paper")
    (tmp_path / "again.yaml").write_text(json.dumps(plain(suite)))  # JSON is YAML
    assert find_suite(str(tmp_path / "again.yaml")) == suite


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "holds a NoneType"),
        ("- 1", "holds a list"),
        ("targets: [", "not YAML"),
        ("agents: [{agent: trace}]", "targets: Field required"),
        ("targets: {kind: construction}", "agents: Field required"),
        (MINIMAL + "colour: red", "colour: Unexpected keyword argument"),
        (MINIMAL.replace("n: 2", "n: 2, size: 3"), "targets.construction.size: Unexpected keyword argument"),
        (MINIMAL.replace("construction", "clouds"), "does not match any of the expected tags"),
        (MINIMAL + "weights: {w_x: 1}", "weights.w_x: Unexpected keyword argument"),
        (MINIMAL + "weights: {w_sc: -1}", "w_sc = -1.0: expected a finite weight of at least 0"),
        (
            PRINTED.replace("NUMBER", ".nan"),
            "agents.0.printed.r_sm: expected a finite number of at most 64 bits, got nan",
        ),
        (
            PRINTED.replace("NUMBER", "1.0e+300"),
            "agents.0.printed.r_sm: expected a finite number of at most 64 bits, got 1e+300",
        ),
        (MINIMAL + "budget: {refits: many}", "budget.refits: Input should be a valid integer"),
        (MINIMAL + "budget: {refits: -1}", "a budget of -1 refits"),
        (MINIMAL + "seeds: []", "seeds (): expected at least one"),
        (MINIMAL + "seeds: [1, 1]", "seeds (1, 1): expected at least one, no two alike"),
        (MINIMAL + "baseline: nobody", "baseline 'nobody' is no label of the suite"),
        (MINIMAL.replace("{agent: trace}", ""), "expected at least one, each with a label of its own"),
        (MINIMAL.replace("}]", "}, {agent: trace}]"), "expected at least one, each with a label of its own"),
        (MINIMAL.replace("agent: trace", "agent: trace, label: ground truth"), "each with a label of its own"),
        (MINIMAL.replace("agent: trace", "agent: trace, wights: {}"), "agents.0.wights: Unexpected keyword argument"),
    ],
)
def test_broken_suite__is_refused_in_one_line_that_names_the_file(tmp_path: Path, text: str, message: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        find_suite(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("agent: nobody", "agent 'nobody' is unknown"),
        ("agent: random, options: {legs: 4}", "agent 'random' has no option 'legs'"),
        ("agent: random, operators: sawing", "sawing"),
    ],
)
def test_check__refuses_agents_that_cannot_be_made(tmp_path: Path, entry: str, message: str) -> None:
    suite = find_suite(written(tmp_path, MINIMAL.replace("agent: trace", entry)))
    with pytest.raises(ConfigError, match=message):
        suite.check()


def test_missing__lists_what_may_be_missing_and_is(tmp_path: Path) -> None:
    text = MINIMAL.replace("}]", "}, {agent: nobody, label: x, missing: no weights yet}]")
    suite = find_suite(written(tmp_path, text.replace("agent: trace", "agent: trace, missing: gone")))
    suite.check()
    assert suite.missing() == {"x": "no weights yet"}


def test_override__replaces_a_key_of_a_section() -> None:
    suite = find_suite("paper", ["targets.n=3", "targets.difficulty=[2, 2]", "weights.w_sc=1e-1", "seeds=[0, 1]"])
    assert len(suite.targets.targets()) == 3
    assert suite.weights.w_sc == 0.1
    assert suite.seeds == (0, 1)
    for bad in ("n", "=3", "targets.n", "seeds.x=1", "targets.n=[", "name.first=x"):
        with pytest.raises(ConfigError):
            find_suite("paper", [bad])


def test_budget__replaces_all_budgets(tmp_path: Path) -> None:
    suite = find_suite(written(tmp_path, MINIMAL.replace("agent: trace", "agent: trace, budget: {refits: 9}")))
    assert suite.agents[0].budget == Budget(9)
    suite = with_budget(suite, "refits=5,seconds=0.5")
    assert (suite.budget, suite.agents[0].budget) == (Budget(5, 0.5), None)
    for bad in ("", "5", "refits", "hours=1", "refits=few", "refits=-1"):
        with pytest.raises(ConfigError):
            with_budget(suite, bad)


def test_chosen__knows_labels_and_agents_and_takes_in_others() -> None:
    suite = find_suite("paper")
    assert chosen(suite, ["mcts"])[1] == {"w/o shape complexity", "w/o self-intersection", "AutoPoly w/o learning"}
    assert chosen(suite, ["DR simple", "climb", GROUND_TRUTH])[1] == {"DR simple", "climb", GROUND_TRUTH}
    wider, labels = chosen(suite, ["decimate"])
    assert (labels, wider.agents[-1].agent, len(wider.agents)) == ({"decimate"}, "decimate", len(suite.agents) + 1)
    with pytest.raises(ConfigError, match="agent 'nobody' is unknown"):
        chosen(suite, ["nobody"])


def test_folder__gives_every_image_a_name_of_its_own(tmp_path: Path) -> None:
    for name in ("a/leaf.png", "b/leaf.png", "b/Leaf.png", "a/leaf-2.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        Image.new("L", (4, 4), 255).save(tmp_path / name)
    targets = find_suite(str(tmp_path / "**" / "*.png")).targets.targets()
    assert sorted(target.name for target in targets) == ["Leaf-3", "leaf", "leaf-2", "leaf-4"]
    assert len({target.name.casefold() for target in targets}) == 4
    suite = find_suite(str(tmp_path / "a"))
    assert (suite.name, [target.name for target in suite.targets.targets()]) == ("a", ["leaf-2", "leaf"])


def test_task_seed__hangs_on_the_seed_and_the_target_only() -> None:
    seeds = {task_seed(seed, target) for seed in (0, 1) for target in ("a", "b", "c")}
    assert len(seeds) == 6
    assert task_seed(0, "a") == task_seed(0, "a") == SEED_OF_A
    assert all(0 <= seed < 2**32 for seed in seeds)


SEED_OF_A = 912898483  # the same on every machine


def test_ground_truth__renders_exactly_and_pays_for_its_complexity() -> None:
    suite = find_suite("paper", ["targets.n=3"])
    for target in suite.targets.targets():
        outcome = solve_task(suite, EvalTask(GROUND_TRUTH, target, 0)).record.outcome
        assert outcome is not None
        assert outcome.r_sm == 1.0
        assert outcome.r_all == 100.0 - outcome.r_sc
        assert (outcome.V + outcome.E + outcome.F, outcome.n_refits) == (outcome.r_sc, 0)
        assert outcome.n_actions >= 1


def test_curve__keeps_improvements_and_at_most_sixty() -> None:
    curve = Curve()
    totals = [float("-inf"), 1.0, 1.0, 0.5, *np.arange(2.0, 200.0)]
    for k, total in enumerate(totals):
        curve(Progress(total, k, 10 * k))
    points = curve.points()
    assert len(points) == 60
    assert (points[0][0], points[0][2], points[-1][2]) == (10, 1.0, 199.0)
    assert all(a[0] < b[0] and a[1] <= b[1] and a[2] < b[2] for a, b in pairwise(points))
    assert Curve().points() == []


def test_folder__takes_the_options_that_say_what_is_the_object(tmp_path: Path) -> None:
    picture = Image.new("L", (32, 32), 255)
    picture.paste(0, (8, 8, 24, 24))
    picture.save(tmp_path / "box.png")
    for given, area in (([], 256), (["targets.picture.object=light"], 32 * 32 - 256)):
        [target] = find_suite(str(tmp_path), given).targets.targets()
        assert target.load().mask.sum() == area
    with pytest.raises(ConfigError, match="reddish"):
        find_suite(str(tmp_path), ["targets.picture.object=reddish"])
