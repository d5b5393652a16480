"""`key=value` on a command line: one grammar for agents, suites and trainings."""

import doctest
import json
from pathlib import Path
from typing import Any

import pytest

from agents import options
from agents.options import put_override, read_yaml
from agents.registry import make_agent
from autopoly_env.errors import ConfigError


def read(*texts: str, values: dict[Any, Any] | None = None) -> dict[Any, Any]:
    values = {} if values is None else values
    for text in texts:
        put_override(values, text, f"--option {text}", "width=4")
    return values


def test_override__is_yaml_of_any_kind() -> None:
    assert read("width=4", "seeds=[trace]", "start=placed", "merge=no", "path=a=b") == {
        "width": 4,
        "seeds": ["trace"],
        "start": "placed",
        "merge": False,
        "path": "a=b",
    }


def test_override__of_a_section_goes_into_it_and_makes_it() -> None:
    values: dict[Any, Any] = {"net": {"n": 3, "inputs": ["target"]}}
    read("net.inputs=[a]", "optim.lr=1e-3", values=values)
    assert values == {"net": {"n": 3, "inputs": ["a"]}, "optim": {"lr": 0.001}}


@pytest.mark.parametrize(
    "text", ["1e5", "-0.5", "3", '"3"', "true", "null", '{"a": [1, "b"]}', '"\\ud83d\\ude00"', "-Infinity", " 7 "]
)
def test_override__means_by_json_what_json_says(text: str) -> None:
    (value,) = read(f"key={text}").values()
    assert (value, type(value)) == (json.loads(text), type(json.loads(text)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("width", r"--option width: expected key=value, such as width=4$"),
        ("=4", "expected key=value"),
        ("width=[4", r"--option width=\[4: the value is not YAML; quote it or correct it$"),
        ("width=" + "[" * 5000, "not YAML"),
        ("width=!!python/object:os.system 1", "not YAML"),
        ("width.a=3", "'width' is no section"),
    ],
)
def test_override__says_in_one_line_what_is_wrong(text: str, complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint) as caught:
        read(text, values={"width": 1})
    assert "\n" not in str(caught.value)


def test_examples__are_true() -> None:
    assert doctest.testmod(options).failed == 0


BOMB = "\n".join(["a0: &a0 [x, x, x]", *(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 30))])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("!!timestamp x", "has no attribute"),
        (BOMB, "more than 100000 values"),
        ("&a [*a]", "a part of itself"),
        ("[" * 3000, ""),
        ("0x" + "f" * 9, "holds a int"),
        ("a" * 1_000_001, "it has more than 1 MB"),
    ],
    ids=["date", "bomb", "ring", "brackets", "number", "size"],
)
def test_damaged_yaml__is_one_short_line(tmp_path: Path, text: str, problem: str) -> None:
    path = tmp_path / "odd.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_yaml(path)
    message = str(caught.value)
    assert problem in message
    assert message.isprintable() and len(message) <= 400


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 10**20, -(10**400)])
def test_number_that_no_option_can_be__is_named_by_its_key(value: float) -> None:
    with pytest.raises(ConfigError, match=r"^(agent 'mcts', option )?(seed|exploration)"):
        make_agent("mcts", **{"exploration" if isinstance(value, float) else "seed": value})
