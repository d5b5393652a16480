"""What is shipped: one version number, types for other people's checkers, and commands that CI and the hooks share."""

import ast
import re
import tomllib

from tests.helpers.paths import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_version__is_said_once_and_read_without_an_import() -> None:
    assert PROJECT["project"]["dynamic"] == ["version"]
    assert PROJECT["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "autopoly_env.__version__"}
    tree = ast.parse((ROOT / "autopoly_env" / "__init__.py").read_text(encoding="utf-8"))
    values = [
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__version__"
    ]
    assert [type(value) for value in values] == [ast.Constant]


def test_marker_of_a_typed_package__is_shipped() -> None:
    assert (ROOT / "autopoly_env" / "py.typed").is_file()
    assert "py.typed" in PROJECT["tool"]["setuptools"]["package-data"]["autopoly_env"]


def test_files_that_are_no_python__are_shipped() -> None:
    files = [path for path in (ROOT / "autopoly_env").rglob("*.*") if "__pycache__" not in path.parts]
    suffixes = {path.suffix for path in files} - {".py"}
    patterns = PROJECT["tool"]["setuptools"]["package-data"]["autopoly_env"]
    assert {suffix.lstrip(".") for suffix in suffixes} == {pattern.rpartition(".")[2] for pattern in patterns}


def test_ci__runs_what_make_check_runs() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    (parts,) = re.findall(r"^check: (.*?) ##", makefile, re.MULTILINE)
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    assert [line.removeprefix("make ") for line in script if line.startswith("make ")] == parts.split()


def test_every_verb__is_listed_by_help() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    (phony,) = re.findall(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)
    assert phony.split() == re.findall(r"^([a-z]+):.*## ", makefile, re.MULTILINE)


def test_make__says_something_while_it_installs() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    installing = [line for line in makefile.splitlines() if "$(INSTALL)" in line]
    assert len(installing) == 2 and all(line.startswith("\t@$(TICKING) ") for line in installing)


def test_studio__comes_with_what_its_page_offers() -> None:
    """SVG in, DXF out; whoever opens it with `make studio` types no `pip install`."""
    extras = PROJECT["project"]["optional-dependencies"]
    assert "autopoly-env[dxf,svg]" in extras["studio"] and {"dxf", "svg"} <= set(extras)
