"""Every command with a small but real job of its own, one after another: what `silence` and `interrupts` run."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"


@dataclass(frozen=True)
class SmallJob:
    """A command, in words of its command line; what it reads was written by those before it."""

    name: str
    words: tuple[str, ...]
    compiles: bool = False  # with an empty cache of kernels


def small_jobs(folder: Path, earlier: Path | None = None) -> Iterator[SmallJob]:
    """All of them, in an order that they can be run in; they write into the folder, and read what `earlier` has."""
    earlier = earlier or folder

    def job(module: str, *words: object, name: str = "", compiles: bool = False) -> SmallJob:
        line = (sys.executable, "-m", module, *map(str, words))
        return SmallJob(name or module, line, compiles)

    mug, chair = EXAMPLES / "mug.png", EXAMPLES / "chair.png"
    sequence = earlier / "solved" / "mug" / "sequence.json"
    shards = (f"data.shards={earlier / 'expert'}", f"data.held_out={earlier / 'held_out'}")
    data = (*shards, "data.n_held_out=64", "optim.n_steps=60")
    quick = ("run.eval_every=30", "run.save_every=20")
    yield job("autopoly_env.warm", compiles=True)
    yield job("agents.solve", mug, chair, "--out", folder / "solved")
    yield job("agents.solve", EXAMPLES, "--seconds", 12, "--out", folder / "long", name="agents.solve --seconds 12")
    networks = (mug, "--agent", "nfap-mcts", "--refits", 16, "--out", folder / "networks")
    yield job("agents.solve", *networks, name="agents.solve --agent nfap-mcts")
    yield job("agents.vary", sequence, "--n", 40, "--out", folder / "varied")
    yield job("agents.retarget", sequence, EXAMPLES / "teapot.png", "--refits", 600, "--out", folder / "told")
    yield job("agents.export", sequence, "--to", "gif", "--out", folder / "mug.gif")
    evaluated = ("paper", "--set", "targets.n=6", "--agents", "mcts,trace,greedy", "--out")
    yield job("training.evaluate", *evaluated, folder / "run")
    serially = (*evaluated, folder / "serial", "--engine", "serial")
    yield job("training.evaluate", *serially, name="training.evaluate --engine serial")
    yield job("training.compare", earlier / "run", "--out", folder / "report.html")
    yield job("training.make_dataset", "constructions", "--n", 2000, "--out", folder / "data")
    yield job("training.make_expert", folder / "expert", "--n", 64)
    yield job(
        "training.make_expert", folder / "held_out", "--n", 64, "--held-out", name="training.make_expert --held-out"
    )
    yield job("training.train_nfap", *data, *quick, "--out", folder / "nfap")
    yield job("training.train_warpnet", *data, *quick, "--out", folder / "warpnet")
    yield job("training.rl_clone", *data, *quick, "n_exam=8", "--out", folder / "clone")
    yield job("training.train_rl", "--minutes", 0.5, "--out", folder / "rl")
    yield job("training.describe_networks")
