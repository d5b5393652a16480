"""A real browser for tests of what is made for one: headless Chromium over its DevTools pipe, no package needed.

    with Browser() as browser:
        page = browser.open(path, width=390, height=844, dark=True)
        page.click("#next")
        page.press("ArrowRight")
        assert page.evaluate("document.title") == "mug"
        assert page.problems() == []  # nothing on the console
        page.screenshot(tmp_path / "page.png")

A test that needs it says so with `@needs_browser`: it is skipped, and says why, where there is none, and it is slow.
The protocol: https://chromedevtools.github.io/devtools-protocol. Its messages are JSON texts with a zero byte after
each, read from the browser's file descriptor 3 and written to its 4.
"""

import base64
import contextlib
import fcntl
import functools
import json
import os
import select
import shutil
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FLAGS = (
    *("--headless=new", "--remote-debugging-pipe", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"),
    *("--no-first-run", "--disable-extensions", "--disable-background-networking", "--hide-scrollbars", "--mute-audio"),
    *("--force-color-profile=srgb", "--font-render-hinting=none", "--force-device-scale-factor=1"),
)
TIMEOUT = 30.0  # seconds until a browser that does not answer is given up
PATIENCE = 5.0  # seconds until one that was asked to end is killed
# What DevTools wants to know of a key beside its name: (code, key code, the text it types).
KEYS = {
    "ArrowLeft": ("ArrowLeft", 37, ""),
    "ArrowUp": ("ArrowUp", 38, ""),
    "ArrowRight": ("ArrowRight", 39, ""),
    "ArrowDown": ("ArrowDown", 40, ""),
    "Home": ("Home", 36, ""),
    "End": ("End", 35, ""),
    "Escape": ("Escape", 27, ""),
    "Enter": ("Enter", 13, "\r"),
    "Tab": ("Tab", 9, ""),
    " ": ("Space", 32, " "),
}

MIDDLE = """(element => {
  if (!element) return null;
  element.scrollIntoView({block: "center", behavior: "instant"});
  const box = element.getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
})"""


@functools.cache
def find_browser() -> str | None:
    """The path of a Chromium: the variable CHROMIUM, else the first of NAMES that is installed."""
    named = os.environ.get("CHROMIUM")
    return named or next(filter(None, map(shutil.which, NAMES)), None)


_skipped_without = pytest.mark.skipif(
    find_browser() is None, reason="Chromium is not installed (apt-get install chromium, or set CHROMIUM to its path)"
)


def needs_browser(test: Callable[..., None]) -> Callable[..., None]:
    """Marks a test that drives Chromium."""
    return pytest.mark.slow(_skipped_without(test))


class BrowserError(Exception):
    """The browser, or a script in its page, failed."""


class Browser:
    """A running Chromium with a profile of its own; as a context it ends with it."""

    def __init__(self) -> None:
        executable = find_browser()
        if executable is None:
            raise BrowserError("Chromium is not installed")
        self._profile = tempfile.mkdtemp(prefix="autopoly-browser-")
        from_us, to_browser = map(_far_from_stdio, os.pipe())
        from_browser, to_us = map(_far_from_stdio, os.pipe())
        command = [executable, *FLAGS, f"--user-data-dir={self._profile}", "about:blank"]
        silence = [(os.POSIX_SPAWN_OPEN, stream, os.devnull, os.O_RDWR, 0) for stream in (0, 1, 2)]
        pipes = [(os.POSIX_SPAWN_DUP2, from_us, 3), (os.POSIX_SPAWN_DUP2, to_us, 4)]
        self._pid = os.posix_spawn(executable, command, os.environ, file_actions=[*silence, *pipes], setpgroup=0)
        os.close(from_us)
        os.close(to_us)
        self._write, self._read = to_browser, from_browser
        self._received = b""
        self._n_sent = 0
        self._pages: dict[str, Page] = {}

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the browser and remove its profile."""
        with contextlib.suppress(BrowserError):
            self.send("Browser.close")
        deadline = time.monotonic() + PATIENCE
        while os.waitpid(self._pid, os.WNOHANG) == (0, 0):  # so that it can end its own processes
            if time.monotonic() > deadline:
                os.killpg(self._pid, signal.SIGKILL)
                os.waitpid(self._pid, 0)
                break
            time.sleep(0.01)
        os.close(self._write)
        os.close(self._read)
        shutil.rmtree(self._profile, ignore_errors=True)

    def open(
        self, path_or_url: str | os.PathLike[str], *, width: int = 1280, height: int = 800, dark: bool = False
    ) -> "Page":
        """A new page with a file or an URL in it, loaded; a viewport of `width` x `height` CSS pixels."""
        target = self.send("Target.createTarget", {"url": "about:blank"})["targetId"]
        session = self.send("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"]
        page = self._pages[session] = Page(self, session, target)
        for domain in ("Page", "Runtime", "Log", "Network"):
            page.send(f"{domain}.enable")
        page.emulate(width=width, height=height, dark=dark)
        given = os.fspath(path_or_url)
        page.go(given if "://" in given else Path(given).resolve().as_uri())
        return page

    def send(self, method: str, parameters: dict[str, Any] | None = None, session: str | None = None) -> Any:
        """The result of a DevTools command; events that come before it go to their pages. Raises BrowserError."""
        self._n_sent += 1
        number = self._n_sent
        message = {"id": number, "method": method, "params": parameters or {}}
        text = json.dumps(message if session is None else message | {"sessionId": session})
        self._write_all(text.encode() + b"\0")
        deadline = time.monotonic() + TIMEOUT
        while True:
            answer = self._receive(deadline, method)
            if answer.get("id") == number:
                if "error" in answer:
                    raise BrowserError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self._dispatch(answer)

    def listen(self, is_over: Callable[[], bool], what: str) -> None:
        """Take events until `is_over()`. Raises BrowserError after TIMEOUT seconds."""
        deadline = time.monotonic() + TIMEOUT
        while not is_over():
            self._dispatch(self._receive(deadline, what))

    def _dispatch(self, message: dict[str, Any]) -> None:
        page = self._pages.get(message.get("sessionId", ""))
        if page is not None and "method" in message:
            page.on_event(message["method"], message["params"])

    def _write_all(self, data: bytes) -> None:
        try:
            while data:
                data = data[os.write(self._write, data) :]
        except BrokenPipeError:
            raise BrowserError("the browser has ended; does it start on its own?") from None

    def _receive(self, deadline: float, what: str) -> dict[str, Any]:
        while b"\0" not in self._received:
            ready, _, _ = select.select([self._read], [], [], max(0.0, deadline - time.monotonic()))
            if not ready:
                raise BrowserError(f"{what}: no answer from the browser within {TIMEOUT:.0f} seconds")
            data = os.read(self._read, 1 << 20)
            if not data:
                raise BrowserError("the browser has ended; does it start on its own?")
            self._received += data
        text, self._received = self._received.split(b"\0", 1)
        message: dict[str, Any] = json.loads(text)
        return message


class Page:
    """One page of a browser. `console` has what was written there, `requests` the URLs that it asked for."""

    def __init__(self, browser: Browser, session: str, target: str) -> None:
        self._browser, self._session, self._target = browser, session, target
        self._is_loaded = False
        self.console: list[tuple[str, str]] = []  # (level, text); levels: log, info, warning, error, ...
        self.requests: list[str] = []

    def send(self, method: str, **parameters: Any) -> Any:
        """The result of a DevTools command for this page."""
        return self._browser.send(method, parameters, self._session)

    def on_event(self, method: str, event: dict[str, Any]) -> None:
        """Note what the browser tells of this page."""
        match method:
            case "Page.loadEventFired":
                self._is_loaded = True
            case "Network.requestWillBeSent":
                self.requests.append(event["request"]["url"])
            case "Runtime.consoleAPICalled":
                words = [str(value.get("value", value.get("description", ""))) for value in event["args"]]
                self.console.append((event["type"], " ".join(words)))
            case "Runtime.exceptionThrown":
                self.console.append(("error", _told(event["exceptionDetails"])))
            case "Log.entryAdded":
                self.console.append((event["entry"]["level"], event["entry"]["text"]))

    def problems(self) -> list[str]:
        """Errors and warnings on the console so far."""
        self.evaluate("0")  # all events before its answer have come
        return [text for level, text in self.console if level in ("error", "warning", "assert")]

    def go(self, url: str) -> None:
        """Load an URL and wait until its `load` event."""
        self._is_loaded = False
        answer = self.send("Page.navigate", url=url)
        if "errorText" in answer:
            raise BrowserError(f"{url}: {answer['errorText']}")
        self._browser.listen(lambda: self._is_loaded, url)

    def evaluate(self, script: str) -> Any:
        """The value of a JavaScript expression as JSON; a promise is awaited. Raises BrowserError if it throws."""
        answer = self.send("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise BrowserError(f"{script}: {_told(answer['exceptionDetails'])}")
        return answer["result"].get("value")

    def wait_for(self, script: str) -> None:
        """Wait until an expression is true. Raises BrowserError after TIMEOUT seconds."""
        deadline = time.monotonic() + TIMEOUT
        while not self.evaluate(script):
            if time.monotonic() > deadline:
                raise BrowserError(f"{script} did not become true within {TIMEOUT:.0f} seconds")
            time.sleep(0.02)

    def click(self, selector: str) -> None:
        """Scroll to the first element of a CSS selector and click its middle, as a mouse does."""
        x, y = self.move_to(selector)
        for kind in ("mousePressed", "mouseReleased"):
            self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def move_to(self, selector: str) -> tuple[float, float]:
        """Scroll to the first element of a CSS selector, move the mouse to its middle; (x, y) in CSS pixels."""
        centre = self.evaluate(f"{MIDDLE}(document.querySelector({json.dumps(selector)}))")
        if centre is None:
            raise BrowserError(f"no element is {selector}")
        x, y = centre
        self.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        return x, y

    def drag(self, start: tuple[float, float], end: tuple[float, float], n_moves: int = 6) -> None:
        """Press the mouse at a place (x, y in CSS pixels), move it to another one in a few moves, and let go."""
        self.send("Input.dispatchMouseEvent", type="mouseMoved", x=start[0], y=start[1])
        self.send("Input.dispatchMouseEvent", type="mousePressed", x=start[0], y=start[1], button="left", clickCount=1)
        for k in range(1, n_moves + 1):
            x, y = (a + (b - a) * k / n_moves for a, b in zip(start, end, strict=True))
            self.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, button="left", buttons=1)
        self.send("Input.dispatchMouseEvent", type="mouseReleased", x=end[0], y=end[1], button="left", clickCount=1)

    def drop(self, *paths: str | os.PathLike[str], x: float = 400, y: float = 300) -> None:
        """Drop files on a place of the page, as from a file manager."""
        data = {"items": [], "files": [os.path.abspath(path) for path in paths], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.send("Input.dispatchDragEvent", type=kind, x=x, y=y, data=data)

    def text(self, selector: str) -> str:
        """The text of the first element of a CSS selector."""
        return str(self.evaluate(f"document.querySelector({json.dumps(selector)}).textContent"))

    def press(self, key: str) -> None:
        """Press and release a key by the name that JavaScript's `event.key` has: one of KEYS, or a letter or digit."""
        code, number, text = KEYS.get(key, (f"Key{key.upper()}", ord(key.upper()[0]), key))
        known = {"key": key, "code": code, "windowsVirtualKeyCode": number}
        self.send("Input.dispatchKeyEvent", type="keyDown", text=text, **known)
        self.send("Input.dispatchKeyEvent", type="keyUp", **known)

    def emulate(
        self, *, width: int = 1280, height: int = 800, dark: bool = False, scale: float = 1.0, still: bool = False
    ) -> None:
        """The viewport in CSS pixels, screen pixels in each, a reader who likes it dark, one who wants no motion."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": width < 600}
        self.send("Emulation.setDeviceMetricsOverride", **metrics)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        motion = {"name": "prefers-reduced-motion", "value": "reduce" if still else "no-preference"}
        self.send("Emulation.setEmulatedMedia", features=[scheme, motion])

    def screenshot(self, path: str | os.PathLike[str] | None = None, *, whole: bool = False) -> bytes:
        """What the viewport, or the whole page, looks like: the bytes of a PNG, written to `path` if there is one."""
        answer = self.send("Page.captureScreenshot", format="png", captureBeyondViewport=whole, **self._clip(whole))
        data = base64.b64decode(answer["data"])
        if path is not None:
            Path(path).write_bytes(data)
        return data

    def _clip(self, whole: bool) -> dict[str, Any]:
        if not whole:
            return {}
        size = self.send("Page.getLayoutMetrics")["cssContentSize"]
        return {"clip": {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}}

    def close(self) -> None:
        """Close the page."""
        self._browser.send("Target.closeTarget", {"targetId": self._target})


def _far_from_stdio(descriptor: int) -> int:
    """A copy of a file descriptor above 9, out of the way of the browser's own, in place of it."""
    copy = fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 10)
    os.close(descriptor)
    return copy


def _told(details: dict[str, Any]) -> str:
    exception = details.get("exception", {})
    return str(exception.get("description", exception.get("value", details["text"])))
