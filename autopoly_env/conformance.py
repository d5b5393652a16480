"""Checks for parts of your own: operators, simulators, target sources, formats and environments to rely on.

Each check returns None, or raises ConformanceError naming the rule that was broken, and where. Example, in a test:

>>> from autopoly_env.operators import OPERATORS
>>> check_operator(OPERATORS["edge_subdivide"])
"""

import pickle
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec

import numpy as np

from autopoly_env.errors import AutoPolyError, ConfigError, ConformanceError, IllegalActionError, OutputError
from autopoly_env.export.formats import Export, Format
from autopoly_env.export.player import describe_step
from autopoly_env.mesh import PolyMesh, broken_faces, defects_of, images_of, is_valid
from autopoly_env.operators import OPERATORS, STOP, Action, Operator, Start
from autopoly_env.operators.operator import Mirroring
from autopoly_env.outside import described
from autopoly_env.raster import coverage
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.sequence.ids import decoded
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State
from autopoly_env.targets import TargetSource

_Checked = ParamSpec("_Checked")


def _promising(check: Callable[_Checked, None]) -> Callable[_Checked, None]:
    """The check, which raises ConformanceError also where the part that is checked raises something unexpected."""

    @wraps(check)
    def checked(*arguments: _Checked.args, **settings: _Checked.kwargs) -> None:
        try:
            check(*arguments, **settings)
        except AutoPolyError as error:
            if isinstance(error, ConformanceError):
                raise
            raise ConformanceError(f"it raises {type(error).__name__}: {error}") from error
        except Exception as error:  # whatever somebody else's code may do
            raise ConformanceError(f"it raises {described(error)}") from error

    return checked


_AXIS = 0.5  # of the symmetric ones among the sample meshes
_LOOK = 32  # pixels a side at which a rendering is looked at
_NO_SCORE = {"iou": 0.0, "complexity": 0, "self_intersections": 0, "total": 0.0}


@_promising
def check_operator(operator: Operator, meshes: Iterable[PolyMesh] | None = None) -> None:
    """Check an operator on every element of some meshes (by default of a few with concave faces and holes).

    Rules: the mask has one bool per element and says where `apply` works; elsewhere it raises IllegalActionError. The
    mesh that comes out is valid; V - E + F is components - holes; (V, E, F) change by `changes` at most, an increase
    exactly, or by `varies` at most; ids are never reused and what survives keeps its id; the same input gives the same
    mesh and is not touched. A step of it, written as JSON, replays to the same mesh; what does not show leaves the
    rendering as it is; new vertices come from somewhere; there are words for it; the mirror image of a symmetric mesh's
    action is one.
    """
    _require(operator.takes in ("", "all", "edge", "vertex"), f"{operator.name}: takes must be all, edge, vertex or ''")
    with _known(operator):
        for mesh in sample_meshes() if meshes is None else meshes:
            n, mask = operator.element.count(mesh), operator.mask(mesh)
            is_mask = isinstance(mask, np.ndarray) and mask.shape == (n,) and mask.dtype == np.bool_
            _require(is_mask, f"{operator.name} on {mesh}: the mask must be ({n},) bool")
            for element in (-1, *range(n), n):
                where = f"{operator.name} on {operator.element.name} {element} of {mesh}"
                legal = 0 <= element < n and bool(mask[element])
                _check_edit(operator, mesh, element, legal, where)


