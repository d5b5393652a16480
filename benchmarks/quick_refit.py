"""What a quick refit has of a whole one, and WarpNet, and the whole one cut short: `python -m benchmarks.quick_refit`.

The states are those of greedy play: after up to eight steps the meshes that six actions make, drawn by lot, not yet
fitted. A whole refit is one of a search's, `THOROUGH`, from the first start of each. Times are of calls of
the kernel, or of the network with what it needs in a search, in batches of 64; on one core, in turn with the whole
refit.
Letters: N states.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from agents.guided.evaluator import carried_by
from agents.guided.weights import load_warpnet
from autopoly_env.arrays import FloatArray
from autopoly_env.compute import set_threads
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action
from autopoly_env.placement import Disagreement
from autopoly_env.raster import workspace
from autopoly_env.refit import QUICK, THOROUGH, RefitConfig, RefitTarget, quick_resolution, refit_kernels
from autopoly_env.refit.refitting import NOBODY, shape_arguments
from autopoly_env.silhouette import Silhouette, find_images, load_silhouette
from autopoly_env.simulator import Simulator
from autopoly_env.targets import make_targets, split_seed
from benchmarks.report import Must

SHARE = Must(">=", 0.8)
TIME = Must("<=", 1 / 3)
BATCH = 64
_N_STEPS, _N_EACH, _N_ROUNDS = 8, 6, 5
_WAYS = (0.5, 2.0, 5.0, 12.0)  # pixels that the whole refit moves a vertex, where rows of the second table begin


@dataclass(frozen=True)
class Case:
    """A mesh that an action has made, and what it is to be fitted to."""

    target: int  # number of the silhouette
    simulator: Simulator
    mesh: PolyMesh
    iou: float  # of the state before the action

    def aim(self, resolution: int) -> RefitTarget:
        return self.simulator.refit_target(self.iou, resolution)


Mover = Callable[[Sequence[Case]], tuple[list[PolyMesh], float]]  # to meshes, and the seconds that it took


def refitting(config: RefitConfig, share: float = 1.0, towards: Sequence[PolyMesh] | None = None) -> Mover:
    """Refits by `config`; `share` of the resolution. An oracle begins half-way to the meshes `towards`."""

    def move(cases: Sequence[Case]) -> tuple[list[PolyMesh], float]:
        calls = []
        for k, case in enumerate(cases):
            target = case.aim(round(share * case.simulator.resolution))
            begin = case.mesh.vertices if towards is None else 0.5 * (case.mesh.vertices + towards[k].vertices)
            shape = shape_arguments(case.mesh.topology, "any", None)
            room = workspace(target.resolution, len(case.mesh.topology.boundary_half_edges))
            aim = target.coverages, target.sums
            calls.append(
                (begin[None], *shape, *aim, *config.settings, *NOBODY.arguments, room, np.empty_like(begin[None]))
            )
        began = time.process_time()
        for call in calls:
            refit_kernels.refit(*call)
        spent = time.process_time() - began
        return [case.mesh.with_vertices(call[-1][0]) for case, call in zip(cases, calls, strict=True)], spent

    return move


def warping() -> Mover:
    """WarpNet."""
    net, _ = load_warpnet()

    def move(cases: Sequence[Case]) -> tuple[list[PolyMesh], float]:
        meshes: list[PolyMesh] = []
        began = time.process_time()
        for k in range(0, len(cases), BATCH):
            part = cases[k : k + BATCH]
            silhouettes = [case.simulator.silhouette for case in part]
            meshes += carried_by(net, silhouettes, [case.mesh for case in part])
        return meshes, time.process_time() - began

    return move


def cases_of(silhouettes: Sequence[Silhouette]) -> Iterator[Case]:
    for number, silhouette in enumerate(silhouettes):
        game, rng = Simulator(silhouette), np.random.default_rng(0)
        state = game.initial()
        for _ in range(_N_STEPS):
            for mesh in _begun(game, Disagreement(state.mesh, silhouette), game.legal_actions(state)[1:], rng):
                yield Case(number, game, mesh, state.score.iou)
            children = game.transition_all(state)
            if state.done or not children:
                break
            state = max(children, key=lambda child: child.score.total)


def _begun(
    game: Simulator, disagreement: Disagreement, actions: Sequence[Action], rng: np.random.Generator
) -> Iterator[PolyMesh]:
    """What some actions that show make of a mesh."""
    n_made = 0
    for k in rng.permutation(len(actions)).tolist():
        try:
            trial = game.trial_of(disagreement, actions[k])
        except IllegalActionError:
            continue
        if trial.shows:
            yield trial.starts[0].mesh
            n_made += 1
        if n_made == _N_EACH:
            return


# --- tables ---


def share_of(gains: FloatArray, whole: FloatArray, owners: FloatArray) -> tuple[float, float, float]:
    """The share that gains (N,) have of those of the whole refit (N,), and its 95 % interval; targets are drawn."""
    sums = np.array([(gains[owners == k].sum(), whole[owners == k].sum()) for k in np.unique(owners)])
    drawn = np.random.default_rng(0).integers(len(sums), size=(2000, len(sums)))
    found, of = sums[drawn].sum(axis=1).T
    low, high = np.quantile(found / of, (0.025, 0.975))
    return float(sums[:, 0].sum() / sums[:, 1].sum()), float(low), float(high)


def compare(cases: Sequence[Case], title: str, console: Console) -> None:
    """Print what each way to move vertices has of the whole refit's gain in IoU, and of its time."""
    owners = np.array([case.target for case in cases])
    before = _ious(cases, [case.mesh for case in cases])
    whole, _ = refitting(THOROUGH)(cases)
    gains = _ious(cases, whole) - before
    quick = quick_resolution(128) / 128
    movers = {
        "WarpNet": warping(),
        "quick refit": refitting(QUICK, quick),
        "the same, as far as it goes": refitting(replace(QUICK, n_near=60, tolerance=1e-4), quick),
        "the same, from half-way to the whole one's end (oracle)": refitting(QUICK, quick, whole),
        "the same, a tighter end (3e-3)": refitting(replace(QUICK, tolerance=3e-3), quick),
        "the same, a looser end (7e-3)": refitting(replace(QUICK, tolerance=7e-3), quick),
        "half the pixels": refitting(RefitConfig(first_level=2), 0.5),
        **{
            f"no far phase, {n} steps a level": refitting(RefitConfig(first_level=1, n_near=n))
            for n in (1, 2, 3, 4, 20)
        },
    }
    table = Table("", "share of the gain (95 %)", "if only taken where better", "time / whole", "both as asked")
    carried = {}
    for name, move in movers.items():
        meshes, _ = move(cases)
        carried[name] = meshes
        ratio = float(np.median([move(cases)[1] / refitting(THOROUGH)(cases)[1] for _ in range(_N_ROUNDS)]))
        found = _ious(cases, meshes) - before
        share, low, high = share_of(found, gains, owners)
        kept = share_of(np.maximum(found, 0.0), gains, owners)[0]
        holds = share >= SHARE.bound and ratio <= TIME.bound
        table.add_row(
            name, f"{share:.3f} ({low:.3f} to {high:.3f})", f"{kept:.3f}", f"{ratio:.3f}", "yes" if holds else "no"
        )
    table.title = f"{title}: {len(cases)} states, IoU {before.mean():.3f} to {(before + gains).mean():.3f}"
    console.print(table)
    console.print(_errors(cases, whole, {name: carried[name] for name in ("WarpNet", "quick refit")}))


