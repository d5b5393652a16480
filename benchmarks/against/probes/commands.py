"""Seconds and CPU-seconds of a command, with those of all processes that it starts; and what it logs of its steps."""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any


class Probe:
    def __init__(self, settings: dict[str, Any]) -> None:
        self._words = settings["words"]
        if settings["warm"]:
            self.measure(0)

    def measure(self, turn: int) -> dict[str, float]:
        with tempfile.TemporaryDirectory(prefix="against-") as folder:
            line = [f"{folder}/out" if word == "OUT" else word for word in self._words]
            return _measured(line, Path(folder))


def _measured(line: list[str], folder: Path) -> dict[str, float]:
    began = time.perf_counter()
    with (folder / "said").open("w+") as said:
        process = subprocess.Popen([sys.executable, *line], stdin=subprocess.DEVNULL, stdout=said, stderr=said)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        wall = time.perf_counter() - began
        if process.returncode:
            said.seek(0)
            raise RuntimeError((said.read().strip().splitlines() or ["it said nothing"])[-1])
    found = {"wall": wall, "cpu": usage.ru_utime + usage.ru_stime}
    log = folder / "out" / "log.jsonl"
    return {**found, **_logged(log)} if log.exists() else found


def _logged(log: Path) -> dict[str, float]:
    """Steps a second of a training, of the last line that has them."""
    lines = map(json.loads, log.read_text(encoding="utf-8").splitlines())
    rates = [line["train/steps_per_second"] for line in lines if "train/steps_per_second" in line]
    if not rates:
        raise RuntimeError("the training's log has no steps a second: it was too short")
    return {"steps": rates[-1]}