@_promising
def check_simulator(simulator: Simulator, n_steps: int = 30, seed: int = 0) -> None:
    """Check a simulator by playing `n_steps` random actions.

    Rules: STOP is legal until the end, nothing after it; every action it calls legal works or has no room, another
    raises IllegalActionError; no transition brings a crossing, or a flipped or empty face; the same state and action
    give the same state, alone, in `transition_all` and in `step_many`; a transition leaves the state it starts from as
    it was, and its refits are counted; scores are those of the meshes; states pickle; `max_steps` is kept, and so is
    the rule of faces.
    """
    rng = np.random.default_rng(seed)
    state = simulator.initial()
    _require(_same_state(state, simulator.initial()), "the initial state is not the same twice")
    for step in range(n_steps):
        if state.done:
            state = simulator.initial()
            if state.done:
                return
        legal = simulator.legal_actions(state)
        _require(legal[:1] == [STOP], f"step {step}: STOP is not the first legal action")
        _require(simulator.transition(state, STOP).done == "stop", f"step {step}: STOP does not end the game")
        if len(legal) == 1:
            return
        state = _checked_transition(simulator, state, legal[rng.integers(1, len(legal))], f"step {step}")
    ended = simulator.transition(state, STOP) if not state.done else state
    _require(simulator.legal_actions(ended) == [], "something is legal after the end")
    _require(
        _raises(IllegalActionError, lambda: simulator.transition(ended, STOP)), "a step after the end is not refused"
    )


@_promising
def check_target_source(source: TargetSource, n: int = 10) -> None:
    """Check a source of targets with the seeds 0 to `n` - 1.

    Rules: it has a name; every seed gives a `Silhouette`, the same each time and from a pickled copy; not all are alike
    (unless there is but one seed); a negative seed raises ConfigError.
    """
    _require(isinstance(source.name, str) and bool(source.name), "a source of targets needs a name")
    copy = pickle.loads(pickle.dumps(source))
    seen = set()
    for seed in range(n):
        shape = source.sample(seed)
        _require(isinstance(shape, Silhouette), f"seed {seed} gives {type(shape).__name__}: expected a Silhouette")
        for other in (source.sample(seed), copy.sample(seed)):
            same = other.name == shape.name and np.array_equal(other.mask, shape.mask)
            _require(same, f"seed {seed} gives another target the second time")
        seen.add(shape.mask.tobytes())
    _require(len(seen) > 1 or n < 2, f"{n} seeds give one and the same target")
    _require(_raises(ConfigError, lambda: source.sample(-1)), "seed -1 is not refused with a ConfigError")


@_promising
def check_format(made: Format) -> None:
    """Check a format that sequences are exported to.

    Rules: for a sequence with steps, one without and, where it shows them, a target and a depth, a file of each of its
    endings is written, in a folder that has to be made, and nothing beside it; the same export gives the same bytes,
    and the sequence stays as it was; a place that cannot be written raises OutputError.
    """
    for export in _sample_exports(made):
        before = export.sequence.to_json()
        for suffix in made.suffixes:
            where = f"format {made.name}, {len(export.sequence.steps)} steps, {suffix}"
            with tempfile.TemporaryDirectory() as folder:
                paths = [Path(folder) / name / f"shape{suffix}" for name in ("one", "two")]
                for path in paths:
                    _written(made, export, path, where)
                    _require(
                        path.is_file() and path.stat().st_size > 0, f"{where}: there is no such file, or it is empty"
                    )
                    _require(list(path.parent.iterdir()) == [path], f"{where}: more than the file was left")
                _require(paths[0].read_bytes() == paths[1].read_bytes(), f"{where}: not the same bytes twice")
                refused = _raises(OutputError, lambda: made.write(export, paths[0] / f"below{suffix}"))  # noqa: B023
                _require(refused, f"{where}: a place that cannot be written is no OutputError")
        _require(export.sequence.to_json() == before, f"format {made.name} changed the sequence")


def _sample_exports(made: Format) -> Iterator[Export]:
    """A sequence of one step, the same before it, and with whatever the format shows."""
    mesh = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)
    action = Action("edge_extrude", 0)
    after = OPERATORS[action.operator].apply(mesh, action.element)
    sequence = ConstructionSequence.record({}, mesh, _NO_SCORE, [(action, None, after, _NO_SCORE)])
    yield from (Export(sequence), Export(sequence.trim(0)))
    if made.shows_target:
        yield Export(sequence, target=Silhouette(np.eye(_LOOK, dtype=bool)))
    if made.shows_depth:
        yield Export(sequence, depth=0.25)
    if "size" in made.options:
        yield Export(sequence, size=32.0)
    switches = {"triangles", "layers"}.intersection(made.options)
    if switches:
        yield Export(sequence, triangles="triangles" in switches, layers="layers" in switches)
    if "half" in made.options:
        yield Export(sequence.trim(0), half=True)


