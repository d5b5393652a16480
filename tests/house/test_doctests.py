"""Examples in docstrings run: those of every module of the three packages."""

import doctest
import importlib
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.helpers.pages import data_sets
from tests.helpers.paths import ROOT

WITH_EXAMPLES = sorted(
    path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".").removesuffix(".__init__")
    for package in ("autopoly_env", "agents", "training")
    for path in (ROOT / package).rglob("*.py")
    if ">>> " in path.read_text(encoding="utf-8")
)
# What an example takes to be in the folder that it runs in.
PREPARED: dict[str, Callable[[Path], None]] = {"training.datasets.shards": data_sets}


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples__give_what_they_show(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        module = importlib.import_module(name)
    except ImportError as error:  # an extra is not installed
        pytest.skip(str(error))
    monkeypatch.chdir(tmp_path)
    if name in PREPARED:
        PREPARED[name](tmp_path)
    result = doctest.testmod(module)
    assert result.attempted and not result.failed


def test_examples__are_found() -> None:
    assert {"autopoly_env.env", "autopoly_env.targets", "agents.search.selection"} <= {*WITH_EXAMPLES}
    assert {*PREPARED} <= {*WITH_EXAMPLES}
