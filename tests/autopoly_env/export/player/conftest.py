"""A player that is open in a real browser."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from autopoly_env.export import save_html
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from tests.helpers.browser import Browser, Page
from tests.helpers.constructions import house
from tests.helpers.player import Open


@pytest.fixture
def play(browser: Browser, tmp_path: Path) -> Iterator[Open]:
    """Opens a player; `before` is a script to run first, `still` a reader who wants no motion."""
    pages = []

    def open_it(
        sequence: ConstructionSequence | None = None,
        target: Silhouette | None = None,
        *,
        before: str = "",
        still: bool = True,
        at: str = "",
        **view: Any,
    ) -> Page:
        path = save_html(sequence or house(), tmp_path / "player.html", target)
        (tmp_path / "empty.html").touch()
        page = browser.open(tmp_path / "empty.html")
        pages.append(page)
        page.send("Page.addScriptToEvaluateOnNewDocument", source=before)
        page.emulate(still=still, **view)
        page.requests.clear()
        page.go(path.as_uri() + at)
        return page

    yield open_it
    for page in pages:
        page.close()