def _written(made: Format, export: Export, path: Path, where: str) -> None:
    try:
        made.write(export, path)
    except Exception as error:
        raise ConformanceError(f"{where}: {type(error).__name__}: {error}") from error


@_promising
def check_env(env: Any, n_steps: int = 60, seed: int = 0) -> None:
    """Check of an AutoPoly environment, wrapped or not, what Gymnasium's own `check_env` does not.

    Rules: STOP is always legal; an action that the mask forbids is invalid and leaves the shape alone; one that has no
    room leaves it alone, too, but is not invalid; infos have the same keys, types, dtypes and shapes at every step;
    restoring a state and playing on gives the same trace, bit for bit, and so does a copy of the state from a pickle.
    """
    rng = np.random.default_rng(seed)
    _, info = env.reset(seed=seed)
    start = env.unwrapped.clone_state()
    actions, trace = [], []
    for step in range(n_steps):
        _require(info["action_mask"][0] == 1, f"step {step}: the mask forbids STOP")
        choices = np.flatnonzero(info["action_mask"] == (step % 5 != 4))  # every fifth action is an illegal one
        actions.append(int(rng.choice(choices[choices > 0])) if choices.any() else 0)
        outcome = _checked_step(env, actions[-1], info, f"step {step}")
        info = outcome[-1]
        trace.append(_comparable(outcome))
        if outcome[2] or outcome[3]:
            break
    for state in (start, pickle.loads(pickle.dumps(start))):
        env.reset(options={"state": state})
        for step, (action, expected) in enumerate(zip(actions, trace, strict=True)):
            _require(_comparable(env.step(action)) == expected, f"step {step} is another one after a restore")


def sample_meshes() -> list[PolyMesh]:
    """A rectangle, a grid, one with a corner gone, an L, a ring, two squares that touch in a point, and two apart."""
    ring = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9), (0.3, 0.3), (0.7, 0.3), (0.7, 0.7), (0.3, 0.7)]
    bend = [(0.1, 0.1), (0.4, 0.1), (0.4, 0.6), (0.9, 0.6), (0.9, 0.9), (0.1, 0.9)]
    corner = [(0.1, 0.1), (0.5, 0.1), (0.5, 0.5), (0.1, 0.5), (0.9, 0.5), (0.9, 0.9), (0.5, 0.9)]
    pair = [(0.1, 0.1), (0.4, 0.1), (0.4, 0.4), (0.1, 0.4), (0.6, 0.6), (0.9, 0.6), (0.9, 0.9), (0.6, 0.9)]
    return [
        PolyMesh.rectangle(0.2, 0.3, 0.8, 0.7),
        PolyMesh.grid(2, 0.1, 0.1, 0.9, 0.9),
        OPERATORS["face_delete"].apply(PolyMesh.grid(2, 0.1, 0.1, 0.9, 0.9), 0),  # the id of a vertex is free
        PolyMesh.from_faces(bend, [range(6)]),
        PolyMesh.from_faces(ring, [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]),
        PolyMesh.from_faces(corner, [(0, 1, 2, 3), (2, 4, 5, 6)]),
        PolyMesh.from_faces(pair, [(0, 1, 2, 3), (4, 5, 6, 7)]),
    ]


@contextmanager
def _known(operator: Operator) -> Iterator[None]:
    """The operator under its name in the registry, whatever stood there before."""
    before = OPERATORS.get(operator.name)
    OPERATORS[operator.name] = operator
    try:
        yield
    finally:
        if before is None:
            del OPERATORS[operator.name]
        else:
            OPERATORS[operator.name] = before


