"""The world: what a mesh is, what an action does, what it is worth. Importing it makes the environments known."""

from typing import Any

from gymnasium.envs.registration import register, registry

__version__ = "0.1.0"

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

for _name, _settings in _ENVIRONMENTS.items():
    if _name not in registry:
        register(
            _name,
            entry_point="autopoly_env.env:AutoPolyEnv",
            vector_entry_point="autopoly_env.vector_env:AutoPolyVectorEnv",
            kwargs=_settings,
            order_enforce=False,  # the environment refuses steps out of turn itself
        )
