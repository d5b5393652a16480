"""What is measured: the probes, what they are given, and the rows that come of their numbers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Settings = Mapping[str, Any]
RATIO, DIFFERENCE = "ratio", "difference"  # of this revision and the other one
_TRAINING = ("run.total_steps=10240", "run.n_eval=2", "run.eval_every=100000", "run.minutes=0")


@dataclass(frozen=True)
class Row:
    """A number of a probe, and how two revisions' are compared."""

    key: str  # in what the probe answers
    label: str
    unit: str
    by: str = RATIO


@dataclass(frozen=True)
class Given:
    """What all probes may need."""

    images: tuple[str, ...]
    small: str  # an image of 256 x 256
    states: str  # a file for meshes to be refitted


@dataclass(frozen=True)
class Group:
    """A probe with its settings; those of the other revision and of this one may differ."""

    probe: str
    settings: Callable[[Given], tuple[Settings, Settings]]
    rows: tuple[Row, ...]
    rounds: int  # unless told otherwise; 0: as many as there are images
    afresh: bool = False  # each measurement in a process of its own
    needs_states: bool = False  # the file of meshes, written beforehand


def _same(**settings: Any) -> Callable[[Given], tuple[Settings, Settings]]:
    return lambda given: (settings, settings)


def _with_images(**settings: Any) -> Callable[[Given], tuple[Settings, Settings]]:
    return lambda given: ({**settings, "images": given.images},) * 2


def _command(*words: str, warm: bool = True) -> Callable[[Given], tuple[Settings, Settings]]:
    def settings(given: Given) -> tuple[Settings, Settings]:
        line = [given.small if word == "SMALL" else word for word in words]
        return ({"words": line, "warm": warm},) * 2

    return settings


def _solving(agent: str, refits: int | None) -> Callable[[Given], tuple[Settings, Settings]]:
    return _with_images(agent=agent, refits=refits, seconds=None, w_sc=0.3)


def _hurried(w_sc: float) -> Callable[[Given], tuple[Settings, Settings]]:
    """The other revision has 5 seconds a shape, this one 1.5."""

    def settings(given: Given) -> tuple[Settings, Settings]:
        common = {"agent": "mcts", "refits": None, "w_sc": w_sc, "images": given.images}
        return {**common, "seconds": 5.0}, {**common, "seconds": 1.5}

    return settings


def _solve_rows(name: str) -> tuple[Row, ...]:
    return (
        Row("wall", f"{name}, two threads: seconds a shape", "s"),
        Row("cpu", f"{name}: CPU-seconds a shape", "s"),
        Row("r_all", f"{name}: r_all", "", DIFFERENCE),
    )


_GROWTH = tuple(
    Row(f"{what} {n}", f"refit of {label.format(n)}", "µs")
    for what, label, numbers in (
        ("vertices", "{} vertices at 128 x 128", (8, 16, 32, 64)),
        ("side", "16 vertices at {0} x {0}", (64, 128, 256, 512)),
    )
    for n in numbers
)

GROUPS: dict[str, Group] = {
    "env": Group(
        "play",
        _same(),
        (
            Row("steps", "one env at 64 x 64: steps a CPU-second", "/s"),
            Row("outside", "share of a step that is in no kernel", ""),
        ),
        15,
    ),
    "vector": Group(
        "vector",
        _same(),
        (
            Row("native", "native vector env, 16 envs, two threads: steps a second", "/s"),
            Row("gain", "the same against one env", "x"),
            Row("workers", "the same in two workers: steps a second", "/s"),
            Row("workers gain", "the same against one env", "x"),
        ),
        9,
    ),
    "reset": Group(
        "reset",
        _same(),
        (
            Row("new", "resets a CPU-second, targets not seen before", "/s"),
            Row("known", "resets a CPU-second, targets seen before", "/s"),
        ),
        9,
    ),
    "refit": Group(
        "refits",
        lambda given: ({"states": given.states},) * 2,
        (
            Row("rate", "refits of a search's states a CPU-second", "/s"),
            Row("loss", "mean loss where they end", "", RATIO),
        ),
        12,
        needs_states=True,
    ),
    "growth": Group("growth", _same(), _GROWTH, 7),
    "greedy": Group("solves", _solving("greedy", None), _solve_rows("greedy"), 0),
    "solve": Group("solves", _solving("mcts", 1500), _solve_rows("mcts, 1,500 refits"), 0),
    "hurried": Group(
        "solves", _hurried(0.3), (Row("r_all", "mcts, r_all after 5 s there, 1.5 s here, w_sc 0.3", "", DIFFERENCE),), 0
    ),
    "hurried-1": Group(
        "solves", _hurried(1.0), (Row("r_all", "mcts, r_all after 5 s there, 1.5 s here, w_sc 1", "", DIFFERENCE),), 0
    ),
    "outside": Group(
        "outside", _with_images(), (Row("share", "share of an mcts solve outside the refits' kernel", ""),), 4
    ),
    "suite": Group(
        "commands",
        _command("-m", "training.evaluate", "paper", "--set", "targets.n=6", "--workers", "2", "--out", "OUT"),
        (
            Row("wall", "training.evaluate paper, 6 targets, all rows, two workers: seconds", "s"),
            Row("cpu", "the same: CPU-seconds", "s"),
        ),
        3,
    ),
    "training": Group(
        "commands",
        _command(
            "-m",
            "training.train_rl",
            "--config",
            "configs/train/maskable_ppo.yaml",
            *_TRAINING,
            "--out",
            "OUT",
            warm=False,
        ),
        (Row("steps", "training with MaskablePPO: steps a second", "/s"),),
        3,
    ),
    "start": Group(
        "commands",
        _command("-m", "agents.solve", "SMALL", "--agent", "trace", "--quiet", "--out", "OUT"),
        (
            Row("cpu", "agents.solve of a 256 x 256 image with trace: CPU-seconds", "s"),
            Row("wall", "the same: seconds", "s"),
        ),
        11,
    ),
    "import": Group("commands", _command("-c", "import autopoly_env"), (Row("cpu", "import: CPU-seconds", "s"),), 11),
    "memory": Group(
        "memory", _with_images(what="solve"), (Row("peak", "memory, most of an mcts solve", "MB"),), 5, afresh=True
    ),
    "memory-envs": Group(
        "memory", _with_images(what="envs"), (Row("peak", "memory, most of 16 native envs", "MB"),), 5, afresh=True
    ),
}


def draw_small(path: Path) -> str:
    """Write the small image, a ring with a foot, and return its path."""
    import numpy as np
    from PIL import Image

    y, x = np.mgrid[:256, :256]
    far = np.hypot(x - 128, y - 104)
    shape = ((far < 90) & (far > 40)) | ((abs(x - 128) < 30 + 0.2 * (y - 180)) & (y > 180) & (y < 240))
    Image.fromarray(np.where(shape, 0, 255).astype(np.uint8)).save(path)
    return str(path)


def names_of(given: Sequence[str] | None) -> list[str]:
    """The groups asked for, in their own order; all without a wish."""
    return [name for name in GROUPS if given is None or name in given]