def _check_edit(operator: Operator, mesh: PolyMesh, element: int, legal: bool, where: str) -> None:
    untouched = pickle.loads(pickle.dumps(mesh))
    if not legal:
        _require(
            _raises(IllegalActionError, lambda: operator.apply(mesh, element)), f"{where} is illegal, yet it works"
        )
        return
    after = operator.apply(mesh, element)
    _require(mesh == untouched, f"{where} changed the mesh that it was given")
    _require(after == operator.apply(mesh, element), f"{where} does not give the same twice")
    _require(is_valid(after), f"{where} gives a mesh that is not valid")
    n_vertices, n_edges, n_faces = after.counts
    parts, holes = after.topology.n_components, after.topology.n_holes
    _require(n_vertices - n_edges + n_faces == parts - holes, f"{where} breaks V - E + F = components - holes")
    allowed = operator.change_at(mesh, element)
    for letter, old, new, change in zip("VEF", mesh.counts, after.counts, allowed, strict=True):
        kept = new - old == change if change > 0 and operator.varies is None else new - old <= change
        _require(kept, f"{where} changes {letter} by {new - old}, not by {change}")
    _check_telling(operator, mesh, element, after, where)
    _check_mirror(operator, mesh, element, where)
    for kind in ("vertex", "face"):
        ids, next_id = getattr(after, f"{kind}_ids"), getattr(mesh, f"next_{kind}_id")
        old_ids = getattr(mesh, f"{kind}_ids")
        fresh = [name for name in ids if name not in old_ids]
        _require(all(name >= next_id for name in fresh), f"{where} reuses {kind} ids: {fresh}")
        survivors = [name for name in ids if name in old_ids]
        _require(
            survivors == [name for name in old_ids if name in ids], f"{where} puts the {kind} ids in another order"
        )


def _check_telling(operator: Operator, mesh: PolyMesh, element: int, after: PolyMesh, where: str) -> None:
    """What a sequence, a drawing and a reader are told of an edit."""
    choice = operator.choose(mesh, element)
    _require(choice is None or operator.choice is not None, f"{where} makes a choice that no codec writes down")
    transition = (Action(operator.name, element), choice, after, _NO_SCORE)
    sequence = ConstructionSequence.record({}, mesh, _NO_SCORE, [transition])
    replayed = ConstructionSequence.from_json(sequence.to_json())
    _require(replayed.final() == after, f"{where}: the step does not replay to the same mesh")
    _, again, found = decoded(mesh, replayed.steps[0])
    _require((again, found) == (element, choice), f"{where}: its ids do not lead back to element and choice")
    step = replayed.steps[0]
    words = describe_step(step, 0)
    deeds = operator.told.keys(step)
    _require(all((words.title, words.done, deeds, *deeds)), f"{where}: there are no words for it")
    sources = operator.sources_of(mesh, element, choice, after)
    n_new = after.next_vertex_id - mesh.next_vertex_id
    _require(
        sources.shape == (n_new, 2) and bool(np.isfinite(sources).all()),
        f"{where}: sources must be ({n_new}, 2) finite places, one for each new vertex",
    )
    if not operator.shows(mesh, element):
        same = np.allclose(coverage(mesh, _LOOK), coverage(after, _LOOK), atol=1e-9)
        _require(same, f"{where} does not show, it says, yet the rendering changes")
    if operator.blender is not None:
        arguments = operator.blender(mesh, element, choice)
        _require(isinstance(arguments, list), f"{where}: blender must give a list of arguments")


def _check_mirror(operator: Operator, mesh: PolyMesh, element: int, where: str) -> None:
    """On a symmetric mesh every start that the operator gives is symmetric, too."""
    images = images_of(mesh, _AXIS)
    if operator.mirror is None or images is None or not operator.shows(mesh, element):
        return
    choice = operator.choose(mesh, element)
    plain = Start(choice, operator.apply(mesh, element, choice))
    of = Mirroring(mesh, images, _AXIS, Action(operator.name, element))
    try:
        starts = list(operator.mirror(of, plain))
    except IllegalActionError:  # the action alone is legal, both together are not
        return
    for start in starts:
        _require(
            images_of(start.mesh, _AXIS) is not None, f"{where}: with its mirror image the outline is not symmetric"
        )
        if start.halfway is not None:
            between = operator.apply(start.halfway.mesh, start.halfway.action.element, start.halfway.choice)
            _require(
                between.with_vertices(start.mesh.vertices) == start.mesh,
                f"{where}: its mirror image is not what leads from halfway to the start",
            )


