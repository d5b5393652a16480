"""Runs one recipe of examples/rl and counts what it does: `python -m benchmarks.rl_watch MODULE VERSIONS_OF ...`.

It runs in the library's own installation, so it imports nothing but the environment, and counts there, in every step
that is taken: what the recipe, or its library, says of itself does not matter. It ends with a line of JSON.
"""

import json
import runpy
import sys
import time
from importlib.metadata import version
from typing import Any

from autopoly_env.compute import Routine
from autopoly_env.env import AutoPolyEnv


def main(module: str, *distributions: str) -> None:
    """Run the recipe as a program; then print the steps, the illegal ones among them, the seconds, the versions."""
    counts = {"steps": 0, "illegal": 0}
    routine = AutoPolyEnv.step_routine

    def counted(self: AutoPolyEnv, action: Any) -> Routine[tuple[Any, ...]]:
        outcome = yield from routine(self, action)
        counts["steps"] += 1
        counts["illegal"] += bool(outcome[4]["invalid_action"])
        return outcome

    AutoPolyEnv.step_routine = counted  # type: ignore[method-assign]
    began = time.monotonic()
    runpy.run_module(module, run_name="__main__")
    seconds = time.monotonic() - began
    print(json.dumps({**counts, "seconds": seconds, "versions": {name: version(name) for name in distributions}}))


if __name__ == "__main__":
    main(*sys.argv[1:])
