"""A play as it is kept: a target by its seed, the rules, and what a search found out about some of the states.

    {"version": 1, "target": "objects:77", "style": "modeller", "w_sc": 0.3, "refits": 300, "best": 83.1,
     "states": [...]}

Operators are named, so that a list of operators that grows changes nothing. Letters: V vertices, A legal actions.
"""

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from autopoly_env.arguments import first_defect
from autopoly_env.errors import AutoPolyError, RunError
from autopoly_env.files import write_atomically
from autopoly_env.mesh import FaceRule, PolyMesh
from autopoly_env.operators import Action, legal_actions, preset
from autopoly_env.score import ScoreWeights
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator
from autopoly_env.targets import make_targets

VERSION = 1
RESOLUTION = 128  # pixels a side
Style = Literal["modeller", "paper"]
RULES: dict[Style, tuple[str, FaceRule]] = {"modeller": ("modeller", "quads"), "paper": ("full", "any")}


@dataclass(frozen=True)
class SearchedState:
    """A state, its legal actions, and what the search found behind each."""

    vertices: tuple[tuple[float, float], ...]  # (V, 2) unit square
    faces: tuple[tuple[int, ...], ...]
    total: float  # r_all
    best: float  # of the best shape that was found from here on
    actions: tuple[tuple[str, int], ...]  # (A,) operator and element, without STOP
    found: tuple[float | None, ...]  # (A,) the best r_all behind each action, None where it was not tried
    visits: tuple[int, ...]  # (A,)

    def mesh(self) -> PolyMesh:
        """Raises MeshError where the numbers are no mesh."""
        return PolyMesh.from_faces(np.array(self.vertices, float).reshape(-1, 2), self.faces)


@dataclass(frozen=True)
class Play:
    """What one search on one target has to teach."""

    target: str  # KIND:SEED
    style: Style
    w_sc: Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
    refits: int
    best: Annotated[float, Field(allow_inf_nan=False)]
    states: tuple[SearchedState, ...]
    version: int = VERSION

    def silhouette(self) -> Silhouette:
        return target_of(self.target)

    def simulator(self) -> Simulator:
        return simulator_of(self.silhouette(), self.style, self.w_sc)

    def save(self, path: Path) -> Path:
        """Write it, whole or not at all. Raises OutputError."""
        return write_atomically(path, json.dumps(asdict(self), allow_nan=False) + "\n")

    @classmethod
    def load(cls, path: Path) -> "Play":
        """Raises RunError, in one line, for half a file, for one of another version, and as `check`."""
        try:
            values: Any = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise RunError(f"cannot read {path} ({error.strerror}); delete it, and it is played again") from None
        except (ValueError, RecursionError):
            raise RunError(f"{path}: torn: half a play or none; delete it, and it is played again") from None
        version = values.get("version") if isinstance(values, dict) else None
        if version != VERSION:
            raise RunError(f"{path}: a play of version {version!r}; this program reads {VERSION}: play again")
        try:
            play = _PLAY.validate_python(values)
            play.check()
        except ValidationError as error:
            raise RunError(f"{path}: {first_defect(error)}; delete it, and it is played again") from None
        except AutoPolyError as error:
            raise RunError(f"{path}: {error}; delete it, and it is played again") from None
        return play

    def check(self) -> None:
        """Raise RunError where a label is of an action that is not legal, or not a number; MeshError for no mesh."""
        names = [operator.name for operator in preset(RULES[self.style][0])]
        for number, state in enumerate(self.states):
            if not len(state.actions) == len(state.found) == len(state.visits):
                raise RunError(f"state {number} has {len(state.actions)} actions, but not as many labels")
            known = (state.total, state.best, *(value for value in state.found if value is not None))
            if not all(map(math.isfinite, known)):
                raise RunError(f"state {number} has a label that is not a number")
            legal = set(legal_actions(state.mesh(), names))
            odd = [action for action in state.actions if Action(*action) not in legal]
            if odd:
                raise RunError(f"state {number} has a label for {odd[0][0]} {odd[0][1]}, which is not legal there")


_PLAY = TypeAdapter(Play)


def target_of(name: str) -> Silhouette:
    """The target that KIND:SEED names."""
    kind, _, seed = name.partition(":")
    return make_targets(kind, resolution=RESOLUTION).sample(int(seed))


def simulator_of(silhouette: Silhouette, style: Style, w_sc: float) -> Simulator:
    """The rules of a style, at 128 x 128."""
    operators, faces = RULES[style]
    weights = ScoreWeights(w_sc=w_sc)
    return Simulator(silhouette, operators=operators, faces=faces, resolution=RESOLUTION, weights=weights)
