"""A check for an agent of your own, as `autopoly_env.conformance` has for operators, simulators and targets.

Example, in a test:

>>> from agents.registry import make_agent
>>> check_agent(make_agent("random", n_steps=3))
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from agents.base import Agent, Decision
from agents.budget import Budget, Progress
from agents.contract import solved
from agents.solution import Solution
from autopoly_env.errors import AutoPolyError, ConfigError, ConformanceError, IllegalActionError
from autopoly_env.mesh import PolyMesh, broken_faces, images_of
from autopoly_env.operators import Action
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from autopoly_env.simulator import Simulator, State

N_ACTS = 5  # actions that are asked for
_MAX_STEPS = (0, 1, 2, 9)  # limits that are tried
_REFITS = (0, 1, 5, 30)  # budgets that are tried
_REPORTS = (1, 2, 4)  # after which Ctrl-C is pressed
_START = PolyMesh.rectangle(0.25, 0.25, 0.75, 0.75)  # that is gone on from


def check_agent(
    agent: Agent, silhouettes: Sequence[Silhouette] | None = None, *, reports_a_step: int = 1, **settings: Any
) -> None:
    """Check an agent on two or more silhouettes (by default two small ones), with `settings` of `Simulator`.

    Rules: `solve` returns a Solution whose sequence replays to its mesh, bit for bit, within `max_steps` and with the
    simulator's operators; its scores are the simulator's and the last is the best; the same target gives the same
    sequence, whatever was solved in between. Progress is reported, and never goes back; a budget is overrun by one step
    of work at most, which may make `reports_a_step`; a KeyboardInterrupt in a report ends the search with a Solution.
    `act` decides for legal actions. An agent that `takes_guidance` leaves locked vertices where they are, one that
    `takes_symmetry` ends symmetric; another raises ConfigError. Every mesh of one that `takes_faces` keeps the rule;
    another raises, too.

    Returns None, or raises ConformanceError naming the rule that was broken.
    """
    _require(isinstance(agent, Agent), f"{agent!r} is no agent: expected a subclass of agents.base.Agent")
    _require(isinstance(agent.name, str) and bool(agent.name), "an agent needs a name")
    shapes = sample_silhouettes() if silhouettes is None else silhouettes
    settings = {"resolution": 32, **settings}
    games = [Simulator(shape, **settings) for shape in shapes]
    once = [solved(agent, game) for game in games]
    for game, solution in zip(games, once, strict=True):
        check_solution(solution, game)
    for game, solution in zip(games, once, strict=True):
        same = solved(agent, game).sequence.to_json() == solution.sequence.to_json()
        _require(same, "the same target gives another sequence the second time")
    _check_acts(agent, games[-1])
    for max_steps in _MAX_STEPS:
        limited = Simulator(shapes[-1], **{**settings, "max_steps": max_steps})
        check_solution(solved(agent, limited), limited)
    _check_progress_and_budgets(agent, games[-1], reports_a_step)
    _check_interrupts(agent, games[-1])
    _check_guidance(agent, shapes[-1], settings)
    _check_faces(agent, shapes[-1], settings)


def check_solution(solution: Solution, simulator: Simulator) -> None:
    """Check that a solution is what its sequence builds, and is worth what it says. Raises ConformanceError."""
    sequence = ConstructionSequence.from_json(solution.sequence.to_json())
    try:
        meshes = sequence.meshes()
    except AutoPolyError as error:
        raise ConformanceError(f"the sequence does not replay: {error}") from None
    same = meshes[-1] == solution.mesh and meshes[-1].vertices.tobytes() == solution.mesh.vertices.tobytes()
    _require(same, f"the sequence builds {meshes[-1]}, the mesh is {solution.mesh}: they must be the same, bit for bit")
    _require(solution.score == simulator.final_score(solution.mesh), "the score is not the mesh's `final_score`")
    scores = [sequence.start_score, *(step.score for step in sequence.steps)]
    for number, (mesh, score) in enumerate(zip(meshes, scores, strict=True)):
        _require(simulator.final_score(mesh).as_dict() == score, f"step {number}: the score is not its `final_score`")
    if not simulator.weights.w_locality:  # which may make it worth its while to stop early
        ends = [k for k, mesh in enumerate(meshes) if simulator.guidance.is_symmetric(mesh)]
        best = max(ends, key=lambda k: (scores[k]["total"], -k), default=len(meshes) - 1)
        _require(best == len(meshes) - 1, "the sequence goes on after its best mesh")
    n_new = len(sequence.steps) - (0 if simulator.guidance.earlier is None else len(simulator.guidance.earlier.steps))
    most = simulator.max_steps * (1 if simulator.guidance.axis is None else 2)  # an action and its mirror image
    _require(n_new <= most, f"{n_new} steps: max_steps = {simulator.max_steps} is not kept")
    others = {step.operator for step in sequence.steps} - set(simulator.operators)
    _require(not others, f"the sequence uses {', '.join(others)}, which the simulator does not have")
    for number, mesh in enumerate(meshes):
        _require(not broken_faces(mesh, simulator.faces), f"step {number}: the mesh breaks faces={simulator.faces}")
    told = {**simulator.settings(), "scored_at": simulator.silhouette.resolution}
    kept = {name: sequence.settings.get(name) for name in told} == told
    _require(kept, "the sequence's settings lack the simulator's `settings()` or `scored_at`")


def sample_silhouettes() -> list[Silhouette]:
    """A tower on a wide foot, and a frame with a bar beside it; 40 x 40 pixels."""
    tower, frame = np.zeros((2, 40, 40), np.bool_)
    tower[6:34, 14:26] = tower[28:34, 6:34] = True
    frame[6:34, 4:26] = frame[10:24, 30:35] = True
    frame[14:26, 10:20] = False
    return [Silhouette(tower, "tower"), Silhouette(frame, "frame")]


def _check_acts(agent: Agent, simulator: Simulator) -> None:
    state = simulator.initial()
    for _ in range(N_ACTS):
        if state.done:
            return
        action = _checked_decision(agent, simulator, state)
        try:
            state = simulator.transition(state, action)
        except IllegalActionError:  # a hole that fits nowhere, which is known when it is tried
            return


def _checked_decision(agent: Agent, simulator: Simulator, state: State) -> Action:
    decision: Any = agent.act(simulator, state)
    where = f"step {state.step}: act"
    _require(isinstance(decision, Decision), f"{where} returned {decision!r:.60}; expected a Decision")
    legal = set(simulator.legal_actions(state))
    _require(decision.action in legal, f"{where} decided for {decision.action!r:.60}, which is not legal")
    _require(legal.issuperset(decision.policy), f"{where} has actions in its policy that are not legal")
    shares = list(decision.policy.values())
    is_distribution = not shares or (min(shares) >= 0.0 and abs(sum(shares) - 1.0) < 1e-6)
    _require(is_distribution, f"{where} has a policy that does not sum to 1")
    is_number = decision.value is None or bool(np.isfinite(decision.value))
    _require(is_number, f"{where} expects {decision.value}: give a finite value or None")
    action: Action = decision.action
    return action


def _check_progress_and_budgets(agent: Agent, simulator: Simulator, reports_a_step: int) -> None:
    for refits in (None, *_REFITS):
        reports: list[Progress] = []
        solution = solved(agent, simulator, Budget(refits), reports.append)
        check_solution(solution, simulator)
        where, reason = f"a budget of {refits} refits", solution.stats.stopped_by
        _require(bool(reports) or refits == 0, f"{where}: no progress is reported")
        most = max((report.n_refits for report in reports), default=0)
        _require(most <= solution.stats.n_refits, f"{where}: more refits are reported than counted")
        for before, after in pairwise(reports):
            forward = after.best_total >= before.best_total and after.n_refits >= before.n_refits
            _require(forward and after.n_steps > before.n_steps, f"{where}: the progress goes back")
        if refits is not None:
            late = [report for report in reports[:-reports_a_step] if report.n_refits >= refits]
            _require(not late, f"{where}: it goes on after {late[0].n_refits if late else 0}")
            _require(
                reason in ("refits", "finished"), f"{where}: stopped_by is {reason!r}; expected refits or finished"
            )


def _check_interrupts(agent: Agent, simulator: Simulator) -> None:
    """Ctrl-C in a report: a solution all the same, and no report after it."""
    reports: list[Progress] = []
    solved(agent, simulator, on_progress=reports.append)
    for call in (k for k in _REPORTS if k <= len(reports)):
        press, where = _CtrlC(call), f"KeyboardInterrupt in report {call}"
        try:
            solution = solved(agent, simulator, on_progress=press)
        except KeyboardInterrupt:
            raise ConformanceError(f"{where} comes out of solve: return the best so far") from None
        reason = solution.stats.stopped_by
        _require(reason == "interrupted", f"{where}: stopped_by is {reason!r}; expected interrupted")
        _require(press.n_calls == call, f"{where}: the search goes on")
        check_solution(solution, simulator)


class _CtrlC:
    """Is reported to, and interrupts in the call-th report, from 1."""

    def __init__(self, call: int) -> None:
        self._call, self.n_calls = call, 0

    def __call__(self, _: Progress) -> None:
        self.n_calls += 1
        if self.n_calls == self._call:
            raise KeyboardInterrupt


def _check_guidance(agent: Agent, silhouette: Silhouette, settings: dict[str, Any]) -> None:
    wishes: tuple[dict[str, Any], ...] = ({"start": _START, "locked": (0, 1)}, {"symmetry": 0.5})
    for wish in wishes:
        simulator = Simulator(silhouette, **{**settings, **wish})
        if not (agent.takes_symmetry if "symmetry" in wish else agent.takes_guidance):
            what = f"it does not take guidance, yet does not refuse {', '.join(wish)} with a ConfigError"
            _require(_refuses(agent, simulator), what)
            continue
        solution = solved(agent, simulator, Budget(refits=60))
        check_solution(solution, simulator)
        for number, mesh in enumerate(solution.sequence.meshes()):
            if "locked" in wish:
                held = [mesh.vertices[mesh.vertex_index(name)].tolist() for name in wish["locked"]]
                where = f"step {number}: a locked vertex is not where it was"
                _require(held == _START.vertices[list(wish["locked"])].tolist(), where)
        if "symmetry" in wish:
            _require(images_of(solution.mesh, 0.5) is not None, "the mesh is not symmetric about the axis asked for")


def _check_faces(agent: Agent, silhouette: Silhouette, settings: dict[str, Any]) -> None:
    simulator = Simulator(silhouette, **{**settings, "faces": "quads"})
    if agent.takes_faces:
        check_solution(solved(agent, simulator, Budget(refits=60)), simulator)
    else:
        what = "it keeps no rule of faces, yet does not refuse faces=quads with a ConfigError"
        _require(_refuses(agent, simulator), what)


def _refuses(agent: Agent, simulator: Simulator) -> bool:
    try:
        agent.solve(simulator)
    except ConfigError:
        return True
    return False


def _require(holds: bool, rule: str) -> None:
    if not holds:
        raise ConformanceError(rule)
