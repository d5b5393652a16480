"""The names at the top of the package: there are a dozen, they are those of the rooms, and they cost nothing."""

import subprocess
import sys
from importlib import import_module

import pytest

import autopoly_env


def test_dir__has_the_public_names_and_nothing_else() -> None:
    assert set(dir(autopoly_env)) == {*autopoly_env.__all__, "__version__"}
    assert len(autopoly_env.__all__) == 12


@pytest.mark.parametrize("name", autopoly_env.__all__)
def test_name__is_that_of_its_room(name: str) -> None:
    room = import_module(f"autopoly_env.{autopoly_env._ROOM_OF[name]}")
    assert getattr(autopoly_env, name) is getattr(room, name)


def test_unknown_name__is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Mesh'"):
        autopoly_env.Mesh  # noqa: B018


def test_import__loads_no_room() -> None:
    code = "import sys, autopoly_env; print(*(m for m in sys.modules if m.startswith('autopoly_env.')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
