"""What the page may ask of the server, by address. Every answer is JSON, a picture, a file or a line of text.

No address holds a path that is opened: pages and examples are looked up by their names, pictures by their numbers.
"""

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from importlib.resources import files
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from agents.studio import by_hand, edits, taking, uploads
from agents.studio.choices import Choices
from agents.studio.items import Item
from agents.studio.masks import plain_mask
from agents.studio.painting import SIDE, check_painted
from agents.studio.reading import options_of
from agents.studio.studio import CREW, LIST, NoItemError, Studio
from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.export import to_html
from autopoly_env.export.player import part_of
from autopoly_env.files import file_stem
from autopoly_env.outside import described
from autopoly_env.shown import short
from autopoly_env.silhouette import IMAGE_SUFFIXES, ObjectOptions

EXAMPLES = Path(__file__).parents[2] / "examples"
MOST_JSON = 100_000  # bytes of a request that is no file
HEARTBEAT = 15.0  # seconds of silence, after which a listener is told that all is well
ICON = "data:,"
TYPES = {".css": "text/css", ".html": "text/html", ".js": "text/javascript"}
OWN = ("studio.css", "studio.js", "stage.js", "server.js", "painting.js", "panels.js")
SHARED = ("look.css", "drawing.js")
PLAYER_POLICY = "sandbox allow-scripts allow-downloads allow-modals; frame-ancestors 'none'"


def app_of(studio: Studio) -> Starlette:
    """The application; who may ask is the guard's business."""
    pages = _Pages(studio)
    routes = [
        Route("/", pages.page),
        Route("/files/{name}", pages.file),
        Route("/events", pages.events),
        Route("/kinds", pages.kinds),
        Route("/examples", pages.examples),
        Route("/examples/{name}.png", pages.example),
        Route("/examples/{name}", pages.add_example, methods=["POST"]),
        Route("/pictures", pages.add, methods=["POST"]),
        Route("/results.zip", pages.all_results),
        Route("/pictures/{id:int}", pages.remove, methods=["DELETE"]),
        Route("/pictures/{id:int}/{what:str}", pages.look),
        Route("/pictures/{id:int}/{do:str}", pages.do, methods=["POST"]),
        Route("/pictures/{id:int}/take/{kind:str}", pages.take),
        Route("/pictures/{id:int}/file/{name:str}", pages.file_of_command),
    ]
    handlers: Any = {
        NoItemError: _told(404),
        AutoPolyError: _told(422),
        uploads.TooLargeError: _told(413),
        ClientDisconnect: _told(400, "The connection ended before all had come."),
        HTTPException: lambda _, error: PlainTextResponse(f"{error.detail}\n", error.status_code),
        Exception: lambda _, error: PlainTextResponse(f"{described(error)}\n", 500),
    }
    return Starlette(routes=routes, exception_handlers=handlers)


def _told(status: int, words: str = "") -> Callable[[Request, Exception], Response]:
    return lambda _, error: PlainTextResponse(f"{words or error}\n", status)


