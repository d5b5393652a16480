"""Vector environments in worker processes: the same numbers as here, and ends that leave nothing behind."""

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from autopoly_env.compute import set_threads
from autopoly_env.errors import ConfigError, EpisodeError, IllegalActionError, WorkerError
from autopoly_env.operators import OPERATORS, preset
from autopoly_env.vector_env import AutoPolyVectorEnv, WorkersVectorEnv
from tests.helpers.many import MODES, NAME, SMALL, rollout, same
from tests.helpers.paths import ROOT
from tests.helpers.sources import Exhausted, NamedAfterThreads, Unsendable

pytestmark = pytest.mark.slow  # processes start

CONTEXTS = [name for name in ("spawn", "fork") if name in multiprocessing.get_all_start_methods()]
QUICK = CONTEXTS[-1]
LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc who is alive")


@contextmanager
def working(n: int = 3, workers: int = 2, **settings: Any) -> Iterator[WorkersVectorEnv]:
    settings = {**SMALL, "context": QUICK, **settings}
    way = "vector_entry_point"
    envs = gymnasium.make_vec(NAME, num_envs=n, vectorization_mode=way, workers=workers, **settings)
    try:
        assert isinstance(envs, WorkersVectorEnv)
        yield envs
    finally:
        envs.close()


def raised_by(call: Callable[[], Any]) -> tuple[type[BaseException], str]:
    with pytest.raises(Exception) as caught:
        call()
    return caught.type, str(caught.value)


def pids(envs: WorkersVectorEnv) -> list[int]:
    return [process.pid or 0 for process in envs._workers._processes]


def are_gone(processes: list[int], seconds: float = 20.0) -> bool:
    """Whether all of them have ended, or do within these seconds."""
    end = time.monotonic() + seconds
    while any(is_alive(pid) for pid in processes):
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


# --- the same numbers ---


@pytest.mark.parametrize("context", CONTEXTS)
@pytest.mark.parametrize("mode", MODES, ids=str)
def test_workers__give_what_one_process_gives(mode: AutoresetMode, context: str) -> None:
    here = AutoPolyVectorEnv(5, autoreset_mode=mode, info_texts=True, **SMALL)
    with working(5, autoreset_mode=mode, info_texts=True, context=context) as there:
        ours, theirs = rollout(there, 250, mode), rollout(here, 250, mode)
    assert len(ours) == len(theirs)
    assert all(same(a, b) for x, y in zip(ours, theirs, strict=True) for a, b in zip(x, y, strict=True))


def test_seeds_and_masks__are_those_of_one_process() -> None:
    here = AutoPolyVectorEnv(4, **SMALL)
    with working(4, workers=3) as there:
        for seed in (3, [8, 2, 5, 1], [8, None, 5, 1]):
            ours, theirs = there.reset(seed=seed), here.reset(seed=seed)
            assert all(same(a[key][0], b[key][0]) for a, b in zip(ours, theirs, strict=True) for key in a)
            assert seed == [8, None, 5, 1] or same(ours[0], theirs[0])
        for envs in (here, there):
            envs.reset(seed=3)
        for k in range(4):
            mask = np.arange(4) == k
            for _ in range(2):
                ours, theirs = (envs.reset(options={"reset_mask": mask}) for envs in (there, here))
                assert all(same(a, b) for a, b in zip(ours, theirs, strict=True))
                assert ours[1]["_r_all"].tolist() == mask.tolist()
        for bad in ([True] * 4, np.ones(4), np.ones(3, bool), np.zeros(4, bool)):
            calls = [partial(envs.reset, options={"reset_mask": bad}) for envs in (there, here)]
            assert raised_by(calls[0])[0] is raised_by(calls[1])[0]
        for seeds in ([1, 2], "ab"):
            assert raised_by(partial(there.reset, seed=seeds))[0] is ValueError


def test_options__reach_every_worker() -> None:
    options = {"target": np.pad(np.ones((16, 8), bool), 8)}
    here = AutoPolyVectorEnv(3, **SMALL)
    with working() as there:
        assert all(same(a, b) for a, b in zip(there.reset(options=options), here.reset(options=options), strict=True))
        assert raised_by(partial(there.reset, options={"no": 1})) == raised_by(partial(here.reset, options={"no": 1}))


