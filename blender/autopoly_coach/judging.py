"""Where a mesh stands in a lesson: the step that is done, and what differs from the next one."""

from dataclasses import dataclass

from .comparing import Shape, differences, shape_of, summary
from .lesson import Lesson, Step

DONE, WAITING, WRONG, BACK, LOST = "done", "waiting", "wrong", "back", "lost"


@dataclass(frozen=True)
class Verdict:
    """What there is to say about a mesh."""

    what: str  # DONE: it is the next step's; WAITING: as before; WRONG; BACK: an earlier one's; LOST: none's
    done: int  # the step that is done now
    words: str


def goal(step: Step) -> Shape:
    """The mesh after a step."""
    return shape_of(step.vertices, step.faces)


def fits(found: Shape, step: Step, tolerance: float) -> bool:
    """Whether a mesh is the one after a step."""
    return found.counts == step.counts and not differences(found, goal(step), tolerance)


def judge(found: Shape, lesson: Lesson, done: int, tolerance: float) -> Verdict:
    """Whether the step after `done` has been made of the mesh; what differs if not."""
    if done < lesson.last and fits(found, lesson.steps[done + 1], tolerance):
        return Verdict(DONE, done + 1, praise(lesson, done + 1))
    if fits(found, lesson.steps[done], tolerance):
        return Verdict(WAITING, done, task(lesson, done))
    earlier = step_of(found, lesson, done, tolerance)
    if earlier is not None:
        return Verdict(BACK, earlier, f"Back at step {earlier}. {task(lesson, earlier)}")
    behind = differences(found, goal(lesson.steps[done]), tolerance)
    ahead = differences(found, goal(lesson.steps[min(done + 1, lesson.last)]), tolerance)
    if found.counts == lesson.steps[done].counts and len(behind) < len(ahead):
        return Verdict(WRONG, done, f"The mesh of step {done} has changed: {summary(behind)}")
    return Verdict(WRONG, done, summary(ahead))


def step_of(found: Shape, lesson: Lesson, before: int, tolerance: float) -> int | None:
    """The last step before `before` that a mesh is of, where there is one: an undo leads there."""
    earlier = range(before - 1, -1, -1)
    return next((number for number in earlier if fits(found, lesson.steps[number], tolerance)), None)


def stands_at(found: Shape, lesson: Lesson, done: int, tolerance: float) -> Verdict:
    """Whether a mesh is that of the step `done`, or else where it comes from."""
    if fits(found, lesson.steps[done], tolerance):
        return Verdict(DONE, done, "")
    told = summary(differences(found, goal(lesson.steps[done]), tolerance))
    return Verdict(LOST, done, f"This is not the mesh of step {done}: {told} Undo (Ctrl Z), or press Restore.")


def praise(lesson: Lesson, done: int) -> str:
    """What is said when a step is done."""
    return f"Step {done} is right. {task(lesson, done)}"


def task(lesson: Lesson, done: int) -> str:
    """What comes after a step."""
    if done == lesson.last:
        return f"That was the last step: {lesson.name} is done."
    return f"Your turn: step {done + 1}, {lesson.steps[done + 1].title}."
