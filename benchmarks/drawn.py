"""Procedural objects for the benchmarks of variations and retargeting, and constructions of them that are kept."""

from collections.abc import Callable
from pathlib import Path

from agents.budget import Budget
from agents.registry import make_agent
from autopoly_env.files import write_atomically
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from autopoly_env.targets import ObjectTargets, split_seed
from autopoly_env.targets.families import FAMILIES


def pair(index: int) -> tuple[Silhouette, Silhouette]:
    """Two objects of one family; the families take turns."""
    source = ObjectTargets(list(FAMILIES)[index % len(FAMILIES)])
    return source.sample(split_seed("test", 2 * index)), source.sample(split_seed("test", 2 * index + 1))


def climbed(silhouette: Silhouette, keep: Path | None) -> ConstructionSequence:
    """What `climb` makes of it; from the folder `keep`, if it is there already."""
    return _kept(keep, silhouette.name, lambda: make_agent("climb").solve(Simulator(silhouette)).sequence)


def modelled(silhouette: Silhouette, keep: Path | None) -> ConstructionSequence:
    """The same in the modeller's style, regular and, where the picture is, symmetric."""
    simulator = Simulator(silhouette, operators="modeller", faces="quads", symmetry="auto", align=True)
    return _kept(
        keep, f"{silhouette.name}.modelled", lambda: make_agent("quads").solve(simulator, Budget(refits=600)).sequence
    )


def _kept(keep: Path | None, name: str, build: Callable[[], ConstructionSequence]) -> ConstructionSequence:
    path = None if keep is None else keep / f"{name}.json"
    if path is not None and path.is_file():
        return ConstructionSequence.load(path)
    sequence = build()
    if path is not None:
        write_atomically(path, sequence.to_json())
    return sequence
