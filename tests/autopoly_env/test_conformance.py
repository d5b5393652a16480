"""The public checks: they pass what the project ships, and name what is broken in what breaks a rule."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from autopoly_env import conformance
from autopoly_env.conformance import (
    check_env,
    check_format,
    check_operator,
    check_simulator,
    check_target_source,
    sample_meshes,
)
from autopoly_env.env import AutoPolyEnv
from autopoly_env.errors import ConformanceError
from autopoly_env.export.formats import LISTED, Export, Format, find_format
from autopoly_env.files import write_atomically
from autopoly_env.mesh import PolyMesh, is_valid
from autopoly_env.operators import EDGE, OPERATORS, STOP, Action, Operator
from autopoly_env.placement import Disagreement, tried
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State
from autopoly_env.targets import ConstructionTargets, ObjectTargets

SMALL: dict[str, Any] = {"resolution": 16, "obs_resolution": 16, "max_steps": 20, "max_vertices": 16}
SUBDIVIDE = OPERATORS["edge_subdivide"]


def ring_target() -> Silhouette:
    rows, columns = np.mgrid[:64, :64] - 31.5
    return Silhouette((rows**2 + columns**2 < 700) & (rows**2 + columns**2 > 150))


# --- operators


@pytest.mark.parametrize("name", OPERATORS)
def test_every_operator__conforms(name: str) -> None:
    check_operator(OPERATORS[name])


def test_sample_meshes__are_valid_and_let_every_operator_work_somewhere() -> None:
    meshes = sample_meshes()
    assert all(is_valid(mesh) for mesh in meshes)
    assert {mesh.topology.n_components - mesh.topology.n_holes for mesh in meshes} >= {0, 1, 2}
    assert all(any(operator.legal_mask(mesh).any() for mesh in meshes) for operator in OPERATORS.values())


def edited(change: Callable[[PolyMesh, int, PolyMesh], PolyMesh]) -> Operator:
    """edge_subdivide with its result changed: `change(mesh, element, result)`."""
    return replace(SUBDIVIDE, edit=lambda mesh, e, choice: change(mesh, e, SUBDIVIDE.edit(mesh, e, choice)))


def renamed(_mesh: PolyMesh, _element: int, after: PolyMesh) -> PolyMesh:
    ids = after.vertex_ids
    return replace(after, vertex_ids=(ids[1], ids[0], *ids[2:]))


def reused(_mesh: PolyMesh, _element: int, after: PolyMesh) -> PolyMesh:
    """The lowest free id for the new vertex."""
    old = after.vertex_ids[:-1]
    return replace(after, vertex_ids=(*old, min(set(range(after.next_vertex_id)).difference(old))))


def flattened(mesh: PolyMesh, _element: int, after: PolyMesh) -> PolyMesh:
    """It writes into the mesh that it was given."""
    mesh.vertices.flags.writeable = True
    mesh.vertices[:, 1] = 0.5
    return after


def shaken(_mesh: PolyMesh, _element: int, after: PolyMesh) -> PolyMesh:
    return after.with_vertices(after.vertices + np.random.default_rng().normal(size=after.vertices.shape))


def lopsided(mesh: PolyMesh) -> PolyMesh:
    return mesh.with_vertices(mesh.vertices + 0.01 * np.arange(len(mesh.vertices))[:, None])


BROKEN_OPERATORS = {
    "the mask must be": replace(SUBDIVIDE, mask=lambda mesh: np.ones(3, bool)),
    "yet it works": replace(SUBDIVIDE, mask=lambda mesh: np.zeros(mesh.topology.n_edges, bool)),
    "by 1, not by": replace(SUBDIVIDE, changes=((2, 2, 0),)),
    "another order": edited(renamed),
    "reuses vertex ids": edited(reused),
    "not valid": edited(lambda _m, _e, after: replace(after, vertex_ids=after.vertex_ids[:-1])),
    "changed the mesh": edited(flattened),
    "same twice": edited(shaken),
    "does not show, it says": replace(OPERATORS["edge_extrude"], shows=lambda mesh, e: False),
    "no codec": replace(OPERATORS["face_split"], choice=None),
    "sources must be": replace(SUBDIVIDE, sources=lambda *_: np.zeros((2, 2))),
    "no words": replace(SUBDIVIDE, phrases=replace(SUBDIVIDE.told, keys=lambda step: ("",))),
    "does not replay": replace(SUBDIVIDE, element=replace(EDGE, index=lambda mesh, ids: 0)),
    "is not symmetric": replace(SUBDIVIDE, mirror=lambda of, start: iter([start._replace(mesh=lopsided(start.mesh))])),
    "takes must be": replace(SUBDIVIDE, takes="everything"),
}


@pytest.mark.parametrize("rule", BROKEN_OPERATORS)
def test_broken_operator__is_caught_with_the_rule_it_breaks(rule: str) -> None:
    with pytest.raises(ConformanceError) as caught:
        check_operator(BROKEN_OPERATORS[rule])
    assert rule in str(caught.value)
    assert BROKEN_OPERATORS[rule].name in str(caught.value)


def test_operator_that_breaks_down__is_named_with_its_module_and_the_check() -> None:
    broken = replace(SUBDIVIDE, name="edge_break", edit=lambda mesh, e, choice: 1 / 0)
    with pytest.raises(
        ConformanceError,
        match=r"'edge_break' of .*test_conformance breaks its contract \(ZeroDivisionError.*check_operator",
    ):
        broken.apply(PolyMesh.rectangle(0.2, 0.2, 0.8, 0.8), 0)
    short = replace(SUBDIVIDE, name="edge_break", mask=lambda mesh: np.ones(3, bool))
    with pytest.raises(ConformanceError, match=r"its mask is \(3,\) bool; expected \(4,\) bool, one for each edge"):
        short.legal_mask(PolyMesh.rectangle(0.2, 0.2, 0.8, 0.8))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"begin": lambda evidence, e: iter(())}, "it begins nowhere; expected one Start or more"),
        ({"begin": lambda evidence, e: None}, "TypeError: 'NoneType' object is not iterable"),
        ({"begin": lambda evidence, e: iter([3])}, "it begins at 3; expected a Start with a PolyMesh"),
        ({"shows": lambda mesh, e: 1 / 0}, "ZeroDivisionError: division by zero"),
        ({"mirror": lambda of, start: iter([start.mesh])}, r"it begins at PolyMesh.*; expected a Start"),
        ({"choose": lambda mesh, e: 1 / 0, "begin": None}, "ZeroDivisionError: division by zero"),
        ({"edit": lambda mesh, e, choice: None, "begin": None}, "it made a NoneType; expected a PolyMesh"),
    ],
    ids=["nowhere", "none", "no-start", "shows", "mirror", "choose", "edit"],
)
def test_trial_of_a_broken_operator__names_its_module_and_what_was_expected(
    change: dict[str, Any], complaint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = replace(SUBDIVIDE, name="edge_break", **{"edit": lambda m, e, c: SUBDIVIDE.edit(m, e, c), **change})
    monkeypatch.setitem(OPERATORS, broken.name, broken)
    disagreement = Disagreement(PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75), ring_target())
    with pytest.raises(
        ConformanceError, match=rf"^operator 'edge_break' of .*test_conformance breaks .*{complaint}.*check_operator"
    ):
        tried(disagreement, Action(broken.name, 1), axis=0.5)


@pytest.mark.parametrize("promised", [float("nan"), -1.0, float("inf"), "much", None])
def test_promise__that_is_no_area_is_refused(promised: Any) -> None:
    broken = replace(SUBDIVIDE, promise=lambda evidence, e: promised)
    with pytest.raises(ConformanceError, match=rf"it promises {promised!r}; expected an area of at least 0"):
        broken.promise_of(Disagreement(PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75), ring_target()), 0)


# --- simulators


def test_simulator__conforms() -> None:
    check_simulator(Simulator(ring_target(), resolution=16, max_steps=12), n_steps=40)


class Tampered(Simulator):
    """A simulator with one rule broken, named by `how`."""

    how = ""
    n_calls = 0

    def transition(self, state: State, action: Action) -> State:
        after = super().transition(state, action)
        self.n_calls += 1
        if action == STOP:
            return replace(after, done="") if self.how == "STOP does not end" else after
        match self.how:
            case "same state twice":
                return replace(after, mesh=after.mesh.with_vertices(after.mesh.vertices + 1e-9 * self.n_calls))
            case "not that of the mesh":
                return replace(after, score=replace(after.score, total=100.0))
            case "step is not counted":
                return replace(after, step=0)
        return after

    def transition_all(self, state: State, actions: Any = None) -> list[State]:
        return [self.transition(state, action) for action in actions]

    def legal_actions(self, state: State) -> list[Action]:
        legal = super().legal_actions(state)
        return legal[1:] if self.how == "STOP is not the first" else legal


@pytest.mark.parametrize(
    "rule",
    ["STOP does not end", "same state twice", "not that of the mesh", "step is not counted", "STOP is not the first"],
)
def test_broken_simulator__is_caught_with_the_rule_it_breaks(rule: str) -> None:
    simulator = Tampered(ring_target(), resolution=16)
    simulator.how = rule
    with pytest.raises(ConformanceError, match=rule):
        check_simulator(simulator)


# --- target sources


@pytest.mark.parametrize("source", [ConstructionTargets(resolution=32), ObjectTargets()], ids=lambda s: s.name)
def test_sources__conform(source: Any) -> None:
    check_target_source(source, n=4)


class Source:
    """A source with one rule broken, named by `how`."""

    name = "own"

    def __init__(self, how: str = "") -> None:
        self.how, self.n_calls = how, 0

    def sample(self, seed: int) -> Any:
        self.n_calls += 1
        if seed < 0 and self.how != "is not refused":
            raise conformance.ConfigError(f"seed {seed} is negative; give 0 or more")
        mask = np.zeros((32, 32), bool)
        extent = 3 if self.how == "one and the same" else 3 + abs(seed) % 20
        mask[:extent, : extent + (self.n_calls if self.how == "the second time" else 0)] = True
        return mask if self.how == "expected a Silhouette" else Silhouette(mask, "own")


def test_source_of_ones_own__conforms() -> None:
    check_target_source(Source())


@pytest.mark.parametrize("rule", ["is not refused", "one and the same", "the second time", "expected a Silhouette"])
def test_broken_source__is_caught_with_the_rule_it_breaks(rule: str) -> None:
    with pytest.raises(ConformanceError, match=rule):
        check_target_source(Source(rule), n=4)


class Odd:
    """A source that is none, and raises what nobody expects."""

    name = "odd"

    def sample(self, seed: int) -> Any:
        raise ZeroDivisionError("oh")


@pytest.mark.parametrize(
    "check",
    [
        lambda: check_target_source(Odd()),
        lambda: check_target_source(object()),  # type: ignore[arg-type]
        lambda: check_env(object()),
        lambda: check_simulator(object()),  # type: ignore[arg-type]
        lambda: conformance.check_operator(object()),  # type: ignore[arg-type]
    ],
)
def test_check__raises_what_it_promises_whatever_it_is_given(check: Callable[[], None]) -> None:
    with pytest.raises(ConformanceError, match="it raises") as caught:
        check()
    assert str(caught.value).isprintable()


# --- formats


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, _, _ in LISTED])
def test_every_format__conforms(name: str) -> None:
    check_format(find_format(name))


def _plain(export: Export, path: Path) -> None:
    write_atomically(path, str(len(export.sequence.steps)))


def _into_what_is_there(export: Export, path: Path) -> None:
    path.write_text("text")


def _littering(export: Export, path: Path) -> None:
    _plain(export, path)
    path.with_suffix(".log").touch()


def _deaf(export: Export, path: Path) -> None:
    if path.parent.is_file():
        return
    _plain(export, path)


_NUMBERS = itertools.count()

BROKEN_WRITERS: dict[str, Callable[[Export, Path], object]] = {
    "there is no such file": lambda export, path: None,
    "FileNotFoundError": _into_what_is_there,
    "more than the file": _littering,
    "not the same bytes twice": lambda export, path: write_atomically(path, str(next(_NUMBERS))),
    "is no OutputError": _deaf,
    "0 steps, .a: ZeroDivisionError": lambda export, path: write_atomically(path, str(1 / len(export.sequence.steps))),
    "changed the sequence": lambda export, path: (_plain(export, path), export.sequence.settings.update(seen=1)),
}


@pytest.mark.parametrize("rule", BROKEN_WRITERS)
def test_broken_format__is_caught_with_the_rule_it_breaks(rule: str) -> None:
    check_format(Format("mine", (".a", ".b"), "a number", _plain))
    with pytest.raises(ConformanceError, match=rule) as caught:
        check_format(Format("mine", (".a",), "a number", BROKEN_WRITERS[rule]))
    assert "format mine" in str(caught.value)


# --- environments


class Altered(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment whose infos somebody has changed."""

    def __init__(self, env: Any, change: Callable[[dict[str, Any], int], None]) -> None:
        super().__init__(env)
        self.change, self.n_steps = change, 0

    def step(self, action: Any) -> Any:
        *rest, info = self.env.step(action)
        self.n_steps += 1
        self.change(info, self.n_steps)
        return (*rest, info)


BROKEN_INFOS = {
    "forbids STOP": lambda info, n: info["action_mask"].__setitem__(0, 0),
    "is not the info's mask": lambda info, n: info["action_mask"].__setitem__(slice(1, None), 1),
    "other keys or types": lambda info, n: info.update(r_sm=np.int64(1)),
    "invalid_action is wrong": lambda info, n: info.update(invalid_action=np.array(not info["invalid_action"])),
    "changed the shape": lambda info, n: info.update(r_all=np.float64(n)),
    "after a restore": lambda info, n: info.update(n_refits=np.int64(n)),
}


@pytest.mark.parametrize("rule", BROKEN_INFOS)
def test_broken_env__is_caught_with_the_rule_it_breaks(rule: str) -> None:
    with pytest.raises(ConformanceError, match=rule):
        check_env(Altered(AutoPolyEnv(**SMALL), BROKEN_INFOS[rule]))
