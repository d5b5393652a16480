"""The server: a socket on 127.0.0.1, what is opened at the start, and what Ctrl-C keeps."""

import asyncio
import contextlib
import logging
import os
import secrets
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Iterator, Sequence
from pathlib import Path

import uvicorn

from agents.commands.running import TOLD
from agents.commands.starting import INTERRUPTED
from agents.studio import taking
from agents.studio.app import app_of, stem_of
from agents.studio.guard import Guard
from agents.studio.studio import Studio
from agents.studio.uploads import MOST_BYTES, opened
from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.shown import tame

HOST = "127.0.0.1"  # and nothing else
PATIENCE = 15.0  # seconds that Ctrl-C gives what is searched to be finished


def bound(port: int) -> socket.socket:
    """A socket on the port, or on any that is free for 0. Raises ConfigError if it is in use."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((HOST, port))
        listening.listen()  # whoever has the address may ask, and waits until the server answers
    except OSError as error:
        listening.close()
        reason = error.strerror or error
        raise ConfigError(f"port {port} cannot be had ({reason}): give another one, or --port 0 for any") from None
    return listening


class _Quiet(uvicorn.Server):
    """A server that leaves signals to us."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


def serve(given: Sequence[Path], port: int, out: Path, *, opens_browser: bool) -> int:
    """Serve until Ctrl-C; what is finished by then is kept in `out`. Returns the exit code."""
    with bound(port) as listening:
        return asyncio.run(_serve(given, listening, out, opens_browser))


async def _serve(given: Sequence[Path], listening: socket.socket, out: Path, opens_browser: bool) -> int:
    studio, token = Studio(), secrets.token_urlsafe(24)
    port = listening.getsockname()[1]
    guarded = Guard(app_of(studio), token, port, MOST_BYTES)
    config = uvicorn.Config(
        guarded, log_config=None, access_log=False, lifespan="off", server_header=False, timeout_graceful_shutdown=1
    )
    logging.getLogger("uvicorn").addHandler(logging.NullHandler())  # what there is to say the page says
    logging.getLogger("uvicorn").propagate = False
    server = _Quiet(config)
    _heed_ctrl_c(server, studio)
    serving = asyncio.create_task(server.serve(sockets=[listening]))
    address = f"http://{HOST}:{port}/{token}/"
    print(
        f"The studio is open at {address}\nCtrl-C ends it, and keeps what is finished in {tame(str(out))}.", flush=True
    )
    if opens_browser:
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
    for path in given:
        await _open(studio, path, waits=len(given) > 1)
    await serving
    return await _close(studio, out) or TOLD


def _heed_ctrl_c(server: uvicorn.Server, studio: Studio) -> None:
    """The first Ctrl-C ends the server, a second one everything at once."""
    loop = asyncio.get_running_loop()
    n_pressed = 0

    def pressed() -> None:
        nonlocal n_pressed
        n_pressed += 1
        if n_pressed > 1:
            os.write(2, b"aborted by Ctrl-C; the files that were written are whole\n")
            os._exit(INTERRUPTED)
        studio.channel.close()  # so that no tab holds the server up
        server.should_exit = True

    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            loop.add_signal_handler(number, pressed)
        except NotImplementedError:  # on Windows
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(pressed))


async def _open(studio: Studio, path: Path, *, waits: bool) -> None:
    """Open a file that the command was given; what is none is told on stderr."""
    try:
        try:
            data = await asyncio.to_thread(_read, path)
            studio.check_room(len(data))
        except OSError as error:
            raise ConfigError(f"{path}: cannot be read ({error.strerror})") from None
        studio.add(studio.named(await asyncio.to_thread(opened, stem_of(path.name), data)), waits=waits)
    except AutoPolyError as error:
        print(f"error: {error}", file=sys.stderr, flush=True)


def _read(path: Path) -> bytes:
    with path.open("rb") as stream:
        data = stream.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise ConfigError(f"{path}: has more than {MOST_BYTES // 1_000_000} MB; make it smaller")
    return data


async def _close(studio: Studio, out: Path) -> int:
    """Keep what is finished, and name it. Returns 1 where that did not work."""
    print("stopped by Ctrl-C: finishing what is searched ...", file=sys.stderr, flush=True)
    n_failed = 0
    for item in await studio.close(PATIENCE):
        try:
            print(tame(str(await asyncio.to_thread(taking.keep, taking.Taking.of(item), out))), flush=True)
        except (AutoPolyError, OSError) as error:
            n_failed += 1
            print(f"error: {error}", file=sys.stderr, flush=True)
    return min(1, n_failed)