def _ious(cases: Sequence[Case], meshes: Sequence[PolyMesh]) -> FloatArray:
    return np.array([case.simulator.score(mesh).iou for case, mesh in zip(cases, meshes, strict=True)])


def _errors(cases: Sequence[Case], whole: Sequence[PolyMesh], carried: dict[str, list[PolyMesh]]) -> Table:
    """How far vertices of the outline end from where the whole refit has them, by the way that it moves them."""
    way = np.concatenate([apart(case, mesh, case.mesh) for case, mesh in zip(cases, whole, strict=True)])
    rows = np.digitize(np.linalg.norm(way, axis=1), _WAYS)
    table = Table("pixels that the whole refit moves it", "vertices", *(f"{name}, across / along" for name in carried))
    errors = {
        name: np.concatenate([apart(case, one, two) for case, one, two in zip(cases, meshes, whole, strict=True)])
        for name, meshes in carried.items()
    }
    for row, (low, high) in enumerate(zip((0.0, *_WAYS), (*_WAYS, np.inf), strict=True)):
        here = rows == row
        means = [np.abs(error[here]).mean(axis=0) for error in errors.values()]
        table.add_row(f"{low:g} to {high:g}", f"{here.mean():.0%}", *(f"{a:.2f} / {b:.2f}" for a, b in means))
    return table


def apart(case: Case, one: PolyMesh, other: PolyMesh) -> FloatArray:
    """(N, 2) pixels between boundary vertices of two meshes, across and along the outline of the case's."""
    points, normals = case.mesh.vertices, np.zeros_like(case.mesh.vertices)
    for i, j in case.mesh.topology.boundary_half_edges:
        side = points[j] - points[i]
        normal = np.array((side[1], -side[0])) / max(float(np.hypot(*side)), 1e-12)
        normals[i] += normal
        normals[j] += normal
    shown = case.mesh.topology.is_boundary_vertex
    across = normals[shown] / np.maximum(np.linalg.norm(normals[shown], axis=1, keepdims=True), 1e-12)
    way = (one.vertices - other.vertices)[shown] * case.simulator.resolution
    along = np.column_stack((across[:, 1], -across[:, 0]))
    return np.column_stack(((way * across).sum(axis=1), (way * along).sum(axis=1)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print two tables for made targets, and two for each folder."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.quick_refit", description=__doc__)
    parser.add_argument("folders", nargs="*", metavar="DIR", help="silhouettes, beside what is made")
    parser.add_argument("--made-each", type=int, default=16, help="constructions of the test split, and objects (16)")
    parser.add_argument("--first", type=int, default=0, help="number of the first of them (0)")
    options = parser.parse_args(arguments)
    set_threads(1)
    torch.set_num_threads(1)
    console = Console() if sys.stdout.isatty() else Console(width=140)
    made = [
        make_targets(kind).sample(split_seed("test", k))
        for k in range(options.first, options.first + options.made_each)
        for kind in ("construction", "objects")
    ]
    sets = {"test split": made} | {
        folder: [load_silhouette(path) for path in find_images([folder])] for folder in options.folders
    }
    for title, silhouettes in sets.items():
        compare(list(cases_of(silhouettes)), title, console)
    return 0


if __name__ == "__main__":
    sys.exit(main())
