"""The doors through which inputs come in, each tried with odd ones: a trial raises AutoPolyError or nothing at all."""

import contextlib
import io
import json
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from agents import export, solve, vary
from agents.budget import Budget
from agents.commands.wishes import read_wishes
from agents.options import put_override
from agents.registry import make_agent
from autopoly_env.arguments import number, one_of, whole
from autopoly_env.env import AutoPolyEnv
from autopoly_env.errors import AutoPolyError, SequenceError
from autopoly_env.export import to_html, to_obj
from autopoly_env.export.blender import blender_script
from autopoly_env.export.svg import sequence_to_svg
from autopoly_env.operators import preset
from autopoly_env.score import ScoreWeights
from autopoly_env.sequence import ConstructionSequence, Lesson
from autopoly_env.sequence.variation import weights_of
from autopoly_env.silhouette import Silhouette, load_silhouette
from autopoly_env.simulator import Simulator
from autopoly_env.targets import ConstructionTargets, make_targets
from benchmarks.fuzz.odd import Rng, as_json, damaged, mutated, odd_value, yaml_text
from training.evaluation import find_suite
from training.evaluation.run import TargetShard
from training.evaluation.suite import FOLDER, with_budget
from training.options import build_config, plain, read_config
from training.policies.config import TrainRlConfig

EXPORTED = 0.1  # share of the accepted sequences that are exported, too
LARGE = 40  # pixels a side of an array
_BOX = Silhouette(np.pad(np.ones((8, 8), np.bool_), 4), "box")
_AGENTS = {"random": ("n_steps", "seed"), "beam": ("width", "patience", "stuck_discount", "merge_grid"),
           "mcts": ("n_simulations", "exploration", "widening", "seeds", "seed", "prior", "n_refits", "tree_share"),
           "climb": ("n_rounds",), "dr-simple": ("refit",), "oracle": ("width", "depth")}  # fmt: skip


@cache
def _documents() -> tuple[Any, ...]:
    """Right sequences, as JSON has them."""
    source = ConstructionTargets((1, 6), "full", 64)
    return tuple(json.loads(source.sample_sequence(seed).to_json()) for seed in range(24))


def sequence(rng: Rng) -> None:
    """A sequence file; one that is accepted has to round-trip, and can be exported."""
    text = as_json(mutated(rng, _documents()[rng.integers(24)]))
    if rng.random() < 0.2:
        text = damaged(rng, text)
    found = ConstructionSequence.from_json(text)
    again = found.to_json()
    if ConstructionSequence.from_json(again).to_json() != again:
        raise AssertionError("a sequence does not round-trip")
    if rng.random() < EXPORTED:
        weights_of(found.settings)
        for write in (to_html, sequence_to_svg, blender_script, Lesson.of, lambda one: to_obj(one.final())):
            with contextlib.suppress(SequenceError):
                write(found)
        found.diff(found.trim(0))


def array(rng: Rng) -> None:
    """An array, of any shape and type, as a picture."""
    shape = tuple(int(n) for n in rng.integers(0, LARGE, int(rng.integers(0, 5))))
    if rng.random() < 0.7:
        shape = (
            *(int(n) for n in rng.integers(1, LARGE, 2)),
            *((int(rng.integers(1, 6)),) if rng.random() < 0.5 else ()),
        )
    kind = rng.choice(("?", "u1", "u2", "i4", "i8", "f2", "f4", "f8", "c8", "U3", "O", "M8[s]"))
    with np.errstate(all="ignore"):
        values: Any = rng.choice((0.0, 1.0, 0.5, 255.0, -1.0, 1e300, np.nan, np.inf), shape).astype(np.float64)
        values = np.nan_to_num(values).astype(kind) if kind not in ("f2", "f4", "f8") else values.astype(kind)
    load_silhouette(values)


