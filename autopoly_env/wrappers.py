"""Wrappers that show the observation in other forms: as one vector, with the action mask in it, as a graph."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, Graph, GraphInstance
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import VectorEnv
from numpy.typing import DTypeLike

from autopoly_env.arrays import AnyArray, BoolArray, ByteArray
from autopoly_env.env import AutoPolyEnv
from autopoly_env.errors import ConfigError
from autopoly_env.observation import POSITION_RANGE, Observation
from autopoly_env.shown import short


class _Shown(gymnasium.ObservationWrapper[Any, Any, Any], RecordConstructorArgs):
    """The environment with its observation in another form; `settings` are the wrapper's own arguments."""

    def __init__(self, env: gymnasium.Env[Any, Any], **settings: Any) -> None:
        RecordConstructorArgs.__init__(self, **settings)
        gymnasium.ObservationWrapper.__init__(self, env)

    def action_masks(self) -> BoolArray:
        """(n_actions,) which actions are legal now."""
        return _autopoly(self.env).action_masks()


class FlatObservation(_Shown):
    """Everything as one vector of float32 in 0..1, for networks without convolutions.

    The arrays of the observation follow each other in the order of the space's keys, every one scaled from its bounds
    to 0..1: padding is 0, the unit square lies between 1/3 and 2/3.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        boxes = _boxes(env)
        self._names = list(boxes)
        self._low = np.concatenate([box.low.ravel().astype(np.float32) for box in boxes.values()])
        self._width = np.concatenate([box.high.ravel().astype(np.float32) for box in boxes.values()]) - self._low
        self.observation_space = Box(0.0, 1.0, self._low.shape, np.float32)

    def observation(self, observation: Any) -> Any:
        values = np.concatenate([observation[name].ravel() for name in self._names], dtype=np.float32)
        return (values - self._low) / self._width


class MaskInObservation(_Shown):
    """The action mask as a further key of the observation, for agents that see observations only.

    What was a Dict keeps its keys, and anything else becomes the key `observation`; with `observation_key` the whole
    observation becomes that one key. The mask (n_actions,) is 1 where an action is legal, under `key` and as `dtype`:

    - SB3 and PettingZoo's way: `MaskInObservation(env)`
    - RLlib: `MaskInObservation(FlatObservation(env), observation_key="observations", dtype="float32")`
    - Tianshou: `MaskInObservation(FlatObservation(env), "mask", "obs", bool)`

    Raises ConfigError for a key that is there already, and for a dtype that is neither bool nor one of numbers.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        key: str = "action_mask",
        observation_key: str | None = None,
        dtype: DTypeLike = np.int8,
    ) -> None:
        self._dtype = _mask_dtype(dtype)
        super().__init__(env, key=key, observation_key=observation_key, dtype=self._dtype.name)
        n_actions, inner = _autopoly(env).codec.n_actions, env.observation_space
        self._key = key
        self._whole = observation_key or (None if isinstance(inner, Dict) else "observation")
        spaces = {self._whole: inner} if self._whole is not None else dict(inner.spaces)  # type: ignore[attr-defined]
        if key in spaces:
            raise ConfigError(f"the observation has a key {key!r} already; give the mask another one, key=...")
        self.observation_space = Dict({**spaces, key: Box(0, 1, (n_actions,), self._dtype.type)})

    def observation(self, observation: Any) -> dict[str, Any]:
        seen = observation if self._whole is None else {self._whole: observation}
        return {**seen, self._key: self.action_masks().astype(self._dtype)}


