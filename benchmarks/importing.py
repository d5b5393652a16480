"""Rows about `import autopoly_env`: it must be quick, and must not bring torch along."""

import json
import subprocess
import sys
from collections.abc import Iterator

from benchmarks.report import Must, Row

IMPORT_SECONDS = Must("<=", 0.6)
NO_TORCH = Must("<=", 0.0)
_ROUNDS = 5
_PROBE = """
import json, sys, time
began = time.perf_counter()
{statement}
print(json.dumps([time.perf_counter() - began, "torch" in sys.modules]))
"""


def import_rows() -> Iterator[Row]:
    """Best of five imports, each in a fresh process; numpy and numba, which it needs, for comparison."""
    runs = [(_probe("import autopoly_env"), _probe("import numpy, numba")) for _ in range(_ROUNDS)]
    ours, theirs = (min(seconds for seconds, _ in column) for column in zip(*runs, strict=True))
    brings_torch = any(brings for (_, brings), _ in runs)
    yield Row("import autopoly_env", ours, must=IMPORT_SECONDS, unit="s", note=f"numpy and numba alone: {theirs:.2f} s")
    yield Row("torch imported with it", float(brings_torch), must=NO_TORCH, note="0 is no, 1 is yes")


def _probe(statement: str) -> tuple[float, bool]:
    command = [sys.executable, "-c", _PROBE.format(statement=statement)]
    seconds, brings_torch = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return seconds, brings_torch
