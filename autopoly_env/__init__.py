"""The world: what a mesh is, what an action does, what it is worth. Importing it makes the environments known.

The names in `__all__` are loaded when they are first asked for, so that importing stays light.
"""

import sys as _sys
from collections.abc import Sequence as _Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec as _ModuleSpec
from importlib.machinery import PathFinder as _PathFinder
from types import ModuleType as _ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from autopoly_env.mesh import PolyMesh
    from autopoly_env.operators import OPERATORS, STOP, Action, Operator
    from autopoly_env.score import Score, ScoreWeights
    from autopoly_env.sequence import ConstructionSequence
    from autopoly_env.silhouette import Silhouette, load_silhouette
    from autopoly_env.simulator import Simulator, State

__version__ = "0.1.0"

__all__ = [
    "OPERATORS",
    "STOP",
    "Action",
    "ConstructionSequence",
    "Operator",
    "PolyMesh",
    "Score",
    "ScoreWeights",
    "Silhouette",
    "Simulator",
    "State",
    "load_silhouette",
]

_ROOMS = {
    "mesh": ("PolyMesh",),
    "operators": ("OPERATORS", "STOP", "Action", "Operator"),
    "score": ("Score", "ScoreWeights"),
    "sequence": ("ConstructionSequence",),
    "silhouette": ("Silhouette", "load_silhouette"),
    "simulator": ("Simulator", "State"),
}
_ROOM_OF = {name: room for room, names in _ROOMS.items() for name in names}

# What differs between the environments; docs/environment.md says why.
_ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "AutoPoly-v0": {},
    "AutoPolyObjects-v0": {
        "targets": "objects",
        "operators": "full",
        "w_sc": 0.3,
        "max_steps": 40,
        "max_vertices": 64,
    },
    "AutoPolyFolder-v0": {
        "targets": None,  # a folder, to be given
        "operators": "full",
        "w_sc": 0.3,
        "max_steps": 40,
        "max_vertices": 64,
    },
}


def __getattr__(name: str) -> Any:
    if name not in _ROOM_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_ROOM_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


def _make_known(registration: _ModuleType) -> None:
    for name, settings in _ENVIRONMENTS.items():
        if name not in registration.registry:
            registration.register(
                name,
                entry_point="autopoly_env.env:AutoPolyEnv",
                vector_entry_point="autopoly_env.vector_env:AutoPolyVectorEnv",
                kwargs=settings,
                order_enforce=False,  # the environment refuses steps out of turn itself
            )


class _OnArrival:
    """A finder of modules that makes the environments known once Gymnasium is there, without importing it before.

    Its import takes as long as that of NumPy, and who traces an image needs none of it.
    """

    def find_spec(
        self, name: str, path: _Sequence[str] | None, target: _ModuleType | None = None
    ) -> _ModuleSpec | None:
        if name != _REGISTRATION:
            return None
        _sys.meta_path.remove(self)
        spec = _PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None:
            load = spec.loader.exec_module

            def load_and_tell(module: _ModuleType) -> None:
                load(module)
                _make_known(module)

            spec.loader.exec_module = load_and_tell  # type: ignore[method-assign]
        return spec


_REGISTRATION = "gymnasium.envs.registration"
if _REGISTRATION in _sys.modules:
    _make_known(_sys.modules[_REGISTRATION])
else:
    _sys.meta_path.insert(0, _OnArrival())