class _Pages:
    """What answers, with the studio that is asked."""

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._editing = asyncio.Lock()
        self._doing: dict[str, Callable[[Item, Request], Awaitable[None]]] = {
            "object": self._object,
            "choices": self._choices,
            "search": self._search,
            "importance": self._importance,
            "locks": self._locks,
            "edit": self._edit,
            "retell": self._retell,
        }
        self._examples = {file_stem(path): path for path in sorted(EXAMPLES.glob("*.png"))}

    # --- the page ---

    async def page(self, _: Request) -> Response:
        return _file("studio.html")

    async def file(self, request: Request) -> Response:
        return _file(request.path_params["name"])

    async def events(self, request: Request) -> Response:
        """Server-sent events: the list of pictures, and all about the one that is looked at."""
        given = request.query_params.get("id", "0")
        number = int(given) if given.isdecimal() and len(given) < 9 else 0
        keys = [LIST, CREW, f"item-{number}", f"live-{number}"]
        headers = {"x-accel-buffering": "no"}
        return StreamingResponse(self._told_of(keys), media_type="text/event-stream", headers=headers)

    async def _told_of(self, keys: list[str]) -> AsyncIterator[str]:
        async for key, text in self._studio.channel.listen(keys, HEARTBEAT):
            yield f"event: {key.partition('-')[0]}\ndata: {text}\n\n" if key else ": still here\n\n"

    async def kinds(self, _: Request) -> Response:
        return JSONResponse(await asyncio.to_thread(taking.kinds))

    # --- pictures ---

    async def examples(self, _: Request) -> Response:
        return JSONResponse(list(self._examples))

    async def example(self, request: Request) -> Response:
        return Response((await self._example(request))[1], media_type="image/png")

    async def add_example(self, request: Request) -> Response:
        return await self._added(*await self._example(request), waits=False)

    async def _example(self, request: Request) -> tuple[str, bytes]:
        name = request.path_params["name"]
        if name not in self._examples:
            raise HTTPException(404, "There is no such example.")
        return name, await asyncio.to_thread(self._examples[name].read_bytes)

    async def add(self, request: Request) -> Response:
        name = stem_of(request.query_params.get("name", "picture"))
        data = await uploads.body_of(request, uploads.MOST_BYTES)
        return await self._added(name, data, waits=request.query_params.get("waits") == "1")

    async def _added(self, name: str, data: bytes, *, waits: bool) -> Response:
        self._studio.check_room(len(data))
        found = await asyncio.to_thread(uploads.opened, name, data)
        self._studio.check_room(len(data))
        found = self._studio.named(found)
        await asyncio.to_thread(plain_mask, found.silhouette)
        item = self._studio.add(found, waits=waits)
        return JSONResponse({"id": item.id, "name": item.name})

    async def remove(self, request: Request) -> Response:
        self._studio.remove(self._item(request))
        return Response(status_code=204)

    async def look(self, request: Request) -> Response:
        """The picture, large or small, what is painted, and the player."""
        item = self._item(request)
        match request.path_params["what"]:
            case "picture.png":
                return Response(item.shown, media_type="image/png")
            case "small.png":
                return Response(item.small, media_type="image/png")
            case "importance":
                return Response(item.painted or b"", media_type="application/octet-stream")
            case "player.html":
                taken = taking.Taking.of(item)
                page = await asyncio.to_thread(to_html, taken.version.sequence, taken.silhouette)
                return Response(page, media_type="text/html", headers={"content-security-policy": PLAYER_POLICY})
        raise HTTPException(404, "There is nothing of that name.")

    # --- what is done with a picture ---

    async def do(self, request: Request) -> Response:
        """Anything that changes an item; its news come as events."""
        doing = self._doing.get(request.path_params["do"])
        if doing is None:
            raise HTTPException(404, "There is nothing of that name.")
        await doing(self._item(request), request)
        return Response(status_code=204)

    async def _object(self, item: Item, request: Request) -> None:
        options = options_of(ObjectOptions, await _json(request))
        found = await asyncio.to_thread(by_hand.look_again, item, options)
        await asyncio.to_thread(plain_mask, found.silhouette)
        item.is_front = True
        self._studio.with_object(item, options, found)

    async def _choices(self, item: Item, request: Request) -> None:
        choices = options_of(Choices, await _json(request))
        item.is_front = True
        self._studio.choose(item, choices)

    async def _search(self, item: Item, request: Request) -> None:
        word = (await _json(request)).get("do")
        if word in ("pause", "go", "stop"):
            self._studio.order(item, word)
        elif word in ("anew", "on"):
            item.is_front = True
            self._studio.search(item, goes_on=word == "on")
        else:
            raise ConfigError(f"search: {short(word)}; expected pause, go, stop, anew or on")

    async def _importance(self, item: Item, request: Request) -> None:
        data = await uploads.body_of(request, SIDE * SIDE)
        item.is_front = True
        self._studio.paint(item, check_painted(data) if data else None)

    async def _locks(self, item: Item, request: Request) -> None:
        ids = (await _json(request)).get("ids")
        if not isinstance(ids, list) or not all(type(one) is int for one in ids):
            raise ConfigError("expected ids of vertices of the mesh")
        item.lock(tuple(ids))
        self._studio.tell(item)

    async def _edit(self, item: Item, request: Request) -> None:
        asked = await _json(request)
        async with self._editing:  # so that the next one changes what comes of this one
            match asked:
                case {"do": "undo"}:
                    self._studio.look_at(item, -1)
                case {"do": "redo"}:
                    self._studio.look_at(item, 1)
                case {"do": "pull", **rest}:
                    await self._pull(item, options_of(edits.Pull, rest, "edit: "))
                case {"do": operator, **rest}:
                    await self._change(item, options_of(edits.Asked, {"operator": operator, **rest}, "edit: "))
                case _:
                    raise ConfigError("edit: expected undo, redo, a vertex to pull, or an operator with its element")

    async def _pull(self, item: Item, asked: edits.Pull) -> None:
        before = item.version
        sequence, moved = await asyncio.to_thread(by_hand.pull, item, {asked.vertex: asked.to})
        self._studio.edited(item, before, sequence, f"vertex {asked.vertex} pulled by hand", moved)

    async def _change(self, item: Item, asked: edits.Asked) -> None:
        before = item.version
        sequence = await asyncio.to_thread(by_hand.change, item, asked)
        self._studio.edited(item, before, sequence, f"{asked.operator.replace('_', ' ')} by hand")

    async def _retell(self, item: Item, request: Request) -> None:
        given = (await _json(request)).get("from")
        other = self._studio.item(given if isinstance(given, int) else 0)
        if other.version is None:
            raise ConfigError(f"{other.name} has no construction yet: search first")
        item.is_front = True
        self._studio.search(item, steps=other.version.sequence)

    # --- files ---

    async def take(self, request: Request) -> Response:
        taken = taking.Taking.of(self._item(request))
        depth, size = (_number(request, name) for name in ("depth", "size"))
        kind = request.path_params["kind"]
        return _attached(await asyncio.to_thread(taking.taken, taken, kind, depth or 0.0, size))

    async def file_of_command(self, request: Request) -> Response:
        taken = taking.Taking.of(self._item(request))
        return _attached(taking.file_of_command(taken, request.path_params["name"]))

    async def all_results(self, _: Request) -> Response:
        takings = [taking.Taking.of(item) for item in self._studio.items.values() if item.version is not None]
        return _attached(await asyncio.to_thread(taking.all_results, takings))

    def _item(self, request: Request) -> Item:
        return self._studio.item(request.path_params["id"])


