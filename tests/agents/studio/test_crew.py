"""The process that searches: it heeds orders at once, and whatever becomes of it is told."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from agents.studio.choices import Choices, Task
from agents.studio.crew import Worker
from autopoly_env.errors import AutoPolyError
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import load_silhouette
from tests.helpers.drawings import HOUSE, painted
from tests.helpers.paths import EXAMPLES

pytestmark = pytest.mark.slow  # a process is started

PATIENCE = 60.0  # seconds
LONG = Task(load_silhouette(EXAMPLES / "bicycle.png"), choices=Choices(seconds=300.0))
SHORT = Task(painted(HOUSE), choices=Choices(refits=20))


class Heard:
    """What a worker has said, in order."""

    def __init__(self) -> None:
        self.news: list[tuple[str, int, Any]] = []

    def __call__(self, _: Worker, kind: str, number: int, news: Any) -> None:
        self.news.append((kind, number, news))

    async def until(self, *kinds: str, number: int | None = None) -> Any:
        """The first news of a kind from now on; those before are gone."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            while self.news:
                kind, told_of, news = self.news.pop(0)
                if kind in kinds and number in (None, told_of):
                    return news
            await asyncio.sleep(0.005)
        raise AutoPolyError(f"nothing of {kinds} was heard")


def play(of: Callable[[Worker, Heard], Awaitable[None]]) -> None:
    async def run() -> None:
        heard = Heard()
        worker = Worker(heard)
        try:
            await of(worker, heard)
        finally:
            worker.end()

    asyncio.run(run())


def test_search__tells_ever_better_meshes_and_in_the_end_a_construction() -> None:
    async def of(worker: Worker, heard: Heard) -> None:
        number = worker.work(LONG)
        first = await heard.until("progress")
        later = [await heard.until("progress") for _ in range(8)]
        assert all(one["best"] >= first["best"] and one["refits"] > first["refits"] for one in later)
        assert later[-1]["mesh"]["counts"][2] > 0 and later[-1]["tried"]
        worker.order("stop")
        done = await heard.until("done", number=number)
        assert done["stopped_by"] == "interrupted"
        assert ConstructionSequence.from_json(done["sequence"]).final().counts[2] > 0

    play(of)


def test_pause__stands_still_with_its_seconds() -> None:
    async def of(worker: Worker, heard: Heard) -> None:
        worker.work(LONG)
        first, began = await heard.until("progress"), time.monotonic()
        worker.order("pause")
        await asyncio.sleep(1.0)  # what was on its way has come
        heard.news.clear()
        await asyncio.sleep(1.5)
        assert heard.news == []
        worker.order("go")
        after = await heard.until("progress")
        passed = time.monotonic() - began
        assert after["refits"] > first["refits"]
        assert after["seconds"] - first["seconds"] <= passed - 1.0  # of which 2.5 were the pause

    play(of)


def test_drop__makes_room_at_once_for_the_next_task() -> None:
    async def of(worker: Worker, heard: Heard) -> None:
        for _ in range(3):
            number = worker.work(LONG)
            await heard.until("progress", number=number)
            worker.order("drop")
            await heard.until("idle", number=number)
        last = worker.work(SHORT)
        done = await heard.until("done", number=last)
        assert done["refits"] <= 30 and not [one for one in heard.news if one[0] == "done"]

    play(of)


def test_drop_while_paused__makes_room_as_well() -> None:
    async def of(worker: Worker, heard: Heard) -> None:
        worker.work(LONG)
        await heard.until("progress")
        worker.order("pause")
        await asyncio.sleep(0.3)
        worker.order("drop")
        await heard.until("idle")
        worker.work(SHORT)
        await heard.until("done")

    play(of)


def test_impossible_wish__is_told_in_one_line_and_the_next_task_is_done() -> None:
    async def of(worker: Worker, heard: Heard) -> None:
        worker.work(Task(painted(HOUSE), choices=Choices(symmetry="0.001")))
        problem = (await heard.until("failed"))["problem"]
        assert "axis" in problem and "\n" not in problem
        await heard.until("idle")
        worker.work(SHORT)
        await heard.until("done")

    play(of)


def test_worker_that_is_killed__is_missed_and_another_one_takes_its_place() -> None:
    async def of(worker: Worker, heard: Heard) -> None:
        worker.work(LONG)
        await heard.until("progress")
        worker._process.kill()
        await heard.until("gone")
        assert worker.task == 0 and not worker.is_ready
        worker.work(SHORT)
        await heard.until("done")

    play(of)
