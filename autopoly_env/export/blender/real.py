"""Real Blender, as a subprocess: runs exported scripts there, and compares what they report with the sequence."""

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from autopoly_env.errors import ConfigError, OutputError
from autopoly_env.mesh import PolyMesh
from autopoly_env.sequence import ConstructionSequence

DRIVER = Path(__file__).with_name("driver.py")
TOLERANCE = 1e-5  # of a coordinate, unit square; Blender's floats have 24 bits
VARIABLE = "BLENDER"  # of the environment: the path of the program


@dataclass(frozen=True)
class Job:
    """A script for Blender, and what stands on its command line after the bare `--`."""

    script: Path
    arguments: tuple[str, ...] = ()


def find_blender() -> str:
    """The path of Blender: what the environment variable BLENDER says, or `blender` on the PATH.

    Raises ConfigError, which tells how to get it, if there is none.
    """
    asked = os.environ.get(VARIABLE)
    found = shutil.which(asked or "blender")
    if found is None:
        raise ConfigError(
            f"Blender was not found as {asked or 'blender'!r}; install it (apt-get install --no-install-recommends "
            f"blender python3-numpy, or blender.org) or set {VARIABLE} to the path of the program"
        )
    return found


def run_in_blender(jobs: Sequence[Job], *, seconds: float = 600.0) -> list[str]:
    """Run all scripts in one Blender without a window, each in an empty file; what went wrong with each, or "".

    Raises ConfigError if there is no Blender; OutputError if it breaks down or takes longer than `seconds`.
    """
    asked = [[str(job.script.resolve()), *job.arguments] for job in jobs]
    problems: list[str] = ask_blender(DRIVER, asked, what="scripts", seconds=seconds)
    return problems


def ask_blender(
    driver: Path,
    question: Any,
    *,
    what: str,
    seconds: float,
    screen: Sequence[str] = (),
    look: Sequence[str] = ("-b",),
    options: Sequence[str] = (),
    ends_well: bool = True,
) -> Any:
    """What a driver, run in Blender on a file with a question, leaves in a file of its answer; both are JSON.

    Blender is started by `screen`, if that is given, and with the options `look`; the driver is given `options` after
    the files. Unless it has to have ended well, an answer is enough.
    Raises ConfigError if there is no Blender; OutputError if it breaks down or takes longer than `seconds`, with the
    advice to give fewer of `what`.
    """
    program = find_blender()
    with tempfile.TemporaryDirectory() as folder:
        asked, answer = Path(folder, "question.json"), Path(folder, "answer.json")
        asked.write_text(json.dumps(question), encoding="utf-8")
        command = [*screen, program, *look, "--factory-startup", "--python", str(driver)]
        command += ["--", str(asked), str(answer), *options]
        try:
            done = subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=seconds,
                encoding="utf-8",
                errors="replace",
            )
        except subprocess.TimeoutExpired:
            raise OutputError(f"Blender was stopped after {seconds:g} s; give fewer {what} or more time") from None
        except OSError as error:
            raise ConfigError(f"{command[0]} cannot be run ({error.strerror}); set {VARIABLE} to Blender") from None
        if (done.returncode and ends_well) or not answer.exists():
            last = (done.stdout.strip().splitlines() or ["it said nothing"])[-1]
            raise OutputError(f"Blender broke down with exit code {done.returncode} ({last}); try another version")
        return json.loads(answer.read_text(encoding="utf-8"))


def mismatches(sequence: ConstructionSequence, report: dict[str, Any]) -> list[str]:
    """What a script's `--report` has otherwise than the sequence's meshes, a line each: counts, places, faces."""
    meshes, records = sequence.meshes(), report["steps"]
    if len(records) != len(meshes):
        return [f"Blender made {len(records) - 1} steps of {len(meshes) - 1}"]
    names = ["start", *(step.operator for step in sequence.steps)]
    return [
        f"step {number} ({name}): {defect}"
        for number, (name, mesh, record) in enumerate(zip(names, meshes, records, strict=True))
        for defect in _defects(mesh, record)
    ]


def _defects(mesh: PolyMesh, record: dict[str, Any]) -> list[str]:
    found = []
    if tuple(record["counts"]) != mesh.counts:
        found.append(f"(V, E, F) is {tuple(record['counts'])}, not {mesh.counts}")
    places = record["vertices"]
    if set(places) != set(map(str, mesh.vertex_ids)):
        return [*found, "the vertices have other ids"]
    there = np.array([places[str(name)] for name in mesh.vertex_ids])
    off = np.abs(there - (mesh.vertices * (1, -1) + (0, 1))).max()
    if not off <= TOLERANCE:
        found.append(f"a vertex lies {off:.1e} off")
    faces = {
        str(name): _cycle([mesh.vertex_ids[v] for v in reversed(face)])
        for name, face in zip(mesh.face_ids, mesh.faces, strict=True)
    }
    if {name: _cycle(face) for name, face in record["faces"].items()} != faces:
        found.append("the faces are others")
    return found


def _cycle(face: list[int]) -> list[int]:
    """The corners from the lowest id on."""
    first = face.index(min(face))
    return face[first:] + face[:first]
