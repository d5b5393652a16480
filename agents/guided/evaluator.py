"""`NfapEvaluator`, `WarpEvaluator`, `QuickEvaluator`: the networks as what the search is told about states.

A prior is a softmax over the legal actions of `NfapNet.choice_logits`: the predicted operator's probability, shared out
among its legal elements by what the predicted region image shows at each of them. Weights that are told rule and price
know some of these (`NfapEvaluator.known`) and are asked about no others. For those that are not, every logit is
corrected by what the action's elements cost more than in training, which for a softmax of r_all over a temperature is
exact.
Letters: A actions, K operator classes, S pixels a side.
"""

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import torch

from agents.guided.measures import candidate_arrays
from agents.guided.nfap import Foresight, NfapNet, candidates_of
from agents.guided.pictures import draw_inputs, rendering
from agents.guided.warp import WarpNet
from agents.guided.weights import NetworkMeta
from agents.knowing import Known
from agents.search.batched import BatchedEvaluator
from agents.search.evaluator import ResidualEvaluator
from autopoly_env.arrays import AnyArray, FloatArray
from autopoly_env.compute import map_threads
from autopoly_env.errors import IllegalActionError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Action, Choice, operator_named
from autopoly_env.placement import Disagreement, tried
from autopoly_env.refit import QUICK, quick_resolution, refit
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State

_FLOOR = 1e-4  # of the likeliest action, for all
_REMEMBERED = 256  # states whose evaluation is kept