class GraphObservation(_Shown):
    """The mesh as a graph of the size it has, beside the two pictures and the steps left: a Dict of

    - `graph`: a `GraphInstance` whose nodes are the V vertices and whose links (E, 2) are the E edges, in the order in
      which actions number them. Nodes (V, 4) float32: x and y in the unit square; whether the vertex lies on the
      boundary; how much of the pixel under it is target, 0 to 1. Edges (E, 2): the length, unit square; whether the
      edge lies on the boundary.
    - `rendering`, `target`, `remaining_steps` as they were.

    RL libraries that batch observations need a collate function of their own for this.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        boxes = _boxes(env)
        low, high = POSITION_RANGE
        node_low, node_high = np.array([low, low, 0, 0], np.float32), np.array([high, high, 1, 1], np.float32)
        longest = np.float32(np.sqrt(2.0) * (high - low))
        edge_low, edge_high = np.zeros(2, np.float32), np.array([longest, 1], np.float32)
        graph = Graph(Box(node_low, node_high, dtype=np.float32), Box(edge_low, edge_high, dtype=np.float32))
        kept = {name: boxes[name] for name in ("rendering", "target", "remaining_steps")}
        self.observation_space = Dict({"graph": graph, **kept})

    def observation(self, observation: Observation) -> dict[str, Any]:
        topology = _autopoly(self.env).state.mesh.topology
        points = observation["vertices"].reshape(-1, 2)[: topology.n_vertices]
        on_target = _values_at(points, observation["target"])
        nodes = np.column_stack((points, topology.is_boundary_vertex, on_target)).astype(np.float32)
        ends = points[topology.edges]
        lengths = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        edges = np.column_stack((lengths, topology.is_boundary_edge)).astype(np.float32)
        graph = GraphInstance(nodes, edges, topology.edges.astype(np.int32))
        return {"graph": graph, **{name: observation[name] for name in ("rendering", "target", "remaining_steps")}}


def _values_at(points: AnyArray, picture: ByteArray) -> AnyArray:
    """(V,) 0 to 1: the pixel of a picture (1, R, R) under each point (V, 2); 0 outside."""
    size = picture.shape[-1]
    columns, rows = np.floor(points * size).astype(np.int64).T
    inside = (columns >= 0) & (rows >= 0) & (columns < size) & (rows < size)
    return np.where(inside, picture[0, np.clip(rows, 0, size - 1), np.clip(columns, 0, size - 1)] / 255.0, 0.0)


def action_masks(env: gymnasium.Env[Any, Any] | VectorEnv[Any, Any, Any]) -> BoolArray:
    """(n_actions,), or (num_envs, n_actions) of a vector environment: which actions are legal now, however wrapped.

    Gymnasium's vector wrappers pass no method on: `wrapped.action_masks()` is not there, `action_masks(wrapped)` is.
    """
    if isinstance(env, VectorEnv):
        inner: Any = env.unwrapped
        return np.stack(inner.call("action_masks"))
    return _autopoly(env).action_masks()


def _mask_dtype(dtype: DTypeLike) -> np.dtype[Any]:
    """The dtype of a mask. Raises ConfigError for one that has no 0 and 1."""
    try:
        found = np.dtype(dtype)
    except TypeError:
        found = np.dtype(object)
    if found.kind not in "biuf":
        raise ConfigError(f"a mask of dtype {short(dtype)}: expected bool, or whole or real numbers, such as float32")
    return found


def _autopoly(env: gymnasium.Env[Any, Any]) -> AutoPolyEnv:
    inner = env.unwrapped
    if not isinstance(inner, AutoPolyEnv):
        raise ConfigError(f"{type(inner).__name__} was given: expected an AutoPolyEnv, wrapped or not")
    return inner


def _boxes(env: gymnasium.Env[Any, Any]) -> dict[str, Box]:
    """The spaces of the observation by key. Raises ConfigError if it is no Dict of arrays any more."""
    _autopoly(env)
    space = env.observation_space
    boxes = {name: box for name, box in space.spaces.items() if isinstance(box, Box)} if isinstance(space, Dict) else {}
    if not isinstance(space, Dict) or len(boxes) < len(space.spaces) or "vertices" not in boxes:
        raise ConfigError(
            f"an observation space {type(space).__name__} without the environment's arrays: wrap it first"
        )
    return boxes
