"""The recipes of examples/rl, as far as they can be looked at without their libraries."""

import ast
import re
import subprocess
import sys

import pytest

from benchmarks import rl_libraries
from benchmarks.rl_libraries import LIBRARIES, RECIPES, Library, main, n_lines
from tests.helpers.paths import ROOT

MOST_LINES = 25
each = pytest.mark.parametrize("library", LIBRARIES.values(), ids=LIBRARIES)


@each
def test_recipe__is_short_and_says_at_its_head_how_to_run_it(library: Library) -> None:
    path = RECIPES / f"{library.recipe}.py"
    head = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    install, run = head.splitlines()[-2:]
    assert install == f"pip install -e . -r examples/rl/requirements/{library.requirements}.txt"
    assert run == f"python -m examples.rl.{library.recipe}"
    assert n_lines(path) <= MOST_LINES


@each
def test_requirements__are_pinned(library: Library) -> None:
    lines = (RECIPES / "requirements" / f"{library.requirements}.txt").read_text(encoding="utf-8").splitlines()
    assert lines and all(re.fullmatch(r"[\w\[\],-]+==[\w.]+( # .*)?", line) for line in lines)


def test_every_recipe__is_run_and_stands_in_the_table() -> None:
    page = (ROOT / "docs" / "rl.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| [^|]+ \| \[(\w+)\.py\]\(.*?\) \| (\d+) \| [\d,]+ \| 0 \|", page, re.MULTILINE))
    recipes = {path.stem for path in RECIPES.glob("*.py")} - {"measuring", "nets"}
    assert recipes == {library.recipe for library in LIBRARIES.values()} == rows.keys()
    assert {name: n_lines(RECIPES / f"{name}.py") for name in recipes} == {name: int(n) for name, n in rows.items()}


def test_lines__are_those_of_python_without_docstrings_and_imports() -> None:
    path = RECIPES / "measuring.py"
    source = path.read_text(encoding="utf-8")
    statements = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.stmt)]
    idle = (ast.Import, ast.ImportFrom)
    docstrings = [s for s in statements if isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant)]
    assert n_lines(path) == sum(not isinstance(statement, idle) for statement in statements) - len(docstrings)


def test_recipe_that_fails__is_told_in_its_row(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> str:
        raise subprocess.CalledProcessError(1, "pip", stderr="noise\nERROR: no such version\n")

    monkeypatch.setattr(rl_libraries, "run", fail)
    monkeypatch.setattr(rl_libraries.venv, "create", lambda *_, **__: None)
    assert main(["skrl"]) == 1
    assert "| skrl ? |" in (told := capsys.readouterr().out) and "ERROR: no such version" in told


def test_name_of_no_library__is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["keras"])
    assert ended.value.code == 2 and "'keras' is unknown; give some of sb3-contrib, sb3," in capsys.readouterr().err


@pytest.mark.slow
def test_watch__counts_every_step_and_those_that_were_illegal() -> None:
    code = (
        "import sys, types; from benchmarks import rl_watch\n"
        "import gymnasium\n"
        "def recipe(name, run_name):\n"
        "    envs = gymnasium.make_vec('autopoly_env:AutoPoly-v0', num_envs=2, resolution=16, obs_resolution=16)\n"
        "    envs.reset(seed=0)\n"
        "    for action in (0, 1, envs.single_action_space.n - 1):\n"
        "        envs.step([action, envs.single_action_space.n - 1])\n"
        "rl_watch.runpy.run_module = recipe\n"
        "rl_watch.main('recipe', 'gymnasium')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert '"steps": 5, "illegal": 4' in done.stdout  # one was a reset after STOP
