"""Compile all numeric kernels: `python -m autopoly_env.warm`. Commands do so by themselves when they need the first.

The kernels are in parts that hardly share any, and each part is compiled by a process of its own, as many at once as
there are cores; all processes find what is compiled in Numba's cache on disk. A part is a function that calls what it
names: the calls have to be those of real work, for Numba compiles a kernel for the types that it is called with.
"""

import argparse
import contextlib
import hashlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import IO, NoReturn


@contextlib.contextmanager
def _leaving_at_ctrl_c(is_command: bool) -> Iterator[None]:
    """A context in which Ctrl-C ends the command at once, with a line: while it imports what it needs."""

    def leave(*_: object) -> NoReturn:
        os.write(2, b"error: stopped by Ctrl-C\n")
        os._exit(130)

    before = signal.signal(signal.SIGINT, leave) if is_command else None
    try:
        yield
    finally:
        if is_command:
            signal.signal(signal.SIGINT, before)


with _leaving_at_ctrl_c(__name__ == "__main__"):
    import numpy as np

    from autopoly_env.compute import jit, n_threads
    from autopoly_env.details import Details, hairlines
    from autopoly_env.mesh import PolyMesh
    from autopoly_env.observation import Observer
    from autopoly_env.operators import OPERATORS, legal_actions
    from autopoly_env.placement import Disagreement, tried
    from autopoly_env.raster import (
        batch_of,
        coverage,
        coverage_many,
        coverage_vjp,
        loss_and_gradient,
        loss_and_gradient_many,
    )
    from autopoly_env.refit import RefitTarget, mended, refit, tune
    from autopoly_env.score import ScoreWeights, score
    from autopoly_env.silhouette import Silhouette
    from autopoly_env.silhouette.target_kernels import row_ends
    from autopoly_env.targets import ConstructionTargets

PARTS = {  # the longest first; those of the agents are named only, for this package knows none of them
    "refit": "autopoly_env.warm:refits",
    "operators": "autopoly_env.warm:operators",
    "pictures": "autopoly_env.warm:pictures",
    "outlines": "agents.warm:outlines",
}
_PULSE = 4.0  # seconds between two signs of life


def compile_all(parts: Sequence[str] = tuple(PARTS)) -> bool:
    """Compile these parts, each in its own process, and tell on stderr how it goes. Returns whether all went well."""
    n_at_once = max(1, min(len(parts), n_threads()))
    began = said = time.monotonic()
    where = "1 core" if n_at_once == 1 else f"{n_at_once} cores"
    _say(f"compiling the numeric kernels ({', '.join(parts)}) on {where}, once on this machine ...")
    waiting, running, is_well = list(parts), dict[str, subprocess.Popen[bytes]](), True
    try:
        while waiting or running:
            while waiting and len(running) < n_at_once:
                part = waiting.pop(0)
                running[part] = _begin(part)
            for part, process in list(running.items()):
                if process.poll() is not None:
                    is_well &= process.returncode == 0
                    del running[part]
            if time.monotonic() - said > _PULSE:
                said = time.monotonic()
                n_done = len(parts) - len(waiting) - len(running)
                _say(f"  {n_done} of {len(parts)} parts compiled, {said - began:.0f} s")
            time.sleep(0.05)
    finally:
        for process in running.values():
            process.kill()
            process.wait()
    if is_well:
        _say(f"the kernels are compiled, in {time.monotonic() - began:.0f} s")
    return is_well


def ensure() -> None:
    """Compile all kernels, unless that was done before. What then is missing is compiled where it is called."""
    note = _note()
    if note is None or note.exists():
        return
    with _turn(note):
        if not note.exists():
            _compile_and_note(note)


def _compile_and_note(note: Path | None) -> bool:
    """Compile all kernels, and keep a note of it. Returns whether all went well."""
    is_well = compile_all()
    if is_well and note is not None:
        with contextlib.suppress(OSError):
            note.touch()
    return is_well


@contextlib.contextmanager
def _turn(note: Path | None) -> Iterator[None]:
    """Where one process waits for another that does the same, and says so; not where the system cannot do that."""
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):
            if note is not None:
                _wait_for(stack.enter_context(note.with_suffix(".lock").open("w")))
        yield


def _wait_for(stream: IO[str]) -> None:
    """Lock an open file, as soon as no other process has done so."""
    began = said = time.monotonic()
    is_ours = _is_locked(stream)
    if not is_ours:
        _say("another process is compiling the numeric kernels, once on this machine: waiting for it ...")
    while not is_ours:
        if time.monotonic() - said > _PULSE:
            said = time.monotonic()
            _say(f"  waiting, {said - began:.0f} s")
        time.sleep(0.05)
        is_ours = _is_locked(stream)


