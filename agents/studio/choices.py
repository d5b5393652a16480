"""What the page lets one choose of a search, as the options of `agents.solve` that give the same result."""

import shlex
from dataclasses import asdict, dataclass
from typing import Any

from agents.budget import Budget
from agents.commands import pictures
from agents.commands.solving import Settings
from agents.commands.styles import Style, style_named
from agents.commands.wishes import read_words
from agents.studio.painting import levels_of
from autopoly_env.errors import ConfigError
from autopoly_env.guidance import read_importance
from autopoly_env.score import ScoreWeights
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.shown import short
from autopoly_env.silhouette import DEFAULT_OPTIONS, ObjectOptions, Silhouette

RESOLUTION, MAX_STEPS = 128, 100  # the defaults of agents.solve
GOES_ON = "mcts"  # the agent that goes on from a mesh
LEAST_PRICE, MOST_PRICE, MOST_SECONDS, MOST_REFITS = 0.001, 20.0, 3600.0, 1_000_000


@dataclass(frozen=True)
class Choices:
    """The options of a search; None where the style or the agent decides."""

    style: str = "modeller"
    w_sc: float = 0.3  # price of an element
    seconds: float | None = None
    refits: int | None = None
    seed: int = 0
    symmetry: str | None = None  # auto, best, off, or the x of the axis
    align: bool | None = None
    keep: str | None = None

    def __post_init__(self) -> None:
        style_named(self.style)
        read_words(None, self.symmetry, self.keep)
        for name, least, most in (
            ("w_sc", LEAST_PRICE, MOST_PRICE),
            ("seconds", 0.1, MOST_SECONDS),
            ("refits", 1, MOST_REFITS),
            ("seed", 0, 2**31),
        ):
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise ConfigError(f"{name} {short(value)}: expected {least:g} to {most:g}")


@dataclass(frozen=True, eq=False)
class Task:
    """One search: all that its result depends on."""

    silhouette: Silhouette
    picture: ObjectOptions = DEFAULT_OPTIONS
    choices: Choices = Choices()
    painted: bytes | None = None  # where matching matters, see `painting`
    start: ConstructionSequence | None = None  # to go on from
    locked: tuple[int, ...] = ()
    steps: ConstructionSequence | None = None  # to be told again for this picture, instead of a search

    @property
    def style(self) -> Style:
        """The style, as far as a start lets it be."""
        style = style_named(self.choices.style)
        if self.start is None:
            return style.with_choices(None, None, None, self.choices.symmetry, self.choices.align)
        if self.start.faces == "any":  # an edit has left a face that the style does not build
            style = style_named("paper")
        return style.with_choices(GOES_ON, None, None, self.choices.symmetry, self.choices.align)

    def settings(self) -> Settings:
        """The same as `agents.solve` makes of `command`. Raises ConfigError for what is impossible."""
        choices, style = self.choices, self.style
        levels = None if self.painted is None else read_importance(levels_of(self.painted))
        wishes = read_words(self.locked, style.symmetry, choices.keep, style.align, levels, self.start)
        weights = ScoreWeights(w_sc=choices.w_sc)
        budget = Budget(choices.refits, choices.seconds)
        return Settings(
            style.agent,
            {},
            choices.seed,
            style.operators,
            RESOLUTION,
            MAX_STEPS,
            weights,
            budget,
            wishes,
            style.faces,
            self.picture,
        )

    def command(self, picture: str) -> str:
        """What to type for the same result, where the picture and the other files (`files`) lie beside each other."""
        if self.steps is not None:
            return shlex.join(["python", "-m", "agents.retarget", self.files()["steps"], picture, *self._of_picture()])
        words = ["python", "-m", "agents.solve", picture, *self._of_search()]
        for option, name in self.files().items():
            words += [f"--{option}", name]
        if self.locked:
            words += ["--lock", ",".join(map(str, self.locked))]
        return shlex.join([*words, *self._of_picture()])

    def files(self) -> dict[str, str]:
        """The files that the command reads beside the picture, by the option that names them."""
        given = {"importance": self.painted, "start": self.start, "steps": self.steps}
        endings = {"importance": ".importance.png", "start": ".start.json", "steps": ".steps.json"}
        return {name: f"{self.silhouette.name}{endings[name]}" for name, one in given.items() if one is not None}

    def _of_search(self) -> list[str]:
        choices = self.choices
        words = ["--style", choices.style if self.start is None or self.start.faces != "any" else "paper"]
        if self.start is not None:
            words += ["--agent", GOES_ON]
        defaults = Choices()
        for name in ("w_sc", "seconds", "refits", "seed", "symmetry", "keep"):
            value = getattr(choices, name)
            if value is not None and value != getattr(defaults, name):
                words += [f"--{name.replace('_', '-')}", str(value)]
        if choices.align is not None:
            words.append("--align" if choices.align else "--no-align")
        return words

    def _of_picture(self) -> list[str]:
        words: list[str] = []
        for name, value in pictures.as_dict(self.picture).items():
            option = f"--{name.replace('_', '-')}"
            words += [option] if value is True else [option, str(value)]
        return words


def as_plain(choices: Choices) -> dict[str, Any]:
    """The choices as JSON knows them."""
    return asdict(choices)