def option(rng: Rng) -> None:
    """A value for an option of an agent, a budget, a run, a command, as text or as it is."""
    value = odd_value(rng)
    text = value if isinstance(value, str) else str(value)[:6000] if not isinstance(value, int) else hex(value)
    match int(rng.integers(10)):
        case 0:
            name = list(_AGENTS)[rng.integers(len(_AGENTS))]
            make_agent(name, **{str(rng.choice(_AGENTS[name])): value})
        case 1:
            key = str(rng.choice(("refits", "seconds", "simulations")))
            build_config(Budget, {key: value}, "--budget")
        case 2:
            settings: dict[str, Any] = {}
            put_override(settings, f"{rng.choice(('a', 'a.b', '', 'a..b'))}={text}", "--set", "a=1")
        case 3:
            read_wishes(None, None, text, None)
        case 4:
            read_wishes(None, None, None, text)
        case 5:
            TargetShard.parse(f"{text}/{odd_value(rng)}"[:9000])
        case 6:
            preset(text)
        case 7:
            make_targets(text)
        case 8:
            key = str(
                rng.choice(("run.seed", "run.minutes", "run.n_threads", "optim.lr", "env.max_steps", "env.courses"))
            )
            plain(read_config(None, [f"{key}={text}"], TrainRlConfig()))
        case _:
            whole("n", value), number("x", value), one_of("mode", value, ("a", "b")), _BOX.target(value)


def environment(rng: Rng) -> None:
    """An argument of the environment."""
    known = ("w_sm", "w_sc", "w_si", "resolution", "max_steps", "match_threshold", "operators", "reward_mode", "split")
    key = str(rng.choice((*known, "targets", "max_vertices", "obs_resolution", "render_size", "illegal_penalty")))
    AutoPolyEnv(**{key: odd_value(rng)})


def yaml(rng: Rng) -> None:
    """A suite in YAML: one of ours with odd values in it, one damaged, or YAML at random."""
    suites = sorted(FOLDER.glob("*.yaml"))
    text = suites[rng.integers(len(suites))].read_text(encoding="utf-8")
    if rng.random() < 0.5:
        text = yaml_text(rng)
    elif rng.random() < 0.5:
        text = damaged(rng, text)
    overrides = []
    if rng.random() < 0.5:
        key = rng.choice(
            ("weights.w_sc", "seeds", "agents", "targets.n", "targets.root", "budget.refits", "notes", "name")
        )
        overrides = [f"{key}={str(odd_value(rng))[:3000]}"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "odd.yaml"
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        suite = find_suite(str(path), overrides)
        plain(suite)
        with_budget(suite, f"refits={odd_value(rng)}"[:3000])


def command(rng: Rng) -> None:
    """A command line that cannot do any work; what it prints is one line."""
    mains: tuple[tuple[Callable[[list[str]], int], tuple[str, ...]], ...] = (
        (export.main, ("--to", "--out", "--step", "--depth", "--operators")),
        (solve.main, ("--agent", "--option", "--lock", "--symmetry", "--w-sc", "--seed", "--operators", "--refits")),
        (vary.main, ("--n", "--amount", "--seed", "--operators")),
    )
    main, options = mains[rng.integers(len(mains))]
    words = [str(odd_value(rng))[:6000].replace("\0", "") for _ in range(2)]
    arguments = ["/nowhere/" + words[0], str(rng.choice(options)), words[1]]
    if rng.random() < 0.2:
        arguments = words
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(arguments)
    said = (out.getvalue() + err.getvalue()).rstrip("\n").split("\n")
    if code:
        raise SaidError(max(said, key=lambda line: (not line.isprintable(), len(line))))


class SaidError(AutoPolyError):
    """What a command has said, with nothing escaped by the error itself."""

    def __str__(self) -> str:
        return str(self.args[0]).removeprefix("error: ")


def simulator(rng: Rng) -> None:
    """Arguments of the simulator and of the weights, as they are."""
    key = str(rng.choice(("resolution", "max_steps", "match_threshold", "operators", "locked", "symmetry", "start")))
    if rng.random() < 0.3:
        ScoreWeights(**{str(rng.choice(("w_sm", "w_sc", "w_si"))): odd_value(rng)})
    Simulator(_BOX, **{key: odd_value(rng)})


# What is tried, and how many of 500 inputs it has: the quick ones many, the slow ones few.
DOORS: dict[str, tuple[Callable[[Rng], None], int]] = {
    "sequence": (sequence, 140),
    "array": (array, 60),
    "option": (option, 146),
    "simulator": (simulator, 140),
    "environment": (environment, 5),
    "yaml": (yaml, 8),
    "command": (command, 1),
}