def _is_locked(stream: IO[str]) -> bool:
    """Lock an open file, unless another process has done so; whether it is ours now, or can be nobody's."""
    try:
        import fcntl

        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except ImportError:
        pass
    return True


def _begin(part: str) -> subprocess.Popen[bytes]:
    environment = os.environ | {jit.ALONE: "0", "PYTHONPATH": os.pathsep.join(path or "." for path in sys.path)}
    command = [sys.executable, "-m", "autopoly_env.warm", "--part", part]
    return subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _note() -> Path | None:
    """The file, beside what is compiled, that says that all of it is; None where nothing can be kept."""
    folder = jit.cache_folder()
    if folder is None:
        return None
    sources = b"".join(jit.stamp_of(Path(root)) for root in _roots())
    return folder / f"warm-{hashlib.sha256(sources + jit.machine()).hexdigest()[:16]}.txt"


def _roots() -> list[str]:
    names = dict.fromkeys(place.partition(".")[0] for place in PARTS.values())
    return [str(Path(import_module(name).__file__ or ".").parent) for name in names]


def _say(line: str) -> None:
    with contextlib.suppress(OSError, ValueError):
        print(f"autopoly_env: {line}" if line[0] != " " else line, file=sys.stderr, flush=True)


# --- the parts ---


def refits() -> None:
    """The refit, whatever its rule, bonds and weights."""
    mesh, silhouette = PolyMesh.rectangle(0.2, 0.2, 0.8, 0.7), _frame()
    refit(mesh, RefitTarget.of(silhouette, 32))


def pictures() -> None:
    """Renderings, scores, the last touch, and what rendering and target disagree about."""
    mesh, silhouette = PolyMesh.rectangle(0.2, 0.2, 0.8, 0.7), _frame()
    target = silhouette.target(32)
    row_ends(target.mask)
    coverage(mesh, 32)
    coverage_many([mesh, mesh], 32)
    loss_and_gradient(mesh, target)
    loss_and_gradient_many([mesh, mesh], target)
    score(mesh, target, ScoreWeights())
    hairlines(mesh, target)
    tune(mesh, target)
    Details.of(silhouette)
    Observer(4, 32, 1).observe(mesh, np.zeros((1, 32, 32), np.uint8), 1)
    coverage_vjp(batch_of([mesh]), np.ones((1, 32, 32)))


def operators() -> None:
    """What operators ask of meshes, and the random constructions."""
    rectangle, silhouette = PolyMesh.rectangle(0.2, 0.2, 0.8, 0.7), _frame()
    mended(PolyMesh.from_faces([(0.2, 0.2), (0.8, 0.2), (0.3, 0.3), (0.2, 0.8)], [(0, 1, 2, 3)]), "quads")  # a dart
    for mesh in (rectangle, _ell()):
        for action in legal_actions(mesh, tuple(OPERATORS))[1:]:
            with contextlib.suppress(Exception):  # some have no room here
                tried(Disagreement(mesh, silhouette), action)
    for source in (ConstructionTargets(), ConstructionTargets(operators="full")):
        for seed in range(4):
            source.sample(seed)


def _end_with(parent: int) -> None:
    """Leave nothing behind that compiles on when who has begun it was killed."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)


def _ell() -> PolyMesh:
    """Three quads about a corner that may be filled."""
    places = [(0.2, 0.2), (0.4, 0.2), (0.4, 0.4), (0.2, 0.4), (0.4, 0.6), (0.2, 0.6), (0.6, 0.4), (0.6, 0.6)]
    return PolyMesh.from_faces(places, [(0, 1, 2, 3), (3, 2, 4, 5), (2, 6, 7, 4)])


def _frame() -> Silhouette:
    mask = np.zeros((32, 32), np.bool_)
    mask[6:26, 6:26] = True
    mask[12:20, 12:20] = False
    return Silhouette(mask)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m autopoly_env.warm",
        description="Compile all numeric kernels, once on this machine, so that nothing else has to wait for them.",
    )
    parser.add_argument("--part", choices=PARTS, help="compile this part only, in this process")
    parser.add_argument("--once", action="store_true", help="unless that was done before")
    given = parser.parse_args(arguments)
    part: str | None = given.part
    if given.once:
        try:
            ensure()
        except KeyboardInterrupt:  # of which whoever asked for it tells
            return 130
        return 0
    if part is not None:
        threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
        module, _, name = PARTS[part].partition(":")
        getattr(import_module(module), name)()
        return 0
    try:
        note = _note()
        with _turn(note):
            is_well = _compile_and_note(note)
        if not is_well:
            print("error: not all kernels could be compiled; they are when they are called", file=sys.stderr)
            return 1
    except KeyboardInterrupt:
        print("error: stopped by Ctrl-C; what is compiled already stays", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
