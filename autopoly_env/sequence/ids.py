"""Between a mesh, where elements have indices that change, and a construction sequence, where they have ids."""

from typing import Any

from autopoly_env.errors import ConfigError, SequenceError
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import Choice, Operator
from autopoly_env.operators import operator_named as registered
from autopoly_env.sequence.file import Step
from autopoly_env.shown import short


def choice_ids(mesh: PolyMesh, operator: Operator, element: int, choice: Choice | None) -> dict[str, Any] | None:
    """The choice as a step names it. Raises SequenceError if the operator has none."""
    if choice is None:
        return None
    if operator.choice is None:
        raise SequenceError(f"choice {short(choice)}: {operator.name} leaves nothing to choose")
    return operator.choice.ids(mesh, element, choice)


def choice_indices(mesh: PolyMesh, operator: Operator, element: int, choice: dict[str, Any] | None) -> Choice | None:
    """The choice that the ids name. Raises SequenceError if the operator has no such choice."""
    if choice is not None and operator.choice is not None:
        return operator.choice.indices(mesh, element, choice)
    if choice is None and operator.choice is None:
        return None
    raise SequenceError(f"choice {short(choice)} is not one of {operator.name}; see docs/sequence-format.md")


def decoded(mesh: PolyMesh, step: Step) -> tuple[Operator, int, Choice | None]:
    """The operator of a step from `mesh`, and the indices there of its element and its choice.

    Raises SequenceError or MeshError for what there is not.
    """
    operator = operator_named(step.operator)
    element = operator.element.index(mesh, step.element)
    return operator, element, choice_indices(mesh, operator, element, step.choice)


def operator_named(name: str) -> Operator:
    """The operator of that name. Raises SequenceError if there is none."""
    try:
        return registered(name)
    except ConfigError as error:
        raise SequenceError(str(error)) from None
