"""`Channel`: the newest of each kind of news; what is older is dropped, so that a slow listener delays nobody."""

import asyncio
import json
from collections.abc import AsyncIterator, Collection
from typing import Any


class Channel:
    """News by key, each the whole truth about it, so that the newest alone is worth sending. For one event loop."""

    def __init__(self) -> None:
        self._newest: dict[str, tuple[int, str]] = {}
        self._listeners: set[asyncio.Event] = set()
        self._n_published = 0
        self._is_closed = False

    def publish(self, key: str, news: Any) -> None:
        """Put plain news in place of the older ones of its key."""
        self._n_published += 1
        text = json.dumps(news, allow_nan=False, separators=(",", ":"))
        self._newest[key] = self._n_published, text
        self._wake()

    def forget(self, key: str) -> None:
        """There is no such key any more."""
        self._newest.pop(key, None)

    def close(self) -> None:
        """End what all listeners hear."""
        self._is_closed = True
        self._wake()

    async def listen(self, keys: Collection[str], patience: float) -> AsyncIterator[tuple[str, str]]:
        """(key, JSON) of each of the keys, the one that has waited longest first; ("", "") after `patience` seconds.

        What is published while the last one is being sent is heard once, as it is in the end.
        """
        wake, heard = asyncio.Event(), dict.fromkeys(keys, 0)
        self._listeners.add(wake)
        try:
            while not self._is_closed:
                wake.clear()
                unheard = [(*self._newest[key], key) for key in keys if key in self._newest]
                unheard = [one for one in unheard if one[0] > heard[one[2]]]
                if unheard:
                    number, text, key = min(unheard)
                    heard[key] = number
                    yield key, text
                    continue
                try:
                    await asyncio.wait_for(wake.wait(), patience)
                except TimeoutError:
                    yield "", ""
        finally:
            self._listeners.discard(wake)

    def _wake(self) -> None:
        for wake in self._listeners:
            wake.set()
