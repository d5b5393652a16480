"""`map_tasks`: the same results from every engine, whatever happens to the workers."""

import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from autopoly_env.errors import ConfigError
from tests.helpers.odd_jobs import Job, do
from tests.helpers.paths import ROOT
from training import parallel
from training.parallel import map_tasks

pytestmark = pytest.mark.slow  # processes start and are killed, Ray is loaded

needs_ray = pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed: pip install -e '.[cluster]'")
SQUARES: list[Job] = [("square", x) for x in range(20)]


def results(jobs: list[Job], **options: Any) -> dict[Job, Any]:
    """The value or else the error of every job."""
    return {done.task: done.value if done.error is None else done.error for done in map_tasks(do, jobs, **options)}


def is_running(pid: int) -> bool:
    """Whether there is such a process, zombies aside."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until(holds: Any, seconds: float = 15.0) -> bool:
    deadline = time.monotonic() + seconds
    while not holds() and time.monotonic() < deadline:
        time.sleep(0.02)
    return bool(holds())


@pytest.mark.parametrize(("engine", "n_workers"), [("serial", None), ("process", 1), ("process", 3)])
def test_every_task__is_done_once(engine: str, n_workers: int | None) -> None:
    begun: list[Job] = []
    done = list(map_tasks(do, SQUARES, engine=engine, n_workers=n_workers, on_start=begun.append))
    assert sorted(one.value or 0 for one in done) == [x * x for x in range(20)]
    assert {one.task: one.value for one in done} == {("square", x): x * x for x in range(20)}
    assert begun == SQUARES


@pytest.mark.parametrize("engine", ["serial", "process"])
def test_exception__fails_its_task_alone_in_one_line(engine: str) -> None:
    found = results([("square", 2), ("fail", "five\nis bad"), ("square", 3)], engine=engine, n_workers=1)
    assert found[("square", 2)] == 4
    assert found[("square", 3)] == 9
    assert found[("fail", "five\nis bad")].startswith("ValueError: five is bad (in odd_jobs.py line ")


def test_dead_worker__is_noticed_and_its_task_tried_again(tmp_path: Path) -> None:
    jobs: list[Job] = [*SQUARES[:5], ("exit", 7), ("die once", str(tmp_path / "flag")), *SQUARES[5:]]
    found = results(jobs, engine="process", n_workers=2)
    assert found.pop(("exit", 7)) == "its worker died 2 times (exit code 7)"
    assert found.pop(("die once", str(tmp_path / "flag"))) == "survived"
    assert found == {("square", x): x * x for x in range(20)}


def test_worker__has_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    found = results([("threads", None)], engine="process", n_workers=1)
    assert found[("threads", None)] == ("1", 1)
    assert os.environ["OMP_NUM_THREADS"] == "3"  # what is set for workers is not left behind


def test_large_tasks_and_results__pass_and_others_are_told(tmp_path: Path) -> None:
    big = "x" * 3_000_000
    assert results([("length", big)], engine="process", n_workers=1)[("length", big)] == 3_000_000
    (problem,) = results([("lambda", 1)], engine="process", n_workers=1).values()
    assert problem.startswith("the result cannot be sent: ")


@pytest.mark.parametrize(("engine", "most"), [("serial", 1), ("process", 2)])
def test_tasks__are_read_only_as_they_are_taken(engine: str, most: int) -> None:
    n_read = 0

    def endless() -> Iterator[Job]:
        nonlocal n_read
        while True:
            n_read += 1
            yield "square", n_read

    with closing(map_tasks(do, endless(), engine=engine, n_workers=most)) as stream:
        for n_done, _ in zip(range(1, 200), stream, strict=False):
            assert n_read <= n_done + most


def test_closing__stops_the_workers(tmp_path: Path) -> None:
    pid_file = tmp_path / "pid"
    stream = map_tasks(do, [("linger", str(pid_file)), ("square", 1)], engine="process", n_workers=2)
    assert next(stream).value == 1
    assert wait_until(lambda: pid_file.exists() and pid_file.read_text())
    pid = int(pid_file.read_text())
    assert is_running(pid)
    stream.close()
    assert not is_running(pid)


def test_killed_parent__leaves_no_worker_behind(tmp_path: Path) -> None:
    pid_file = tmp_path / "pid"
    code = (
        "from tests.helpers.odd_jobs import do; from training.parallel import map_tasks\n"
        f"if __name__ == '__main__': list(map_tasks(do, [('linger', {str(pid_file)!r})], n_workers=1))"
    )
    script = tmp_path / "script.py"
    script.write_text(code)
    with subprocess.Popen([sys.executable, script], env=os.environ | {"PYTHONPATH": str(ROOT)}) as parent:
        assert wait_until(lambda: pid_file.exists() and pid_file.read_text())
        pid = int(pid_file.read_text())
        assert is_running(pid)
        parent.send_signal(signal.SIGKILL)
    assert wait_until(lambda: not is_running(pid), 5.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"engine": "dask"}, "engine 'dask' is unknown; give one of serial, process, ray"),
        ({"n_workers": 0}, "0 workers: expected at least 1"),
        ({"address": "auto"}, "a Ray address is of no use to the engine 'process'"),
    ],
)
def test_settings_out_of_range__are_refused_before_anything_starts(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        map_tasks(do, SQUARES, **options)


def test_engine_ray__without_ray_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ConfigError, match=r"the engine ray needs Ray; pip install -e '.\[cluster\]'"):
        map_tasks(do, SQUARES, engine="ray")


@needs_ray
def test_ray__does_what_the_other_engines_do() -> None:
    odd: list[Job] = [("fail", "bad"), ("exit", 7), ("variable", "AUTOPOLY_THREADS")]
    found = results([*SQUARES, *odd], engine="ray", n_workers=2)
    assert found.pop(("fail", "bad")).startswith("ValueError: bad (in odd_jobs.py")
    assert found.pop(("exit", 7)).startswith("its worker died 2 times (")
    assert found.pop(("variable", "AUTOPOLY_THREADS")) == "1"
    assert found == {("square", x): x * x for x in range(20)}


@needs_ray
def test_ray_address__where_nobody_answers_is_one_line_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    assert parallel.RAY_PATIENCE <= 13.0  # so that it is told within 15 seconds
    monkeypatch.setattr(parallel, "RAY_PATIENCE", 3.0)
    with socket.socket() as mute:  # takes connections and says nothing
        mute.bind(("127.0.0.1", 0))
        mute.listen()
        address = f"127.0.0.1:{mute.getsockname()[1]}"
        began = time.monotonic()
        with pytest.raises(ConfigError, match=rf"no Ray cluster answers at '{address}' \(nothing within 3 seconds\)"):
            map_tasks(do, SQUARES, engine="ray", address=address)
    assert time.monotonic() - began < 5.0
    with pytest.raises(ConfigError, match=r"no Ray cluster answers at 'auto' \(.*\); start one"):
        map_tasks(do, SQUARES, engine="ray", address="auto")


@needs_ray
def test_node_that_dies__costs_its_tasks_no_try(monkeypatch: pytest.MonkeyPatch) -> None:
    from ray.cluster_utils import Cluster

    monkeypatch.setattr(parallel, "N_TRIES", 1)  # so that a loss which counted would fail a task
    monkeypatch.setattr(parallel, "RAY_PATIENCE", 60.0)
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    node = cluster.add_node(num_cpus=1)  # a raylet of its own, in a process of its own
    jobs: list[Job] = [("slow square", x) for x in range(24)]
    try:
        stream = map_tasks(do, jobs, engine="ray", address=cluster.address)
        done = [next(stream)]
        node.kill_raylet()
        done.extend(stream)
    finally:
        cluster.shutdown()
    assert {one.task: (one.value, one.error) for one in done} == {job: (job[1] ** 2, None) for job in jobs}


def test_task_lost_far_too_often__is_given_up_and_says_to_what() -> None:
    job: parallel._Job[str] = parallel._Job("much")
    for _ in range(parallel.N_LOSSES - 1):
        job, done = parallel._after_loss(job, "OutOfMemoryError")
        assert done is None and 0.0 <= parallel._pause(job) <= parallel.MOST_PAUSE
    _, done = parallel._after_loss(job, "OutOfMemoryError")
    assert done is not None and done.error == "its worker was lost to the system 30 times (OutOfMemoryError)"


MISMATCH = (
    "RuntimeError: Version mismatch: The cluster was started with:\n    Ray: 2.50.0\n    Python: 3.11.7\n"
    "This process on node 10.0.0.2 was started with:\n    Ray: 2.60.0\n    Python: 3.11.7\n"
)


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (
            "gcs_client.cc:210: Failed to get cluster ID: RPC error: InvalidAuthToken: Authentication token is missing",
            "the Ray cluster at 'head:6379' wants another token: start it, its nodes and this command with the same",
        ),
        (
            MISMATCH,
            "the Ray cluster at 'head:6379' runs Ray 2.50.0 and Python 3.11.7, this process Ray 2.60.0 and",
        ),
        (
            "ConnectionError: refused",
            "no Ray cluster answers at 'head:6379' (refused); start one with `ray start --head`",
        ),
    ],
)
def test_ray_address__says_which_of_token_version_and_silence_it_is(said: str, expected: str) -> None:
    told = parallel._why_no_ray("head:6379", said, "refused")
    assert told.startswith(expected) and "\n" not in told


def test_ctrl_c__while_a_worker_starts_waits_until_it_has_started(monkeypatch: pytest.MonkeyPatch) -> None:
    process = multiprocessing.get_context("spawn").Process
    start, started = process.start, []

    def interrupted_start(self: Any) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.1)  # for whichever thread takes it
        start(self)
        started.append(self)

    monkeypatch.setattr(process, "start", interrupted_start)
    over = threading.Event()
    another = threading.Thread(target=over.wait)  # which does not block the signal
    another.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            results(SQUARES, engine="process", n_workers=2)
    finally:
        over.set()
        another.join()
    assert len(started) == 1
    assert wait_until(lambda: not started[0].is_alive())


_STARTS_A_WORKER = {
    "of an evaluation": "from training.parallel import _Worker\nworker = _Worker(do)\npid = worker._process.pid\n",
    "that makes samples": (
        "from training.networks.streams import batches\nmade = batches([{}], 1, 1)\npid = made._workers[0].pid\n"
    ),
}


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the masks of processes are read from /proc")
@pytest.mark.parametrize("start", _STARTS_A_WORKER.values(), ids=_STARTS_A_WORKER)
def test_worker__is_deaf_to_ctrl_c_from_its_first_moment(start: str) -> None:
    # In a process of its own: Python starts more than the worker where it is the first one.
    script = (
        "import os, signal\n"
        "from pathlib import Path\n"
        "from tests.helpers.odd_jobs import do\n"
        "if __name__ == '__main__':\n"
        f"    {start.replace(chr(10), chr(10) + '    ')}\n"
        "    status = Path(f'/proc/{pid}/status').read_text()\n"
        "    print(next(line for line in status.splitlines() if line.startswith('SigBlk')).split()[1], flush=True)\n"
        "    os.kill(pid, signal.SIGKILL)\n"
        "    os._exit(0)\n"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT)
    assert "Traceback" not in run.stderr
    assert int(run.stdout, 16) >> signal.SIGINT - 1 & 1
