"""Rows about the rule of faces: what keeping faces convex costs a refit, in time and in loss."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from autopoly_env.mesh import FaceRule, PolyMesh, broken_faces
from autopoly_env.placement import Disagreement
from autopoly_env.refit import THOROUGH, RefitResult, RefitTarget, refit
from autopoly_env.silhouette import load_silhouette
from autopoly_env.simulator import Simulator
from benchmarks.report import Must, Row
from benchmarks.timing import median_seconds

COST = Must("<=", 1.3)
_DEPTH = 6  # greedy steps of which the children are refitted, with and without the rule
_N_STARTS = 6  # of each step


class _Case(NamedTuple):
    start: PolyMesh  # of convex quads
    target: RefitTarget


def rule_rows(images: Sequence[Path]) -> Iterator[Row]:
    """Time and loss of the same refits under "quads" and "any", of what extrusions of the silhouettes begin with."""
    cases = [case for path in images for case in _cases(path)]
    ruled, free = median_seconds(lambda: _refitted(cases, "quads"), lambda: _refitted(cases, "any"), rounds=7)
    n = len(cases)
    yield Row("refit, faces=quads", ruled / n, free / n, ruled / free, COST, "s", f"against any; {n} refits")
    fits = [_refitted(cases, rule) for rule in ("quads", "any")]
    kept, free_loss = (sum(fit.loss for fit in some) / n for some in fits)
    n_broken = [sum(bool(broken_faces(fit.mesh, "quads")) for fit in some) for some in fits]
    note = f"meshes that break the rule: {n_broken[0]} against {n_broken[1]}"
    yield Row("loss after it", kept, free_loss, kept / free_loss, note=note)


def _refitted(cases: Sequence[_Case], rule: FaceRule) -> list[RefitResult]:
    return [refit(case.start, case.target, THOROUGH, faces=rule) for case in cases]


def _cases(path: Path) -> Iterator[_Case]:
    """What the children of greedy states, built of quads, are refitted from."""
    game = Simulator(load_silhouette(path), operators="edge_extrude", faces="quads")
    state = game.initial()
    for _ in range(_DEPTH):
        disagreement = Disagreement(state.mesh, game.silhouette)
        actions = game.legal_actions(state)[1:]
        for action in actions[:: max(1, len(actions) // _N_STARTS)][:_N_STARTS]:
            yield _Case(game.trial_of(disagreement, action).starts[0].mesh, game.refit_target(state.score.iou))
        children = game.transition_all(state, actions)
        if not children:
            return
        state = max(children, key=lambda child: child.score.iou)