def test_calls_and_attributes__are_those_of_one_process() -> None:
    settings = {"render_mode": "rgb_array", "render_size": 32}
    here = AutoPolyVectorEnv(3, **SMALL, **settings)
    with working(**settings) as there:
        for envs in (here, there):
            envs.reset(seed=1)
            envs.step([1, 0, 2])
            envs.set_attr("note", ["a", "b", "c"])
            envs.set_attr("other", 7)
        assert np.array_equal(here.action_masks(), there.action_masks())
        assert all(np.array_equal(a, b) for a, b in zip(here.render() or (), there.render() or (), strict=True))
        assert there.get_attr("note") == ("a", "b", "c") and there.get_attr("other") == (7, 7, 7)
        assert here.np_random_seed == there.np_random_seed == (1, 2, 3)
        states = there.call("clone_state")
        assert [state.state.score for state in states] == [s.state.score for s in here.call("clone_state")]
        there.call("restore_state", states[1])
        assert [state.state.done for state in there.call("clone_state")] == ["stop"] * 3
        assert raised_by(lambda: there.call("nothing"))[0] is raised_by(lambda: here.call("nothing"))[0]
        assert raised_by(lambda: there.set_attr("note", [1]))[0] is raised_by(lambda: here.set_attr("note", [1]))[0]
        assert (there.num_envs, there.render_mode, there.autoreset_mode) == (3, "rgb_array", AutoresetMode.NEXT_STEP)
        for space in ("action_space", "single_action_space", "observation_space", "single_observation_space"):
            assert getattr(there, space) == getattr(here, space)
        assert there.metadata == here.metadata
        assert there.observation_space.contains(there.reset()[0])


def test_observations__stay_as_they_were_given() -> None:
    with working() as envs:
        first = envs.reset(seed=0)[0]
        before = pickle.dumps(first)
        envs.step([1, 1, 1])
        assert pickle.dumps(first) == before


# --- what is refused ---


@pytest.mark.parametrize("actions", [[0], [0, 0, 9999], [0, -1, 0], [0.0, 1.0, 2.0]], ids=str)
def test_actions_that_do_not_exist__are_refused_before_anybody_moves(actions: Any) -> None:
    with working() as envs:
        envs.reset(seed=0)
        with pytest.raises(IllegalActionError, match="expected"):
            envs.step(actions)
        assert [state.state.step for state in envs.call("clone_state")] == [0, 0, 0]


def test_step_out_of_turn__is_refused_and_moves_nobody() -> None:
    with working(autoreset_mode="Disabled") as envs:
        with pytest.raises(EpisodeError, match=r"reset\(\)"):
            envs.step([0, 0, 0])
        envs.reset(seed=0)
        envs.step([1, 0, 1])
        with pytest.raises(EpisodeError, match=r"environments \[1\] have ended"):
            envs.step([1, 1, 1])
        assert [state.state.step for state in envs.call("clone_state")] == [1, 0, 1]
        envs.reset(options={"reset_mask": np.array([False, True, False])})
        envs.step([1, 1, 1])


@pytest.mark.parametrize(
    "bad", [{"workers": 0}, {"workers": True}, {"workers": 1.5}, {"workers": "2"}, {"context": "thread"}], ids=str
)
def test_bad_setting__is_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match=f"{next(iter(bad))}=.*expected"):
        AutoPolyVectorEnv(2, **bad, **SMALL)


def test_workers__are_at_most_as_many_as_environments() -> None:
    assert type(AutoPolyVectorEnv(1, workers=4, **SMALL)) is AutoPolyVectorEnv
    assert type(AutoPolyVectorEnv(2, **SMALL)) is AutoPolyVectorEnv
    with working(2, workers=5) as envs:
        assert len(pids(envs)) == 2


@pytest.mark.parametrize("context", CONTEXTS)
def test_settings_that_do_not_pickle__are_refused_in_one_line(context: str) -> None:
    with pytest.raises(ConfigError, match="settings cannot be sent to worker processes") as caught:
        AutoPolyVectorEnv(2, workers=2, context=context, targets=Unsendable(), **SMALL)
    assert "\n" not in str(caught.value)
    with working(2) as envs, pytest.raises(ConfigError, match="what a worker is asked cannot be sent"):
        envs.set_attr("note", lambda: 1)
    with pytest.raises(TypeError, match="do not pickle"):
        pickle.dumps(envs)


