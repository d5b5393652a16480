"""Styles of building: which agent, operators, rule of faces and regularities go together."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from autopoly_env.errors import ConfigError


@dataclass(frozen=True)
class Style:
    """What a command takes where nothing else is asked for."""

    agent: str
    operators: str
    faces: str
    symmetry: str = "off"  # as the option: auto, best, off or the x of the axis
    align: bool = False

    def with_choices(
        self, agent: str | None, operators: str | None, faces: str | None, symmetry: str | None, align: bool | None
    ) -> "Style":
        """The style with what was chosen, None where nothing was, in place of its own.

        Another agent than the style's own is asked for no symmetry of itself.
        """
        own = self if agent in (None, self.agent) else replace(self, symmetry="off")
        return Style(
            agent or own.agent,
            operators or own.operators,
            faces or own.faces,
            symmetry or own.symmetry,
            own.align if align is None else align,
        )

    def __str__(self) -> str:
        regular = f" --symmetry {self.symmetry} --align" if self.align else ""
        return f"--agent {self.agent} --operators {self.operators} --faces {self.faces}{regular}"


STYLES = {
    # convex quads and few triangles, extruded from the main body outwards, regular where the picture is
    "modeller": Style("quads", "modeller", "quads", "auto", align=True),
    "paper": Style("mcts", "full", "any"),  # the highest r_all: outlines, told from coarse to fine
}


def style_named(name: str) -> Style:
    """The style of that name. Raises ConfigError if there is none."""
    if name not in STYLES:
        raise ConfigError(f"--style {name}: expected one of {', '.join(STYLES)}")
    return STYLES[name]


def default_style(told_otherwise: Iterable[object]) -> str:
    """The style where none is named: the modeller's, unless something is given (not None) that names another way."""
    return "modeller" if all(given is None for given in told_otherwise) else "paper"


def describe_styles() -> str:
    """All of them in words, for help texts."""
    return "; ".join(f"{name} is {style}" for name, style in STYLES.items())
