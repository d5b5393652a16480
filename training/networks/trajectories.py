"""Constructions with labels, what the networks learn from: as objects, and packed into arrays for a shard on disk.

Letters: T trajectories of a shard, S states, V vertices, F faces, A actions, R pixels a side.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import get_args
from zipfile import BadZipFile

import numpy as np

from autopoly_env.arrays import AnyArray, BoolArray, Float32Array, IntArray
from autopoly_env.errors import ConfigError
from autopoly_env.files import write_atomically
from autopoly_env.mesh import FaceRule, PolyMesh, Topology
from autopoly_env.operators import OPERATORS, Action
from autopoly_env.silhouette import Silhouette

VERSION = 1
STOPPED = -1  # instead of the row of an action: the right thing is to stop
_NAMES = list(OPERATORS)
_CODES = {name: code for code, name in enumerate(_NAMES)}
_RULE = "U8"  # text long enough for every rule of faces


@dataclass(frozen=True)
class Labelled:
    """A state, its legal actions, and what is known of them."""

    mesh: PolyMesh
    score: Float32Array  # (3,) IoU, complexity, self-intersections
    actions: tuple[Action, ...]  # without STOP; none where the construction was over or goes on unseen
    outcomes: Float32Array  # (A, 3) as `score`, after each action and its refit; NaN where not known
    log_residual: Float32Array  # (A,) log of the residual prior
    chosen: int  # row of the action that was taken, or STOPPED


@dataclass(frozen=True)
class Trajectory:
    """A target and the states of a construction towards it; the last has no action, or STOPPED is right there."""

    mask: BoolArray  # (R, R)
    states: tuple[Labelled, ...]
    ended: bool  # whether it stopped where it ends; otherwise what comes next is not known
    faces: FaceRule = "any"  # the rule that its states keep

    @cached_property
    def silhouette(self) -> Silhouette:
        return Silhouette(self.mask)

    @property
    def n_actions(self) -> int:
        """How many actions were taken."""
        return len(self.states) - 1

    def windows(self, n: int) -> list[int]:
        """The states from which n stages are known (those after the end are stops) and something may be done."""
        last = self.n_actions if self.ended else self.n_actions - n
        return [k for k in range(last + 1) if self.states[k].actions]


class Shard:
    """Trajectories packed into arrays; unpacked one at a time."""

    def __init__(self, arrays: dict[str, AnyArray]) -> None:
        self.arrays = arrays

    def __len__(self) -> int:
        return len(self.arrays["ended"])

    @classmethod
    def pack(cls, trajectories: Sequence[Trajectory]) -> "Shard":
        """The arrays of some trajectories, whose targets must have one resolution."""
        states = [state for trajectory in trajectories for state in trajectory.states]
        faces = [face for state in states for face in state.mesh.faces]
        actions = [(_CODES[a.operator], a.element) for state in states for a in state.actions]
        return cls(
            {
                "version": np.array(VERSION),
                "targets": np.packbits(np.stack([t.mask for t in trajectories]), axis=-1),
                "ended": np.array([t.ended for t in trajectories]),
                "faces": np.array([t.faces for t in trajectories], _RULE),
                "n_states": np.array([len(t.states) for t in trajectories], np.int32),
                "n_vertices": np.array([len(s.mesh.vertices) for s in states], np.int32),
                "vertices": np.concatenate([s.mesh.vertices for s in states]).astype(np.float32),
                "n_faces": np.array([len(s.mesh.faces) for s in states], np.int32),
                "face_sizes": np.array([len(face) for face in faces], np.int32),
                "corners": np.array([v for face in faces for v in face], np.int32),
                "n_actions": np.array([len(s.actions) for s in states], np.int32),
                "actions": np.array(actions, np.int32).reshape(-1, 2),
                "outcomes": np.concatenate([s.outcomes for s in states]).astype(np.float32),
                "log_residual": np.concatenate([s.log_residual for s in states]).astype(np.float32),
                "scores": np.stack([s.score for s in states]).astype(np.float32),
                "chosen": np.array([s.chosen for s in states], np.int32),
            }
        )

    @cached_property
    def _starts(self) -> dict[str, IntArray]:
        return {
            name: np.concatenate(([0], np.cumsum(self.arrays[name], dtype=np.int64)))
            for name in ("n_states", "n_vertices", "n_faces", "face_sizes", "n_actions")
        }

    def __getitem__(self, number: int) -> Trajectory:
        first, last = self._starts["n_states"][number : number + 2].tolist()
        mask = np.unpackbits(self.arrays["targets"][number].view(np.uint8), axis=-1).astype(np.bool_)
        states = tuple(self._state(k) for k in range(first, last))
        return Trajectory(mask[:, : len(mask)], states, bool(self.arrays["ended"][number]), self.rules[number])

    @cached_property
    def rules(self) -> list[FaceRule]:
        """The rule of faces of each trajectory; shards that do not say it are older than rules."""
        rules: list[FaceRule] = self.arrays["faces"].tolist() if "faces" in self.arrays else ["any"] * len(self)
        return rules

    @property
    def operators(self) -> set[str]:
        """Names of the operators of its actions."""
        return {_NAMES[code] for code in np.unique(self.arrays["actions"][:, 0]).tolist()}

    def _state(self, k: int) -> Labelled:
        v0, v1 = self._starts["n_vertices"][k : k + 2].tolist()
        f0, f1 = self._starts["n_faces"][k : k + 2].tolist()
        a0, a1 = self._starts["n_actions"][k : k + 2].tolist()
        cuts = self._starts["face_sizes"][f0 : f1 + 1]
        corners = self.arrays["corners"][cuts[0] : cuts[-1]].tolist()
        ends = (cuts - cuts[0]).tolist()
        faces = tuple(tuple(corners[a:b]) for a, b in pairwise(ends))
        points = self.arrays["vertices"][v0:v1].astype(np.float64)
        return Labelled(
            PolyMesh.numbered(points, Topology(len(points), faces)),
            self.arrays["scores"][k].astype(np.float32),
            tuple(Action(_NAMES[code], element) for code, element in self.arrays["actions"][a0:a1].tolist()),
            self.arrays["outcomes"][a0:a1].astype(np.float32),
            self.arrays["log_residual"][a0:a1].astype(np.float32),
            int(self.arrays["chosen"][k]),
        )

    def save(self, path: Path) -> None:
        """Write the arrays to a compressed .npz, whole or not at all. Raises OutputError."""
        buffer = BytesIO()
        np.savez_compressed(buffer, **self.arrays)  # type: ignore[arg-type]
        write_atomically(path, buffer.getvalue())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Shard":
        """The shard in a file; nothing in it is executed. Raises ConfigError if it is damaged or something else."""
        try:
            with np.load(path, allow_pickle=False) as file:
                shard = cls({name: file[name] for name in file.files})
        except (OSError, ValueError, BadZipFile, EOFError) as error:
            reason = getattr(error, "strerror", None) or "no .npz file, or half of one"
            raise ConfigError(
                f"cannot read the shard {path} ({reason}); make it again with training.make_expert"
            ) from None
        defect = shard._defect()
        if defect:
            raise ConfigError(f"{path}: {defect}; make it again with training.make_expert")
        return shard

    def _defect(self) -> str:
        """What is wrong with arrays that came from outside; empty if nothing."""
        if self.arrays.get("version", np.array(0)).tolist() != VERSION:
            return f"no shard of version {VERSION}"
        try:
            arrays, starts = self.arrays, self._starts
            lengths = {
                "targets": len(self),
                "n_states": len(self),
                "n_vertices": starts["n_states"][-1],
                "n_faces": starts["n_states"][-1],
                "n_actions": starts["n_states"][-1],
                "scores": starts["n_states"][-1],
                "chosen": starts["n_states"][-1],
                "vertices": starts["n_vertices"][-1],
                "face_sizes": starts["n_faces"][-1],
                "corners": starts["face_sizes"][-1],
                "actions": starts["n_actions"][-1],
                "outcomes": starts["n_actions"][-1],
                "log_residual": starts["n_actions"][-1],
            }
            odd = [name for name, n in lengths.items() if len(arrays[name]) != n]
            owners = np.repeat(np.repeat(arrays["n_vertices"], arrays["n_faces"]), arrays["face_sizes"])
            in_mesh = (0 <= arrays["corners"]) & (arrays["corners"] < owners)
            codes = arrays["actions"][:, 0]
            in_range = (STOPPED <= arrays["chosen"]) & (arrays["chosen"] < np.maximum(arrays["n_actions"], 0))
            if odd or not in_mesh.all() or not in_range.all() or not np.isfinite(arrays["vertices"]).all():
                return f"{odd[0] if odd else 'an index or a number'} does not fit the rest"
            if len(self.rules) != len(self) or not {*self.rules} <= {*get_args(FaceRule)}:
                return "it names a rule of faces that there is not"
            if len(codes) and not (0 <= codes.min() and codes.max() < len(_NAMES)):
                return "it names an operator that there is not"
        except (KeyError, ValueError, TypeError, IndexError):
            return "an array is missing or of a wrong shape"
        return ""