def stem_of(name: str) -> str:
    """A name for what comes of a file that a page calls so; nothing is opened by it."""
    last = PurePosixPath(name.replace("\\", "/").replace("\0", "")).name
    stem = last.rpartition(".")[0] if _has_known_ending(last) else last
    for ending in (".studio", ".sequence", ".lesson"):
        stem = stem.removesuffix(ending)
    return uploads.plain_name(stem)


def _has_known_ending(name: str) -> bool:
    ending = PurePosixPath(name).suffix.lower()
    return ending == ".json" or ending in IMAGE_SUFFIXES


def _file(name: str) -> Response:
    if name in SHARED:
        text = part_of(name)
    elif name in OWN or name == "studio.html":
        text = (files(__package__) / "page" / name).read_text(encoding="utf-8")
    else:
        raise HTTPException(404, "There is no such file.")
    return Response(text, media_type=TYPES[PurePosixPath(name).suffix])


def _attached(taken: taking.Taken) -> Response:
    headers = {"content-disposition": f"attachment; filename*=UTF-8''{quote(taken.name)}"}
    return Response(taken.data, media_type="application/octet-stream", headers=headers)


def _number(request: Request, name: str) -> float | None:
    given = request.query_params.get(name)
    try:
        return None if given in (None, "") else float(given or 0)
    except ValueError:
        raise ConfigError(f"{name} is {short(given)}; expected a number") from None


async def _json(request: Request) -> dict[str, Any]:
    """The object in the body of a request. Raises ConfigError for anything else."""
    try:
        value = json.loads(await uploads.body_of(request, MOST_JSON))
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise ConfigError("expected a JSON object")
    return value
