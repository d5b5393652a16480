"""Installs every library of examples/rl, runs its recipe, counts illegal actions: `python -m benchmarks.rl_libraries`.

    python -m benchmarks.rl_libraries               # all, one after the other; prints the table of docs/rl.md
    python -m benchmarks.rl_libraries skrl rllib    # some

Each has an environment of its own with what its file in examples/rl/requirements asks for, which is removed afterwards:
together they are gigabytes. `uv` installs them where it is on the path, else pip. Exit codes: 0 every recipe has run
without an illegal action, 1 one has not, 2 wrong usage.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tokenize
import venv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
RECIPES = ROOT / "examples" / "rl"
MOST_SECONDS = 1800.0  # of an installation, and of a recipe
NOT_RUN = "| d3rlpy 2.8.1 | not run: it asks for gymnasium 1.0.0, the environment for 1.2 | | | | |"
HEAD = "| library | recipe | lines | steps | illegal | r_all before, after |\n|---|---|---|---|---|---|"


@dataclass(frozen=True)
class Library:
    """A library, its recipe and what to install for it."""

    recipe: str  # of examples/rl
    requirements: str  # of examples/rl/requirements
    distributions: tuple[str, ...]  # whose versions are told


LIBRARIES = {
    "sb3-contrib": Library("sb3_contrib_maskable_ppo", "sb3", ("sb3-contrib",)),
    "sb3": Library("sb3_ppo", "sb3", ("stable-baselines3",)),
    "agilerl": Library("agilerl_ppo", "agilerl", ("agilerl",)),
    "tianshou": Library("tianshou_dqn", "tianshou", ("tianshou",)),
    "rllib": Library("rllib_ppo", "rllib", ("ray",)),
    "torchrl": Library("torchrl_ppo", "torchrl", ("torchrl",)),
    "skrl": Library("skrl_ppo", "skrl", ("skrl",)),
    "cleanrl": Library("cleanrl_a2c", "cleanrl", ("gymnasium",)),
    "minari": Library("minari_cloning", "minari", ("minari",)),
    "mujax": Library("mujax_gmz", "mujax", ("mujax",)),
}
TITLES = {
    "rllib": "RLlib",
    "sb3": "Stable-Baselines3",
    "torchrl": "TorchRL",
    "agilerl": "AgileRL",
    "tianshou": "Tianshou",
    "minari": "Minari",
    "cleanrl": "one file, Gymnasium's `NumpyToTorch`",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the recipes asked for, print the table; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rl_libraries", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"some of {', '.join(LIBRARIES)}")
    names: list[str] = parser.parse_args(arguments).names or list(LIBRARIES)
    unknown = [name for name in names if name not in LIBRARIES]
    if unknown:
        parser.error(f"{unknown[0]!r} is unknown; give some of {', '.join(LIBRARIES)}")
    print(HEAD, flush=True)
    all_well = True
    for name in names:
        row, is_well = tried(name)
        all_well &= is_well
        print(row, flush=True)
    if names == list(LIBRARIES):
        print(NOT_RUN)
    return 0 if all_well else 1


def tried(name: str) -> tuple[str, bool]:
    """The row of a library, and whether its recipe ran without an illegal action."""
    library = LIBRARIES[name]
    path = RECIPES / f"{library.recipe}.py"
    start = f"| {TITLES.get(name, name)} {{}} | [{path.name}](../examples/rl/{path.name}) | {n_lines(path)} |"
    with tempfile.TemporaryDirectory() as folder:
        try:
            python = installed(Path(folder) / "venv", RECIPES / "requirements" / f"{library.requirements}.txt")
            watch = [str(python), "-m", "benchmarks.rl_watch", f"examples.rl.{library.recipe}", *library.distributions]
            told = run(watch, {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "HOME": folder}).splitlines()
            counts = json.loads([line for line in told if line.startswith("{")][-1])
        except (subprocess.SubprocessError, ValueError, IndexError, OSError) as error:
            problem = getattr(error, "stderr", None) or str(error)
            return f"{start.format('?')} {str(problem).strip().splitlines()[-1][:160]} | | |", False
    worth = [line.rpartition(" ")[2] for line in told if line.startswith("r_all ")]
    version = " ".join(counts["versions"].values())
    row = f"{start.format(version)} {counts['steps']:,} | {counts['illegal']} | {', '.join(worth)} |"
    return row, counts["illegal"] == 0 and len(worth) == 2


def installed(folder: Path, requirements: Path) -> Path:
    """The Python of a new environment with what a file asks for, and this checkout's own needs."""
    uv = shutil.which("uv")
    venv.create(folder, with_pip=uv is None)
    python = folder / "bin" / "python"
    command = [uv, "pip", "install", "--python", str(python)] if uv else [str(python), "-m", "pip", "install"]
    run([*command, "--quiet", "-e", str(ROOT), "-r", str(requirements)], {})
    return python


def run(command: Sequence[str], environment: dict[str, str]) -> str:
    """What a command prints. Raises CalledProcessError where it fails, TimeoutExpired where it does not end."""
    done = subprocess.run(
        command,
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=MOST_SECONDS,
        check=True,
    )
    return done.stdout


def n_lines(path: Path) -> int:
    """Lines of a recipe, as Python counts them: a call over several is one; docstrings and imports are none."""
    with path.open("rb") as file:
        lines = [token.line.strip() for token in tokenize.tokenize(file.readline) if token.type == tokenize.NEWLINE]
    return sum(not line.startswith(("import ", "from ")) and not line.endswith('"""') for line in lines)


if __name__ == "__main__":
    sys.exit(main())
