"""All kernels compiled beforehand: by a process for each part, once, and told how far it is."""

import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from autopoly_env import warm
from autopoly_env.compute import jit
from tests.helpers.paths import ROOT

DONE, BROKEN = "pass", "raise SystemExit(3)"


def standing_in(code: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", code])


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """The parts whose processes were started, in place of which others are that do nothing."""
    parts: list[str] = []

    def begin(part: str) -> subprocess.Popen[bytes]:
        parts.append(part)
        return standing_in(DONE)

    monkeypatch.setattr(warm, "_begin", begin)
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    return parts


def test_parts__can_all_be_called() -> None:
    for place in warm.PARTS.values():
        module, _, name = place.partition(":")
        assert callable(getattr(import_module(module), name))


def test_kernels__are_compiled_once(begun: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    warm.ensure()
    assert begun == list(warm.PARTS)
    said = capsys.readouterr().err
    assert "compiling the numeric kernels (refit, operators, pictures, outlines)" in said and "compiled, in" in said
    warm.ensure()
    assert begun == list(warm.PARTS) and not capsys.readouterr().err


def test_kernels__are_compiled_anew_for_another_machine(begun: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    warm.ensure()
    monkeypatch.setattr(jit, "machine", lambda: b"another")
    warm.ensure()
    assert begun == 2 * list(warm.PARTS)


def test_part_that_fails__is_tried_again_next_time(
    begun: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(warm, "_begin", lambda _: standing_in(BROKEN))
    warm.ensure()
    assert warm.main([]) == 1
    assert "not all kernels could be compiled" in capsys.readouterr().err
    monkeypatch.undo()


def test_nowhere_to_keep_them__means_that_nothing_is_begun(begun: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "cache_folder", lambda: None)
    warm.ensure()
    assert not begun


@pytest.mark.parametrize("arguments", [["--once"], []])
def test_process_that_waits_for_another__says_so(
    arguments: list[str], begun: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other one is done when it has been told twice that it is waited for; only who insists looks once more."""
    fcntl = pytest.importorskip("fcntl")
    note = warm._note()
    assert note is not None
    monkeypatch.setattr(warm, "_PULSE", 0.0)
    said: list[str] = []
    with note.with_suffix(".lock").open("w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)

        def say(line: str) -> None:
            said.append(line)
            assert not begun or len(said) > 2
            if len(said) == 2:
                note.touch()
                fcntl.flock(other, fcntl.LOCK_UN)

        monkeypatch.setattr(warm, "_say", say)
        assert warm.main(arguments) == 0
    assert said[0].startswith("another process is compiling the numeric kernels") and said[1].startswith("  waiting, ")
    assert begun == ([] if arguments else list(warm.PARTS))


COMMANDS = (
    "agents.solve examples/mug.png --refits 60 --out OUT/mug",
    "agents.solve examples/key.png --style modeller --refits 60 --out OUT/key",
    "agents.solve examples/padlock.png --agent greedy --symmetry auto --refits 60 --out OUT/padlock",
    "agents.vary OUT/mug/mug/sequence.json --out OUT/vary",
    "agents.retarget OUT/mug/mug/sequence.json examples/bottle.png --out OUT/retarget",
    "training.evaluate examples --agents greedy,trace --budget refits=30 --engine serial --out OUT/evaluate",
    "training.make_expert OUT/expert --n 64 --engine serial source=simulator",
)


@pytest.mark.slow  # all kernels are compiled from nothing
def test_commands__find_everything_compiled_after_it(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    environment.pop(jit.ALONE, None)
    for line in ("autopoly_env.warm", *COMMANDS):
        command = [sys.executable, "-m", *line.replace("OUT", str(tmp_path)).split()]
        done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, timeout=900)
        assert done.returncode == 0, done.stderr
        assert ("compiling" in done.stderr) == (line == "autopoly_env.warm"), (line, done.stderr)


STEP = """
import sys
from autopoly_env.env import AutoPolyEnv
env = AutoPolyEnv(resolution=32)
for seed in range(2):
    _, info = env.reset(seed=seed)
    for _ in range(3):
        _, _, terminated, truncated, info = env.step(int(info["action_mask"].nonzero()[0][-1]))
        if terminated or truncated:
            break
print("numba.np.linalg" in sys.modules)
"""


@pytest.mark.slow
def test_kernels_of_a_step__are_loaded_without_what_numba_needs_of_scipy() -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for _ in range(2):  # the first may compile, which imports it
        said = subprocess.run(
            [sys.executable, "-c", STEP], env=environment, capture_output=True, text=True, timeout=900
        )
    assert said.stdout == "False\n", said.stderr
