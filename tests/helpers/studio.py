"""A studio that runs, as a process of its own, and what tests ask of it."""

import contextlib
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from tests.helpers.browser import Page
from tests.helpers.paths import ROOT

ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/\S+/")
PATIENCE = 120.0  # seconds until a server that does not end is given up
LIFETIME = 900.0  # seconds, after which a server is killed in any case
DONE = "document.getElementById('count').textContent.includes(' after ')"  # the search has come to its end


@dataclass
class Running:
    """A studio: its address, with the token, and its process."""

    address: str
    process: "subprocess.Popen[str]"

    @property
    def token(self) -> str:
        return urlsplit(self.address).path.strip("/")

    @property
    def root(self) -> str:
        """The address without the token."""
        return self.address.removesuffix(f"{self.token}/")

    def stop(self) -> tuple[int, str, str]:
        """Ctrl-C; the exit code, and what was said since the address."""
        self.process.send_signal(signal.SIGINT)
        out, err = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, out, err


@contextlib.contextmanager
def serving(*arguments: object, out: Path) -> Iterator[Running]:
    """A studio on any free port, without a browser."""
    words = [sys.executable, "-m", "agents.studio", "--no-browser", "--out", str(out), *map(str, arguments)]
    process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    killer = threading.Timer(LIFETIME, process.kill)
    killer.start()
    try:
        assert process.stdout is not None and process.stderr is not None
        found = ADDRESS.search(process.stdout.readline())
        assert found, process.stderr.read()
        yield Running(found[0], process)
    finally:
        killer.cancel()
        process.kill()
        process.wait()


def example(page: Page, name: str) -> None:
    """Begin with an example, as a click on it does, and wait until it is looked at."""
    page.wait_for("document.querySelectorAll('#examples button').length > 0")
    found = f"[...document.querySelectorAll('#examples button')].find(one => one.textContent === '{name}')"
    page.evaluate(f"{found}.id = 'wanted-example'")
    page.click("#wanted-example")
    page.wait_for(f"document.getElementById('name').textContent.startsWith('{name}')")


def solved(page: Page) -> None:
    """Wait until the search for the picture that is looked at has ended."""
    page.wait_for(DONE)


def middle(page: Page, selector: str) -> tuple[float, float]:
    """The middle of an element, in CSS pixels."""
    box = f"document.querySelector({selector!r}).getBoundingClientRect()"
    x, y = page.evaluate(f"(box => [box.x + box.width / 2, box.y + box.height / 2])({box})")
    return x, y


def vertex(page: Page, name: int) -> tuple[float, float]:
    """Where a vertex of the mesh is on the screen."""
    return middle(page, f'#vertices [aria-label^="vertex {name}"]')
