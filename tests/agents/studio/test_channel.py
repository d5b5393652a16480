"""News that are dropped when there are newer ones."""

import asyncio
import json
from collections.abc import AsyncIterator

import pytest

from agents.studio.channel import Channel

PATIENCE = 5.0


async def next_of(heard: AsyncIterator[tuple[str, str]]) -> tuple[str, object]:
    key, text = await anext(heard)
    return key, json.loads(text) if text else None


def test_listener__hears_only_the_newest_of_what_it_missed() -> None:
    async def listen() -> None:
        channel = Channel()
        heard = channel.listen(["a"], PATIENCE)
        for k in range(1000):
            channel.publish("a", k)
        assert await next_of(heard) == ("a", 999)
        channel.publish("a", 1000)
        channel.publish("a", 1001)
        assert await next_of(heard) == ("a", 1001)

    asyncio.run(listen())


def test_listener_that_never_reads__delays_nobody_and_is_owed_one_news_a_key() -> None:
    async def listen() -> None:
        channel = Channel()
        slow, quick = channel.listen(["a", "b"], PATIENCE), channel.listen(["a", "b"], PATIENCE)
        channel.publish("a", 0)
        assert await next_of(slow) == ("a", 0)  # and then it reads no more for a while
        for k in range(1, 50):
            channel.publish("a", k)
            assert await next_of(quick) == ("a", k)
        channel.publish("b", "new")
        assert [await next_of(slow), await next_of(slow)] == [("a", 49), ("b", "new")]

    asyncio.run(listen())


def test_keys__that_nobody_asked_for_are_not_heard() -> None:
    async def listen() -> None:
        channel = Channel()
        heard = channel.listen(["a"], 0.01)
        channel.publish("b", 1)
        assert await next_of(heard) == ("", None)  # a sign of life
        channel.publish("a", 2)
        assert await next_of(heard) == ("a", 2)

    asyncio.run(listen())


def test_closing__ends_what_is_listened_to() -> None:
    async def listen() -> None:
        channel = Channel()
        heard = channel.listen(["a"], PATIENCE)
        waiting = asyncio.ensure_future(anext(heard))
        await asyncio.sleep(0)
        channel.close()
        with pytest.raises(StopAsyncIteration):
            await waiting

    asyncio.run(listen())


def test_news__have_to_be_what_json_knows() -> None:
    async def publish() -> None:
        with pytest.raises(ValueError, match="JSON compliant"):
            Channel().publish("a", float("nan"))

    asyncio.run(publish())
