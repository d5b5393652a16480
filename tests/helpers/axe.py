"""axe-core, which finds what keeps people from using a page: https://github.com/dequelabs/axe-core.

Continuous integration installs it from npm (`.ci/run`); `AXE` may name another copy of its `axe.min.js`.
"""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.helpers.browser import Page, needs_browser
from tests.helpers.paths import ROOT

PLACE = Path(os.environ.get("AXE", ROOT / "build" / "npm" / "node_modules" / "axe-core" / "axe.min.js"))
_skipped_without = pytest.mark.skipif(
    not PLACE.is_file(), reason="axe-core is not installed (npm install --prefix build/npm axe-core, or set AXE)"
)


def needs_axe(test: Callable[..., None]) -> Callable[..., None]:
    """Marks a test that looks at a page in Chromium with axe-core."""
    return _skipped_without(needs_browser(test))


def violations(page: Page) -> list[str]:
    """What axe-core finds wrong with the page as it is: the rule, and where."""
    if not page.evaluate("typeof axe === 'object'"):
        page.evaluate(PLACE.read_text(encoding="utf-8") + "; 0")
    found = page.evaluate(
        "axe.run(document, { resultTypes: ['violations'] }).then(found => JSON.stringify(found.violations))"
    )
    return [
        f"{rule['id']} ({rule['help']}): {node['target']} {node['failureSummary']}"
        for rule in json.loads(found)
        for node in rule["nodes"]
    ]