def _checked_transition(simulator: Simulator, state: State, action: Any, where: str) -> State:
    where = f"{where}, {action.operator} {action.element}"
    before, n_refits = pickle.dumps(state), simulator.n_refits
    try:
        after = simulator.transition(state, action)
    except IllegalActionError:
        _require(not simulator.transition_all(state, [action]), f"{where} has no room in transition alone")
        return state
    _require(simulator.n_refits - n_refits == after.n_refits, f"{where}: the simulator does not count its refits")
    worse = any(now > then for now, then in zip(defects_of(after.mesh), defects_of(state.mesh), strict=True))
    _require(not worse, f"{where}: edges cross, or a face is flipped or empty, that was not before")
    _require(_same_state(after, simulator.transition(state, action)), f"{where} does not give the same state twice")
    (batched,) = simulator.transition_all(state, [action]) or (None,)
    _require(batched is not None and _same_state(after, batched), f"{where} gives another state in transition_all")
    _require(pickle.dumps(state) == before, f"{where} changed the state that it started from")
    _require(_same_state(after, pickle.loads(pickle.dumps(after))), f"{where}: the state does not survive pickling")
    _require(after.score == simulator.score(after.mesh, state.mesh), f"{where}: the score is not that of the mesh")
    _require(after.step == state.step + 1, f"{where}: the step is not counted")
    _require(is_valid(after.mesh), f"{where} gives a mesh that is not valid")
    _require(not broken_faces(after.mesh, simulator.faces), f"{where} breaks the rule of faces")
    _require(bool(after.done) or after.step < simulator.max_steps, f"{where}: max_steps is not kept")
    (stepped, refused) = simulator.step_many([state, replace(state, done="stop")], [action, action])
    _require(stepped is not None and _same_state(after, stepped), f"{where} gives another state in step_many")
    _require(refused is None, f"{where}: step_many goes on from a state that is over")
    return after


def _same_state(a: State, b: State) -> bool:
    return a.mesh == b.mesh and (a.score, a.step, a.done, a.action, a.choice) == (
        b.score, b.step, b.done, b.action, b.choice
    )  # fmt: skip


def _checked_step(env: Any, action: int, before: dict[str, Any], where: str) -> tuple[Any, ...]:
    mask = before["action_mask"]
    _require(np.array_equal(mask == 1, env.unwrapped.action_masks()), f"{where}: action_masks() is not the info's mask")
    outcome = env.step(action)
    info = outcome[-1]
    types = [{name: _type_of(value) for name, value in one.items()} for one in (before, info)]
    _require(types[0] == types[1], f"{where}: the infos have other keys or types than before")
    illegal = mask[action] == 0
    invalid = info["invalid_action"]
    is_same = info["r_all"] == before["r_all"]
    _require(invalid == illegal, f"{where}: invalid_action is wrong about action {action}")
    _require(is_same or not illegal, f"{where}: an illegal action changed the shape")
    return tuple(outcome)


def _type_of(value: Any) -> tuple[Any, ...]:
    """What of a value vector environments take from the first one: its type, dtype and shape."""
    return type(value), getattr(value, "dtype", None), getattr(value, "shape", None)


def _comparable(outcome: Any) -> tuple[Any, ...]:
    """Reward, end and info of a step as values that == compares."""
    _, reward, terminated, truncated, info = outcome
    plain = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in info.items()}
    return reward, terminated, truncated, plain


def _raises(error: type[AutoPolyError], call: Callable[[], object]) -> bool:
    try:
        call()
    except error:
        return True
    return False


def _require(holds: bool | np.bool_, rule: str) -> None:
    if not holds:
        raise ConformanceError(rule)
