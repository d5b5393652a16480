"""Options of commands that read construction sequences: operators from outside that these use, the rule of faces."""

from typing import Annotated

import typer

OutsideOperators = Annotated[
    str | None,
    typer.Option(
        "--operators",
        metavar="NAMES",
        help="Operators from outside that the sequence uses, my.module:my_operator, separated by commas.",
        show_default="ours",
    ),
]


FaceRuleOfSequence = Annotated[
    str | None,
    typer.Option(
        "--faces", help="Rule of faces to keep: any, convex or quads.", show_default="the sequence's, if it has one"
    ),
]


def know(operators: str | None) -> None:
    """Make the operators that are named known to this process. Raises ConfigError for what is no operator."""
    from autopoly_env.operators import preset

    if operators is not None:
        preset(operators)