class NfapEvaluator(BatchedEvaluator[Foresight]):
    """nFAP-Net's priors, exact refits: the agent `nfap-prior`."""

    def __init__(self, net: NfapNet, meta: NetworkMeta, temperature: float = 1.0) -> None:
        super().__init__(_REMEMBERED)
        self._net, self._temperature = net, temperature
        labels = meta.training.get("labels", {})
        self._trained_w_sc = 0.3 if net.config.w_sc is not None else float(labels.get("w_sc", 0.3))
        self._label_temperature = float(labels.get("temperature", 1.0))
        self._residual = ResidualEvaluator()

    @property
    def known(self) -> Known:
        """What the weights may be asked about."""
        config = self._net.config
        return Known(config.classes, config.rules, config.w_sc)

    def prior(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> FloatArray:
        disagreement = Disagreement(state.mesh, simulator.silhouette)
        arrays = candidate_arrays(disagreement, actions, self._net.config.classes)
        arrays["log_residual"] = np.log(self._residual.prior_by(disagreement, actions)).astype(np.float32)
        candidates = candidates_of({name: torch.from_numpy(array)[None] for name, array in arrays.items()})
        with torch.inference_mode():
            logits = self._net.choose(self._said_of(simulator, state), candidates)
        is_known = arrays["classes"] >= 0
        if not is_known.any():
            return self._residual.prior_by(disagreement, actions)
        corrected = logits[0].double().numpy() - self._extra_price(simulator) * arrays["added"]
        odds = np.exp((corrected - corrected.max()) / self._temperature)
        odds += _FLOOR
        odds[~is_known] = 0.0
        normalised: FloatArray = odds / odds.sum()
        return normalised

    def _extra_price(self, simulator: Simulator) -> float:
        """What an element costs more than in training, in units of the labels' softmax; 0 if the network is told."""
        if self._net.config.w_sc is not None:
            return 0.0
        return (simulator.weights.w_sc - self._trained_w_sc) / self._label_temperature

    def _evaluate(self, simulator: Simulator, states: Sequence[State]) -> Iterable[Foresight]:
        """The first stage of what the network foresees."""
        config = self._net.config
        target = simulator.silhouette.target(config.image_size).coverage
        pictures = np.stack([draw_inputs(state.mesh, target, config.inputs) for state in states])
        told = torch.tensor([config.told(simulator.faces, simulator.weights.w_sc)] * len(states))
        with torch.inference_mode():
            said = self._net(torch.from_numpy(pictures), told, n_stages=1, with_images=False)
        return [said.row(row) for row in range(len(states))]


class CarryingEvaluator(NfapEvaluator):
    """nFAP-Net's priors, and no whole refit: the action is applied, then a subclass carries the vertices (`_carried`).

    `placed`: new vertices begin where rendering and target disagree, as before a refit. What makes a shape worse is not
    taken. Locked vertices, symmetry and a rule of faces only a transition can heed: where a user has asked for them, it
    is refits after all.
    """

    def __init__(self, net: NfapNet, meta: NetworkMeta, temperature: float = 1.0, placed: bool = True) -> None:
        super().__init__(net, meta, temperature)
        self._placed = placed

    @abstractmethod
    def _carried(self, simulator: Simulator, state: State, meshes: Sequence[PolyMesh]) -> list[PolyMesh]:
        """The meshes right after actions in `state`, with their vertices where they are to be."""

    def expand(self, simulator: Simulator, state: State, actions: Sequence[Action]) -> list[State]:
        if simulator.guidance.locked or simulator.guidance.axis is not None or simulator.faces != "any":
            return super().expand(simulator, state, actions)
        if state.done:
            return []
        begun = list(self._begin(simulator, state, actions))
        if not begun:
            return []
        carried = self._carried(simulator, state, [mesh for _, _, mesh in begun])
        made = [
            _better(simulator, state, action, choice, before, after)
            for (action, choice, before), after in zip(begun, carried, strict=True)
        ]
        return self._noted(simulator, made)

    def _begin(
        self, simulator: Simulator, state: State, actions: Sequence[Action]
    ) -> Iterable[tuple[Action, Choice | None, PolyMesh]]:
        """The meshes right after the actions; those without room left out."""
        disagreement = Disagreement(state.mesh, simulator.silhouette)
        for action in actions:
            try:
                if self._placed:
                    start = tried(disagreement, action).starts[0]
                    yield action, start.choice, start.mesh
                else:
                    operator = operator_named(action.operator)
                    choice = operator.choice_at(state.mesh, action.element)
                    yield action, choice, operator.apply(state.mesh, action.element, choice)
            except IllegalActionError:
                continue


class WarpEvaluator(CarryingEvaluator):
    """WarpNet's geometry, the paper's Algorithm 1: vertices go where the warp of the rendering to the target does."""

    def __init__(
        self, net: NfapNet, meta: NetworkMeta, warp: WarpNet, temperature: float = 1.0, placed: bool = True
    ) -> None:
        super().__init__(net, meta, temperature, placed)
        self._warp = warp

    def _carried(self, simulator: Simulator, state: State, meshes: Sequence[PolyMesh]) -> list[PolyMesh]:
        return carried_by(self._warp, [simulator.silhouette] * len(meshes), meshes)


def carried_by(net: WarpNet, silhouettes: Sequence[Silhouette], meshes: Sequence[PolyMesh]) -> list[PolyMesh]:
    """The meshes with their vertices carried by the warps of each to its silhouette; one batch."""
    size = net.config.image_size
    targets = [silhouette.target(size).coverage for silhouette in silhouettes]
    shown = [rendering(mesh, size) for mesh in meshes]
    pictures = np.stack([np.stack(pair) for pair in zip(shown, targets, strict=True)]).astype(np.float32)
    vertices = _padded([mesh.vertices.astype(np.float32) for mesh in meshes], 0)
    edges = _padded([mesh.topology.boundary_half_edges for mesh in meshes], -1)
    with torch.no_grad():
        carried = net.warps(torch.from_numpy(pictures), vertices, edges)[-1].vertices.double().numpy()
    return [mesh.with_vertices(row[: len(mesh.vertices)]) for row, mesh in zip(carried, meshes, strict=True)]


class QuickEvaluator(CarryingEvaluator):
    """Quick refits for geometry (`autopoly_env.refit.QUICK`): most of what a whole one gains, sooner than WarpNet."""

    def _carried(self, simulator: Simulator, state: State, meshes: Sequence[PolyMesh]) -> list[PolyMesh]:
        target = simulator.refit_target(state.score.iou, quick_resolution(simulator.resolution))
        return map_threads(lambda mesh: refit(mesh, target, QUICK).mesh, meshes)


def _padded(arrays: Sequence[AnyArray], padding: int) -> torch.Tensor:
    """Arrays (n, 2) of different lengths as one tensor (B, longest, 2)."""
    batch = np.full((len(arrays), max(map(len, arrays)), 2), padding, arrays[0].dtype)
    for row, array in zip(batch, arrays, strict=True):
        row[: len(array)] = array
    return torch.from_numpy(batch)


def _better(
    simulator: Simulator, state: State, action: Action, choice: Choice | None, before: PolyMesh, after: PolyMesh
) -> State:
    """The state after an action: the better of the shapes before and after its vertices are carried."""
    states = [simulator.initial(mesh) for mesh in (before, after)]
    best = max(states, key=lambda made: made.score.total)
    step = state.step + 1
    done = best.done or ("max_steps" if step >= simulator.max_steps else "")
    return replace(best, step=step, done=done, action=action, choice=choice, n_refits=0)
