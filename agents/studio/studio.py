"""`Studio`: all pictures, what is searched for, and the queue. Its methods are for the thread of the event loop.

There are two workers: one for the picture that somebody works at, one for those that wait in the queue. While the first
searches, the second stands still, so that both do not share the cores.
"""

import asyncio
from collections.abc import Callable, Iterator
from typing import Any

from agents.studio.channel import Channel
from agents.studio.choices import Choices, Task
from agents.studio.crew import Deliver, Worker
from agents.studio.items import DONE, FAILED, IDLE, PAUSED, SEARCHING, WAITING, Item, Version
from agents.studio.masks import painted_target
from agents.studio.uploads import MOST_OF_FOLDER, Opened, begun, folder_name
from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import ObjectOptions

MOST_ITEMS, MOST_MEMORY = 300, 1_000_000_000  # pictures, and bytes of their files, that are kept at once
LIST, CREW = "list", "crew"  # keys of the channel; others are those of an item


class NoItemError(AutoPolyError):
    """A picture that is not there, or not any more."""


class Studio:
    """What the server does, without the web."""

    def __init__(self, hire: Callable[[Deliver], Worker] = Worker) -> None:
        self.channel = Channel()
        self.items: dict[int, Item] = {}
        self._n_made = 0
        self._names: set[str] = set()
        self.front, self.back = hire(self._on_news), hire(self._on_news)
        self._at_work: dict[Worker, tuple[Item, Task] | None] = {self.front: None, self.back: None}
        self._waiting: list[Item] = []  # for their search, the next one first
        self._is_closing = False
        self.front.start()
        self._tell_crew()

    # --- pictures ---

    def item(self, number: int) -> Item:
        """The item of that number. Raises NoItemError."""
        if number not in self.items:
            raise NoItemError(f"picture {number} is not here any more: choose another one")
        return self.items[number]

    def check_room(self, size: int) -> None:
        """Raise ConfigError if there is no room for a file of `size` bytes."""
        held = sum(len(item.picture or b"") for item in self.items.values())
        if len(self.items) >= MOST_ITEMS or held + size > MOST_MEMORY:
            raise ConfigError(f"{len(self.items)} pictures are here already: close some, then drop more")

    def add(self, found: Opened, *, waits: bool) -> Item:
        """A new item of a file that was read; searched at once, or in its turn where it `waits`."""
        self._n_made += 1
        item = Item.of(self._n_made, found)
        item.is_front = not waits
        self.items[item.id] = item
        if item.silhouette is None:
            item.status = FAILED
        elif item.version is None:
            self.search(item)
        else:
            item.status = DONE
        self.tell(item)
        return item

    def remove(self, item: Item) -> None:
        """Close a picture."""
        self._withdraw(item)
        del self.items[item.id]
        self._names.discard(_key(item.name))
        for key in (f"item-{item.id}", f"live-{item.id}"):
            self.channel.forget(key)
        self._tell_list()
        self._assign()

    def named(self, found: Opened) -> Opened:
        """The file under a name that no other one has, nor its folder, as results are named after it."""
        name, count = found.name, 1
        while _key(name) in self._names:
            count += 1
            name = f"{begun(found.name, MOST_OF_FOLDER - 8)}-{count}"
        self._names.add(_key(name))
        return found.under(name)

    def with_object(self, item: Item, options: ObjectOptions, found: Opened) -> None:
        """Other options for what the object is, and the mask that they found. Raises NoItemError."""
        self.item(item.id)  # it may have been closed since it was asked for
        item.options, item.problem = options, found.problem
        item.silhouette = found.silhouette
        item.wish_number += 1
        if item.silhouette is None:
            self._withdraw(item)
            item.status = FAILED
            self.tell(item)
            self._assign()
        else:
            self.search(item)

    # --- searching ---

    def choose(self, item: Item, choices: Choices) -> None:
        """Other choices; what is searched for changes at once."""
        if choices == item.choices:
            return
        is_other_axis = choices.symmetry != item.choices.symmetry  # about which a hand's mesh need not be symmetric
        item.choices = choices
        self._wish_again(item, keeps_hand=not is_other_axis)

    def paint(self, item: Item, painted: bytes | None) -> None:
        """Where matching matters; what is searched for changes at once."""
        if painted == item.painted:
            return
        if item.silhouette is not None:
            painted_target(item.silhouette, painted)  # which says where that is impossible
        item.painted = painted
        self._wish_again(item)

    def _wish_again(self, item: Item, *, keeps_hand: bool = True) -> None:
        """Search for what is wished for now; what a hand has made or locked is gone on from."""
        item.wish_number += 1
        version = item.version
        self.search(item, goes_on=keeps_hand and version is not None and (version.is_by_hand or bool(version.locked)))

    def search(self, item: Item, *, goes_on: bool = False, steps: ConstructionSequence | None = None) -> None:
        """Search anew, from the picture or on from the version that is looked at; or tell `steps` again for it.

        Raises ConfigError where there is no object; NoItemError.
        """
        self.item(item.id)
        if item.silhouette is None:
            raise ConfigError(f"there is no object in the picture yet: {item.problem or 'choose another option'}")
        self._withdraw(item)
        item.asked, item.status, item.problem = item.task(goes_on=goes_on, steps=steps), WAITING, ""
        self.channel.forget(f"live-{item.id}")
        if item.is_front:
            self._waiting.insert(0, item)
            self._make_way()
        else:
            self._waiting.append(item)
        self.tell(item)
        self._assign()

    def order(self, item: Item, word: str) -> None:
        """`pause`, `go` or `stop` the search for a picture."""
        worker = self._worker_of(item)
        if worker is None:
            if word == "stop" and item in self._waiting:
                self._withdraw(item)
                item.status = DONE if item.versions else IDLE
                self.tell(item)
            return
        worker.order(word)
        item.status = PAUSED if word == "pause" else SEARCHING
        self.tell(item)
        self._hold_back()

    def _withdraw(self, item: Item) -> None:
        """Whatever is searched for a picture is given up."""
        if item in self._waiting:
            self._waiting.remove(item)
        worker = self._worker_of(item)
        if worker is not None:
            self._at_work[worker] = None
            worker.order("drop")
        item.asked = None

    def _make_way(self) -> None:
        """What somebody has worked at before is finished, for another picture is worked at now."""
        at_work = self._at_work[self.front]
        if at_work is not None:
            self.front.order("stop")
            at_work[0].status = SEARCHING
            self.tell(at_work[0])

    def _assign(self) -> None:
        """Give idle workers something to do."""
        if self._is_closing:
            return
        for worker, is_front in ((self.front, True), (self.back, False)):
            item = next((item for item in self._waiting if item.is_front == is_front), None)
            if item is None or worker.task or item.asked is None:
                continue
            self._waiting.remove(item)
            self._at_work[worker] = item, item.asked
            worker.work(item.asked)
            item.status = SEARCHING
            self.tell(item)
        self._hold_back()
        self._tell_crew()

    def _hold_back(self) -> None:
        """The queue stands still while somebody's own search goes on."""
        item = self._at_work[self.front]
        is_busy = item is not None and item[0].status == SEARCHING
        if self.back.task and is_busy != self.back.is_paused:
            self.back.order("pause" if is_busy else "go")

    def _worker_of(self, item: Item) -> Worker | None:
        return next((worker for worker, one in self._at_work.items() if one is not None and one[0] is item), None)

    def _on_news(self, worker: Worker, kind: str, _number: int, news: Any) -> None:
        at_work = self._at_work[worker]
        if kind == "progress" and at_work is not None and at_work[0].asked is at_work[1]:
            item = at_work[0]
            self.channel.publish(f"live-{item.id}", {**news, "wish": item.wish_number})
        elif kind in ("done", "failed", "gone"):
            self._at_work[worker] = None
            if at_work is not None:
                self._end_task(*at_work, kind, news)
        if kind in ("idle", "gone", "ready"):
            self._assign()
        if kind == "gone" and not self._is_closing and worker is self.front:
            worker.start()

    def _end_task(self, item: Item, task: Task, kind: str, news: Any) -> None:
        item.asked = None
        if kind == "done":
            item.push(_version_of(task, item, news))
            item.status, item.problem = DONE, ""
        else:
            item.status = FAILED
            item.problem = news["problem"] if kind == "failed" else "the search ended unexpectedly: search again"
        self.channel.forget(f"live-{item.id}")
        self.tell(item)

    # --- edits ---

    def edited(
        self,
        item: Item,
        before: Version | None,
        sequence: ConstructionSequence,
        told: str,
        locked: tuple[int, ...] = (),
    ) -> None:
        """What a hand has made of the version `before`; `locked`: vertices that are to stay where they are.

        Raises ConfigError where something else is looked at by now, which would be lost; NoItemError.
        """
        self.item(item.id)
        if item.version is not before:
            raise ConfigError("the mesh has changed meanwhile: look at it, and try again")
        if self._worker_of(item) is not None or item in self._waiting:
            self._withdraw(item)
        kept = () if before is None else before.locked
        item.push(Version(sequence, told, locked=tuple(sorted({*kept, *locked})), is_by_hand=True))
        item.status, item.problem = DONE, ""
        self.tell(item)
        self._assign()

    def look_at(self, item: Item, step: int) -> None:
        """Undo (-1) or redo (1)."""
        item.at = min(max(0, item.at + step), len(item.versions) - 1)
        self.tell(item)

    # --- news ---

    def tell(self, item: Item) -> None:
        """Publish an item, and the list of all."""
        self.channel.publish(f"item-{item.id}", item.plain())
        self._tell_list()

    def _tell_list(self) -> None:
        self.channel.publish(LIST, [item.summary() for item in self.items.values()])

    def _tell_crew(self) -> None:
        self.channel.publish(CREW, {"is_ready": self.front.is_ready, "n_waiting": len(self._waiting)})

    # --- the end ---

    async def close(self, patience: float) -> Iterator[Item]:
        """Finish what is searched, keep its best; the items that have results, once that is done or patience ends."""
        self._is_closing = True
        for worker in (self.front, self.back):
            worker.order("stop")
        deadline = asyncio.get_running_loop().time() + patience
        while any(self._at_work.values()) and asyncio.get_running_loop().time() < deadline:
            await asyncio.sleep(0.02)
        for worker in (self.front, self.back):
            worker.end()
        self.channel.close()
        return iter([item for item in self.items.values() if item.version is not None])


def _key(name: str) -> str:
    """What two names share that would be one folder, on a system that tells no capitals from others."""
    return folder_name(name).casefold()


def _version_of(task: Task, item: Item, news: dict[str, Any]) -> Version:
    """What a search has found."""
    sequence = ConstructionSequence.from_json(news["sequence"])
    how = {"interrupted": "stopped", "seconds": "out of time", "refits": "done"}.get(news["stopped_by"], "done")
    told = f"{how} after {news['refits']} refits, {news['seconds']:.1f} s"
    notes = list(news["notes"])
    if news["stopped_by"] in ("interrupted", "seconds"):
        notes.append("the clock had a part in it: give a number of refits for a result that repeats bit for bit")
    command = task.command(f"{item.name}.png")
    return Version(sequence, told, command, task, tuple(notes), task.locked, is_by_hand=task.start is not None)