def test_answer_that_does_not_pickle__is_an_error_and_no_end() -> None:
    with working(2) as envs:
        envs.reset(seed=0)
        with pytest.raises(Exception, match="pickle") as caught:
            envs.get_attr("reset_routine")
            envs.call("reset_routine")
        assert "environments 0 to 0" in caught.value.__notes__[0]
        envs.step([1, 1])


# --- parts from outside ---


def test_operator_from_outside__is_known_to_spawned_workers() -> None:
    preset("examples.edge_collapse:edge_collapse")
    assert "edge_collapse" in OPERATORS
    settings: dict[str, Any] = {"operators": "full,edge_collapse"}  # by a name that only this process knows
    here = AutoPolyVectorEnv(2, **SMALL, **settings)
    with working(2, context="spawn", **settings) as there:
        ours, theirs = (rollout(envs, 5, AutoresetMode.NEXT_STEP) for envs in (there, here))
        assert all(same(a, b) for x, y in zip(ours, theirs, strict=True) for a, b in zip(x, y, strict=True))


@pytest.mark.parametrize(("threads", "expected"), [(1, "1"), (2, "1"), (5, "2")])
def test_workers__share_the_threads(threads: int, expected: str) -> None:
    set_threads(threads)
    try:
        with working(2, targets=NamedAfterThreads(), info_texts=True) as envs:
            assert envs.reset()[1]["target"].tolist() == [expected] * 2
    finally:
        set_threads(None)


@pytest.mark.parametrize("context", CONTEXTS)
def test_error_of_a_source__comes_as_what_it_was(context: str) -> None:
    with working(2, targets=Exhausted(), context=context) as envs:
        for _ in range(2):
            with pytest.raises(LookupError, match="nothing for\nseed") as caught:
                envs.reset()
            (note,) = caught.value.__notes__
            assert note.startswith("in the worker process of environments 0 to 0: LookupError: nothing for seed")
            assert "sources.py line" in note and "\n" not in note


# --- ends ---


@LINUX
def test_worker_that_died__is_one_line_and_ends_the_others() -> None:
    with working(4) as envs:
        envs.reset(seed=0)
        workers = pids(envs)
        os.kill(workers[1], signal.SIGKILL)
        for _ in range(2):
            with pytest.raises(
                WorkerError, match=r"process of environments 2 to 3 has died \(signal SIGKILL\)"
            ) as caught:
                envs.step([1, 1, 1, 1])
            assert "\n" not in str(caught.value)
        assert are_gone(workers)


@LINUX
def test_close__ends_the_workers_and_may_be_called_twice() -> None:
    with working() as envs:
        workers = pids(envs)
    envs.close()
    assert are_gone(workers, 0.0)
    for call in (envs.reset, partial(envs.step, [0, 0, 0]), envs.action_masks):
        with pytest.raises(WorkerError, match="have been closed: make new"):
            call()


SCRIPT = f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
from autopoly_env.vector_env import AutoPolyVectorEnv

def main(context):
    envs = AutoPolyVectorEnv(4, workers=2, context=context, resolution=16, obs_resolution=16)
    envs.reset(seed=0)
    print(*(process.pid for process in envs._workers._processes), flush=True)
    while True:
        envs.step([1, 1, 1, 1])
"""


@contextmanager
def running(folder: Path, end: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    (folder / "script.py").write_text(SCRIPT + end)
    command = [sys.executable, str(folder / "script.py"), *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@LINUX
@pytest.mark.parametrize("context", CONTEXTS)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL], ids=lambda number: number.name)
def test_end_of_the_parent__ends_the_workers(number: signal.Signals, context: str, tmp_path: Path) -> None:
    with running(tmp_path, "if __name__ == '__main__': main(sys.argv[1])", context) as process:
        assert process.stdout is not None and process.stderr is not None
        workers = [int(pid) for pid in process.stdout.readline().split()]
        assert len(workers) == 2 and all(map(is_alive, workers))
        if number == signal.SIGINT:
            os.killpg(process.pid, number)  # to all processes, as a terminal does
        else:
            process.send_signal(number)
        assert are_gone(workers)
        said = process.stderr.read()
    assert said.count("Traceback") == (number == signal.SIGINT), said


@LINUX
def test_script_without_a_guard__is_told_of_it(tmp_path: Path) -> None:
    with running(tmp_path, "main('spawn')") as process:
        _, said = process.communicate(timeout=120)
    assert process.returncode == 1
    assert "has died (exit code 1) before it was ready; a script starts workers under `if __name__" in said
