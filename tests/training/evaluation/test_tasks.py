"""A task of an evaluation: Ctrl-C is for the run, wherever it comes."""

from types import SimpleNamespace
from typing import Any

import pytest

from training.evaluation import Entry, Suite, tasks
from training.evaluation.targets import ObjectsSpec


@pytest.mark.parametrize("n_before", [0, 1])
def test_ctrl_c__that_an_agent_has_caught_ends_the_run(n_before: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the warm-up, whose solution nobody looks at, and in the task itself."""
    stats = [SimpleNamespace(stats=SimpleNamespace(stopped_by="finished"))] * n_before
    stats.append(SimpleNamespace(stats=SimpleNamespace(stopped_by="interrupted")))
    calls: list[Any] = []

    def solved(*arguments: Any) -> Any:
        calls.append(arguments)
        return stats[len(calls) - 1]

    monkeypatch.setattr(tasks, "solved", solved)
    monkeypatch.setattr(tasks, "_warm", set())
    spec = ObjectsSpec("objects", n=1, resolution=64)
    suite = Suite(spec, (Entry("trace"),), resolution=32)
    with pytest.raises(KeyboardInterrupt):
        tasks.solve_task(suite, tasks.EvalTask("trace", spec.targets()[0], 0))
    assert len(calls) == n_before + 1
