"""`Player`: a policy network that plays on a simulator. It needs torch, and neither Gymnasium nor Stable-Baselines3.

Letters: B states, G actions of the codec.
"""

from collections.abc import Collection, Iterator, Sequence
from weakref import WeakKeyDictionary

import numpy as np
import torch

from agents.budget import Meter
from agents.rl.network import NEVER, MeshNet, observer_of
from agents.solution import Track
from autopoly_env.arrays import BoolArray, ByteArray, FloatArray, IntArray
from autopoly_env.errors import ConfigError, IllegalActionError
from autopoly_env.mesh import FACE_RULES, FaceRule, PolyMesh
from autopoly_env.observation import Observation
from autopoly_env.operators import STOP, Action, ActionCodec
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State


def observation_of(observation: Observation, mask: BoolArray, w_sc: float, faces: FaceRule = "any") -> Observation:
    """What a policy sees: the environment's observation, which actions are legal, what an element costs, the rule."""
    rule = np.array([float(faces == known) for known in FACE_RULES], np.float32)
    return {**observation, "action_mask": mask.astype(np.int8), "price": np.array((w_sc,), np.float32), "rule": rule}


def allowed(codec: ActionCodec, mesh: PolyMesh, operators: Collection[str]) -> BoolArray:
    """(G,) the actions of some operators that the mesh and the codec have room for."""
    mask = codec.legal_mask(mesh)
    for unknown in set(codec.operators).difference(operators):
        mask[codec.indices_of(unknown)] = False
    return mask


class Player:
    """Says how promising actions are. `name` is what errors call it."""

    def __init__(self, net: MeshNet, name: str = "the policy") -> None:
        self.net, self.name = net.eval(), name
        self.spec = net.spec
        self.codec = ActionCodec(self.spec.operators, self.spec.max_vertices)
        self._observer = observer_of(self.spec)
        self._pictures: WeakKeyDictionary[Silhouette, ByteArray] = WeakKeyDictionary()

    def observe(self, simulator: Simulator, state: State, exact: bool = True) -> Observation:
        """What the policy sees of a state; `exact` as in `legal_mask`.

        Raises ConfigError as `check`, and for a mesh that its padding has no room for.
        """
        self.check(simulator)
        self.check_fits(state)
        silhouette = simulator.silhouette
        if silhouette not in self._pictures:
            self._pictures[silhouette] = self._observer.picture_of(silhouette)
        left = max(0, min(self.spec.max_steps, simulator.max_steps) - state.step)
        seen = self._observer.observe(state.mesh, self._pictures[silhouette], left)
        return observation_of(seen, self.legal_mask(simulator, state, exact), simulator.weights.w_sc, simulator.faces)

    def check(self, simulator: Simulator) -> None:
        """Raise ConfigError where the policy knows nothing of the simulator's rule, price or any of its operators."""
        self.spec.check_operators(simulator.operators, self.name)
        self.spec.check_rule(simulator.faces, simulator.weights.w_sc)

    def check_fits(self, state: State) -> None:
        """Raise ConfigError for a mesh that the padding has no room for."""
        self._observer.check_fits(state.mesh)

    def fits(self, state: State) -> bool:
        """Whether the padding has room for the mesh."""
        try:
            self.check_fits(state)
        except ConfigError:
            return False
        return True

    def legal_mask(self, simulator: Simulator, state: State, exact: bool = True) -> BoolArray:
        """(G,) what may be done: what the codec has room for and the simulator, with its guidance, allows.

        Unless it is to be `exact`, actions are not tried for whether the rule of faces has room for them.
        """
        mask = allowed(self.codec, state.mesh, simulator.operators)
        if simulator.guidance.names or (exact and simulator.faces != "any"):
            mask &= self.codec.mask_of(simulator.legal_actions(state))
        return mask

    def logits(self, simulators: Sequence[Simulator], states: Sequence[State], exact: bool = True) -> FloatArray:
        """(B, G) logits of the actions in each state; far below all others where they are not legal (`legal_mask`)."""
        seen = [self.observe(simulator, state, exact) for simulator, state in zip(simulators, states, strict=True)]
        batch = {name: torch.from_numpy(np.stack([one[name] for one in seen])) for name in seen[0]}
        device = next(self.net.parameters()).device
        with torch.inference_mode():
            output, _ = self.net({name: tensor.to(device) for name, tensor in batch.items()})
        logits: FloatArray = output.double().cpu().numpy()
        return logits

    def ranked(
        self,
        simulator: Simulator,
        state: State,
        rng: np.random.Generator | None = None,
        temperature: float = 1.0,
        exact: bool = True,
    ) -> list[Action]:
        """The legal actions in the order in which to try them: the likeliest first, or drawn with `rng`.

        STOP alone where the construction has as many steps as the policy was trained to take. `exact` as in
        `legal_mask`: without, some may be refused when they are tried, and the order of the others is the same.
        """
        if state.step >= self.spec.max_steps:
            return [STOP]
        legal, logits = self._legal_logits(simulator, state, exact)
        if rng is not None:
            # Gumbel noise sorts as drawing without replacement does (Kool, van Hoof & Welling 2019)
            logits = logits / temperature + rng.gumbel(size=len(logits))
        return [self.codec.decode(int(legal[k])) for k in np.argsort(-logits, kind="stable")]

    def probabilities(self, simulator: Simulator, state: State, temperature: float = 1.0) -> dict[Action, float]:
        """The probability of each legal action, STOP first."""
        legal, logits = self._legal_logits(simulator, state)
        probabilities = np.exp((logits - logits.max()) / temperature)
        probabilities /= probabilities.sum()
        return {self.codec.decode(int(k)): float(p) for k, p in zip(legal, probabilities, strict=True)}

    def play(
        self,
        simulator: Simulator,
        track: Track,
        meter: Meter,
        rng: np.random.Generator | None = None,
        temperature: float = 1.0,
    ) -> Iterator[Track]:
        """Play on from `track` until the policy stops, its padding is full or the budget is spent; yield every step."""
        while not track.state.done and not meter.spent():
            n_before = simulator.n_refits
            following = self._step(simulator, track.state, rng, temperature)
            if following is None:
                return
            meter.add([following], simulator.n_refits - n_before)
            track = Track(following, track)
            yield track
            if not self.fits(following):  # an action and its mirror image may need more room than one has
                return

    def _step(
        self, simulator: Simulator, state: State, rng: np.random.Generator | None, temperature: float
    ) -> State | None:
        """The state after the first action in order that there is room for; None where that is STOP."""
        for action in self.ranked(simulator, state, rng, temperature, exact=False):
            if action == STOP:
                return None
            try:
                return simulator.transition(state, action)
            except IllegalActionError:  # a hole that fits nowhere, or against the rule of faces
                continue
        return None

    def _legal_logits(self, simulator: Simulator, state: State, exact: bool = True) -> tuple[IntArray, FloatArray]:
        """The numbers of the legal actions, and their logits."""
        logits = self.logits([simulator], [state], exact)[0]
        legal = np.flatnonzero(logits > 0.5 * NEVER)
        return legal, logits[legal]
