"""What a mesh has lost of its picture, in words, and at which price it would be kept."""

from typing import Any

from agents.commands.styles import STYLES
from agents.solution import Solution
from agents.trace.agent import TraceAgent, TraceConfig
from agents.trace.outline import Outline
from agents.trace.rings import trace_rings
from autopoly_env.details import Details, Losses
from autopoly_env.score import ScoreWeights
from autopoly_env.simulator import Simulator

_PRICES = (0.3, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)  # of an element, that are tried for a mesh that loses nothing
_FEW_PLACES = 4  # places where mesh and picture differ that are not worth a word
_ROUGH = 0.7  # IoU, below which something is lost even where it is in one piece, such as the turns of a spiral
_SEEN = 0.95  # IoU, about, of an outline that has the small details
_SEEN_AS_AREA = 0.85  # the same, where exact areas are compared: no outline has been refitted yet
_STEPS = (1000, 10_000)
_FEW_RINGS = 10  # parts and holes that a wish keeps in quads, as far as was tried


def losses_of(solution: Solution, simulator: Simulator) -> Losses:
    """What of the picture the mesh has."""
    return Losses.of(solution.mesh, simulator.silhouette)


def in_words(losses: Losses, simulator: Simulator, iou: float = 1.0) -> str:
    """What is lost, and what keeps it; empty if nothing is. `iou` is that of the mesh."""
    lost = [
        f"the picture has {n} {kind}{'s' if n > 1 else ''}, the mesh {n_kept or 'none'}"
        for kind, n, n_kept in (
            ("part", losses.n_parts, losses.n_parts_kept),
            ("hole", losses.n_holes, losses.n_holes_kept),
        )
        if n_kept < n
    ]
    n_lost = losses.n_parts + losses.n_holes - losses.n_parts_kept - losses.n_holes_kept
    n_small = losses.n_places - n_lost
    if n_small >= _FEW_PLACES:
        lost.append(f"they differ in {n_small} small details" if lost else f"{n_small} small details are lost")
    if not lost and iou < _ROUGH:
        return f"most details are lost (IoU {iou:.2f}){_advice(losses, simulator, False, True)}"
    if not lost:
        return ""
    return f"{', and '.join(lost)}{_advice(losses, simulator, n_lost > 0, n_small >= _FEW_PLACES)}"


def record_of_losses(losses: Losses) -> dict[str, Any]:
    """The numbers by name, for JSON."""
    return {
        "parts": [losses.n_parts_kept, losses.n_parts],
        "holes": [losses.n_holes_kept, losses.n_holes],
        "places_that_differ": losses.n_places,
    }


def _advice(losses: Losses, simulator: Simulator, rings_lost: bool, details_lost: bool) -> str:
    """Which option keeps what is lost; under a rule of faces a wish for a few parts and holes, or the paper's style."""
    if simulator.faces == "any":
        return _price_that_keeps(simulator, rings_lost, details_lost)
    is_few = losses.n_parts + losses.n_holes <= _FEW_RINGS
    if is_few and not details_lost and not simulator.guidance.keep:
        has_parts, has_holes = losses.n_parts_kept == losses.n_parts, losses.n_holes_kept == losses.n_holes
        return f": --keep {'holes' if has_parts else 'parts' if has_holes else 'all'} keeps them"
    style = STYLES["paper"]
    paper = Simulator(simulator.silhouette, operators=style.operators, weights=simulator.weights)
    return _price_that_keeps(paper, rings_lost, details_lost, " --style paper")


def _price_that_keeps(simulator: Simulator, rings_lost: bool, details_lost: bool, options: str = "") -> str:
    """The highest price at which a tracer keeps them, and what it takes."""
    rings = trace_rings(simulator.silhouette)
    details = Details.of(simulator.silhouette)
    everything = len(details.parts), len(details.holes)
    seen = _SEEN_AS_AREA if simulator.silhouette.is_scored_by_area else _SEEN
    for price in _PRICES:
        if price > simulator.weights.w_sc or (price == simulator.weights.w_sc and not options):
            continue
        outline = _traced(simulator, price)
        if outline is None or (rings_lost and details.kept(outline.loops) != everything):
            continue
        if details_lost and outline.score(simulator.silhouette.target(simulator.finest), ScoreWeights()).iou < seen:
            continue
        steps = next((n for n in (simulator.max_steps, *_STEPS) if n >= outline.n_steps), None)
        if steps is None or not rings:
            break
        dear = "" if price == simulator.weights.w_sc else f" --w-sc {price:g}"
        more = "" if steps == simulator.max_steps else f" --max-steps {steps}"
        return f":{options}{dear}{more} keeps them (about {outline.complexity} elements)"
    return ""


def _traced(simulator: Simulator, price: float) -> Outline | None:
    """The outline that tracing begins with at a price, were there no limit of steps."""
    weights = ScoreWeights(simulator.weights.w_sm, price, simulator.weights.w_si)
    free = Simulator(
        simulator.silhouette, operators=",".join(simulator.operators), weights=weights, max_steps=_STEPS[-1]
    )
    return next(TraceAgent(TraceConfig((1.0,))).sweep(free, trace_rings(simulator.silhouette)), None)
