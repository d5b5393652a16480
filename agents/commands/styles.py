"""Styles of building: which agent, operators and rule of faces go together."""

from dataclasses import dataclass, replace

from autopoly_env.errors import ConfigError


@dataclass(frozen=True)
class Style:
    """What a command takes where nothing else is asked for."""

    agent: str
    operators: str
    faces: str

    def with_choices(self, agent: str | None, operators: str | None, faces: str | None) -> "Style":
        """The style with what was chosen, None where nothing was, in place of its own."""
        chosen = {"agent": agent, "operators": operators, "faces": faces}
        return replace(self, **{name: value for name, value in chosen.items() if value is not None})


STYLES = {
    "paper": Style("mcts", "full", "any"),  # the highest r_all: outlines, told from coarse to fine
    "modeller": Style("quads", "modeller", "quads"),  # convex quads and few triangles, extruded from the main body
}
DEFAULT_STYLE = "paper"


def style_named(name: str) -> Style:
    """The style of that name. Raises ConfigError if there is none."""
    if name not in STYLES:
        raise ConfigError(f"--style {name}: expected one of {', '.join(STYLES)}")
    return STYLES[name]


def describe_styles() -> str:
    """All of them in words, for help texts."""
    return "; ".join(
        f"{name} is --agent {style.agent} --operators {style.operators} --faces {style.faces}"
        for name, style in STYLES.items()
    )
