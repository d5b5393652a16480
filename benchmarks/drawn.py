"""Procedural objects for the benchmarks of variations and retargeting, and constructions of them that are kept."""

from pathlib import Path

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
    path = None if keep is None else keep / f"{silhouette.name}.json"
    if path is not None and path.is_file():
        return ConstructionSequence.load(path)
    sequence = make_agent("climb").solve(Simulator(silhouette)).sequence
    if path is not None:
        write_atomically(path, sequence.to_json())
    return sequence
