"""The registry: agents by name, their options, and what it says of wrong ones."""

import subprocess
import sys
from typing import Any

import pytest

from agents.registry import AGENTS, make_agent
from autopoly_env.errors import ConfigError
from tests.helpers.paths import ROOT
from tests.helpers.solving import simulator


@pytest.mark.slow
def test_registry__names_agents_after_themselves() -> None:
    assert {"random", "greedy", "beam", "trace", "climb"} <= {*AGENTS}
    for name in AGENTS:
        try:
            assert make_agent(name).name == name
        except ConfigError as error:
            assert "comes without weights" in str(error) and "weights=PATH" in str(error)


def test_registry__loads_the_agent_that_is_asked_for_alone() -> None:
    code = "import sys, agents.registry as r; r.make_agent('trace'); print(*sys.modules)"
    modules = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    loaded = set(modules.split())
    assert "agents.trace.agent" in loaded
    assert not {"agents.search.mcts", "agents.quads.agent", "agents.rl.config", "gymnasium", "scipy.linalg"} & loaded


@pytest.mark.parametrize(
    ("name", "options", "complaint"),
    [
        ("bean", {}, r"agent 'bean' is unknown; give one of .*\bbeam\b"),
        ("beam", {"witdh": 4}, r"agent 'beam' has no option 'witdh'; its options are width, "),
        ("beam", {"width": "wide"}, r"agent 'beam', option width: .* got 'wide'"),
        ("beam", {"width": 2.5}, r"agent 'beam', option width: .* got 2.5"),
        ("beam", {"width": 0}, "width=0: expected a number of at least 1$"),
        ("beam", {"patience": 0}, "patience=0: expected a number of at least 1$"),
        ("beam", {"merge_grid": float("nan")}, "merge_grid=nan: expected a number above 0$"),
        ("random", {"seed": -1}, "seed -1: expected at least 0"),
        ("trace", {"prices": ()}, "prices"),
        ("trace", {"prices": (2.0, 1.0)}, "prices"),
        ("trace", {"prices": (0.0,)}, "prices"),
        ("trace", {"prices": ("dear",)}, r"agent 'trace', option prices.0: .* got 'dear'"),
        ("trace", {"n_constructed": 0}, "n_constructed 0: expected at least 1"),
    ],
)
def test_registry__says_in_one_line_what_is_wrong(name: str, options: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        make_agent(name, **options)
    assert "\n" not in str(caught.value)


def test_registry__reads_options_as_a_command_line_gives_them() -> None:
    game = simulator()
    as_text, as_number = make_agent("beam", width="2", patience="1"), make_agent("beam", width=2, patience=1)
    assert as_text.solve(game).sequence == as_number.solve(game).sequence
