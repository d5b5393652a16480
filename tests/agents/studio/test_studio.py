"""Who is searched for when: with workers that do nothing but note what they are told."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

import pytest

from agents.studio import by_hand
from agents.studio.choices import Choices, Task
from agents.studio.crew import Deliver
from agents.studio.edits import Asked
from agents.studio.items import Item
from agents.studio.painting import PLAIN, SIDE
from agents.studio.studio import NoItemError, Studio
from agents.studio.uploads import Opened, folder_name
from autopoly_env.errors import ConfigError
from tests.helpers.constructions import house
from tests.helpers.drawings import HOUSE, painted


class Idler:
    """A worker that does what a test says."""

    def __init__(self, deliver: Deliver) -> None:
        self._deliver = deliver
        self.is_ready, self.is_paused, self.task = True, False, 0
        self.tasks: list[Task] = []
        self.orders: list[str] = []

    def start(self) -> None: ...

    def end(self) -> None: ...

    def work(self, task: Task) -> int:
        assert self.task == 0
        self.tasks.append(task)
        self.task = len(self.tasks)
        self.is_paused = False
        return self.task

    def order(self, word: str) -> None:
        if self.task:
            self.orders.append(word)
            self.is_paused = word == "pause"

    def says(self, kind: str, news: Any = None) -> None:
        """News from the process; after an end it is idle."""
        number = self.task
        self._deliver(self, kind, number, news)  # type: ignore[arg-type]
        if kind in ("done", "failed", "dropped"):
            self.task = 0
            self._deliver(self, "idle", number, None)  # type: ignore[arg-type]

    def finds(self, n_steps: int = 2, stopped_by: str = "finished") -> None:
        told = {"sequence": house(n_steps).to_json(), "notes": [], "refits": 7, "seconds": 0.1}
        self.says("done", {**told, "stopped_by": stopped_by})


Play = Callable[[Studio, Idler, Idler], Awaitable[None] | None]


def play(of: Play) -> None:
    async def run() -> None:
        studio = Studio(Idler)  # type: ignore[arg-type]
        front, back = studio.front, studio.back
        assert isinstance(front, Idler) and isinstance(back, Idler)
        waiting = of(studio, front, back)
        if waiting is not None:
            await waiting

    asyncio.run(run())


def dropped(studio: Studio, name: str = "house", *, waits: bool = False) -> Item:
    return studio.add(studio.named(Opened(name, painted(HOUSE), picture=b"...")), waits=waits)


def test_one_picture__is_searched_at_once_and_its_result_is_looked_at() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        item = dropped(studio)
        assert (item.status, front.tasks[0].silhouette.name) == ("searching", "house")
        front.finds()
        assert item.status == "done" and item.version is not None
        assert item.version.command == "python -m agents.solve house.png --style modeller"

    play(of)


def test_queue__is_searched_in_its_turn_and_stands_still_while_somebody_searches() -> None:
    def of(studio: Studio, front: Idler, back: Idler) -> None:
        items = [dropped(studio, f"p{k}", waits=True) for k in range(3)]
        assert [item.status for item in items] == ["searching", "waiting", "waiting"] and not front.tasks
        mine = dropped(studio, "mine")
        assert back.orders == ["pause"] and mine.status == "searching"
        front.finds()
        assert back.orders == ["pause", "go"]
        back.finds()
        back.says("failed", {"problem": "no"})
        back.finds()
        assert [item.status for item in items] == ["done", "failed", "done"]
        assert [task.silhouette.name for task in back.tasks] == ["p0", "p1", "p2"]

    play(of)


def test_second_picture__lets_the_first_be_finished_and_keeps_its_best() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        first, second = dropped(studio, "first"), dropped(studio, "second")
        assert front.orders == ["stop"] and (first.status, second.status) == ("searching", "waiting")
        front.finds(stopped_by="interrupted")
        assert (first.status, second.status) == ("done", "searching")
        assert first.version is not None and "clock" in first.version.notes[0]

    play(of)


def test_other_choices__drop_the_search_and_its_late_news() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        item = dropped(studio)
        studio.choose(item, Choices(w_sc=1.0))
        assert front.orders == ["drop"] and item.status == "waiting"
        front.says("progress", {"best": 1.0})  # of the task that is being dropped
        front.says("dropped")
        assert item.status == "searching" and front.tasks[1].choices.w_sc == 1.0 and not item.versions
        studio.choose(item, Choices(w_sc=1.0))  # nothing new
        assert len(front.tasks) == 2 and front.orders == ["drop"]

    play(of)


def test_news__of_a_search_for_older_wishes_are_no_news() -> None:
    async def of(studio: Studio, front: Idler, _: Idler) -> None:
        item = dropped(studio)
        front.says("progress", {"best": 1.0})
        heard = studio.channel.listen([f"live-{item.id}"], 0.01)
        assert json.loads((await anext(heard))[1]) == {"best": 1.0, "wish": 0}
        studio.paint(item, bytes([255]) + bytes([PLAIN]) * (SIDE * SIDE - 1))
        front.says("progress", {"best": 2.0})
        assert await anext(heard) == ("", "")
        front.says("dropped")
        front.says("progress", {"best": 3.0})
        assert json.loads((await anext(heard))[1]) == {"best": 3.0, "wish": 1}

    play(of)


def test_going_on__starts_from_what_is_looked_at_and_keeps_its_locks() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        item = dropped(studio)
        front.finds()
        item.lock((2, 3))
        studio.search(item, goes_on=True)
        assert front.tasks[1].start is not None and front.tasks[1].locked == (2, 3)
        front.finds(3)
        assert item.version is not None and item.version.locked == (2, 3)
        assert "--agent mcts --start house.start.json --lock 2,3" in item.version.command
        studio.choose(item, Choices(w_sc=1.0))  # what was gone on from is kept
        assert front.tasks[2].start is not None
        front.finds()
        studio.choose(item, Choices(w_sc=1.0, symmetry="0.4"))  # about which it is not symmetric
        assert front.tasks[3].start is None
        front.finds()
        studio.search(item)
        front.finds()
        assert front.tasks[4].start is None and item.version is not None and item.version.locked == ()

    play(of)


def test_undo__goes_back_to_every_version_with_its_locks_and_an_edit_forgets_what_was_undone() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        item = dropped(studio)
        front.finds(1)
        item.lock((0,))
        studio.edited(item, item.version, house(2), "split", (2,))
        assert item.version is not None and item.version.locked == (0, 2)
        studio.look_at(item, -1)
        assert len(item.version.sequence.steps) == 1 and item.version.locked == (0,)
        studio.look_at(item, -1)
        assert item.at == 0
        studio.look_at(item, 1)
        assert len(item.version.sequence.steps) == 2
        studio.look_at(item, -1)
        studio.edited(item, item.version, house(3), "extrude")
        studio.look_at(item, 1)
        assert len(item.versions) == 2 and len(item.version.sequence.steps) == 3

    play(of)


def test_edit__ends_a_search_that_would_not_know_of_it() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        item = dropped(studio)
        front.finds()
        studio.search(item)
        studio.edited(item, item.version, house(3), "extrude")
        assert front.orders == ["drop"] and item.status == "done"
        front.finds(1)  # too late
        assert item.version is not None and len(item.version.sequence.steps) == 3

    play(of)


def test_edit_of_what_is_not_looked_at_any_more__is_refused() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        item = dropped(studio)
        front.finds(1)
        before = item.version
        studio.search(item)
        front.finds(2)
        with pytest.raises(ConfigError, match="has changed meanwhile"):
            studio.edited(item, before, house(3), "extrude")
        assert item.version is not None and len(item.version.sequence.steps) == 2

    play(of)


def test_worker_that_dies__is_told_and_the_next_picture_is_searched() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        first = dropped(studio, "first")
        front.task = 0
        front._deliver(front, "gone", 1, None)  # type: ignore[arg-type]
        assert first.status == "failed" and "unexpectedly" in first.problem
        second = dropped(studio, "second")
        assert second.status == "searching"

    play(of)


def test_closing_a_picture__in_mid_search_frees_the_worker() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        first, second = dropped(studio, "first"), dropped(studio, "second")
        studio.remove(first)
        front.says("dropped")
        assert second.status == "searching"
        with pytest.raises(NoItemError):
            studio.item(first.id)

    play(of)


def test_picture_that_was_closed_meanwhile__is_not_searched() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        item = dropped(studio)
        front.finds()
        studio.remove(item)
        found = Opened(item.name, painted(HOUSE))
        for late in (
            lambda: studio.search(item),
            lambda: studio.with_object(item, item.options, found),
            lambda: studio.edited(item, item.version, house(3), "extrude"),
        ):
            with pytest.raises(NoItemError):
                late()
        assert len(front.tasks) == 1 and not studio.items

    play(of)


def test_edit_where_the_object_is_not_found_any_more__is_refused() -> None:
    def of(studio: Studio, front: Idler, _: Idler) -> None:
        item = dropped(studio)
        front.finds()
        studio.with_object(item, item.options, Opened(item.name, None, "nothing is dark"))
        with pytest.raises(ConfigError, match="no object in the picture: nothing is dark"):
            by_hand.change(item, Asked("face_delete", {"face": 0}))

    play(of)


def test_names__are_given_once() -> None:
    def of(studio: Studio, _: Idler, __: Idler) -> None:
        items = [dropped(studio, name) for name in ("mug", "Mug", "mug")]
        assert [item.name for item in items] == ["mug", "Mug-2", "mug-3"]
        assert [item.silhouette.name for item in items if item.silhouette] == ["mug", "Mug-2", "mug-3"]

    play(of)


@pytest.mark.parametrize(("axis", "found"), [(0.5, 0.5), (10**400, None), (1e308, None), (-3, None), (True, None)])
def test_axis_of_a_construction__lies_within_the_picture(axis: float, found: float | None) -> None:
    sequence = replace(house(), settings={"symmetry": axis})
    assert Item.of(1, Opened("house", painted(HOUSE), sequence=sequence)).axis() == found


def test_names_that_would_be_one_folder__are_told_apart() -> None:
    def of(studio: Studio, _: Idler, __: Idler) -> None:
        given = ("a:b", "a?b", "x_", "x*", "椅" * 80, "椅" * 79)
        names = [dropped(studio, name).name for name in given]
        assert len({folder_name(name) for name in names}) == len(given)

    play(of)


def test_end__stops_what_is_searched_and_tells_what_there_is() -> None:
    async def of(studio: Studio, front: Idler, back: Idler) -> None:
        mine, other = dropped(studio, "mine"), dropped(studio, "other", waits=True)
        dropped(studio, "third", waits=True)
        closing = asyncio.ensure_future(studio.close(5.0))
        await asyncio.sleep(0)
        assert front.orders[-1] == "stop" and back.orders[-1] == "stop"
        front.finds(stopped_by="interrupted")
        back.finds(stopped_by="interrupted")
        assert [item.name for item in await closing] == [mine.name, other.name]
        assert len(front.tasks) == len(back.tasks) == 1  # nothing else was begun

    play(of)


@pytest.mark.parametrize(
    ("choices", "said"),
    [
        ({"w_sc": 0.0}, "w_sc 0.0: expected 0.001 to 20"),
        ({"seconds": 1e9}, "seconds"),
        ({"refits": 0}, "refits"),
        ({"refits": 10**400}, "refits"),
        ({"seed": 10**5000}, "seed"),
        ({"seed": -1}, "seed"),
        ({"style": "baroque"}, "baroque"),
        ({"symmetry": "left"}, "symmetry"),
        ({"keep": "nothing"}, "keep"),
    ],
)
def test_odd_choices__are_refused(choices: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        Choices(**choices)
