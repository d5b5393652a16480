"""What a user may say about the object of a picture: every decision of the loading can be overruled here."""

from dataclasses import dataclass

from autopoly_env.arguments import number, whole
from autopoly_env.errors import ConfigError
from autopoly_env.shown import short
from autopoly_env.silhouette.colours import parse_colour

WORDS = ("auto", "dark", "light", "alpha")


@dataclass(frozen=True)
class ObjectOptions:
    """How the object is told from its background; the defaults leave every decision to the picture.

    - `object`: "auto"; "dark" or "light", the darker or lighter side of a grey level; "alpha", what is opaque; or a
      colour, what is nearer to it than to the background.
    - `background`: a colour; the object is what differs from it.
    - `threshold` (0..1): the grey level between dark and light; where `background` or a colour is given, the distance
      in colour, of which 1 lies between black and white.
    - `alpha_threshold` (0..1): alpha from here on is opaque, as a share of the most opaque pixel's.
    - `min_speck`: components and holes of fewer pixels are dirt; by default as many as the picture's size allows.
    - `keep_specks`: nothing is dirt.

    Colours are names ("white"), "#rrggbb", "rgb(…)" or "hsl(…)", as Pillow reads them.

    Raises ConfigError for what is no colour or out of range, and for options that contradict each other.
    """

    object: str = "auto"
    background: str | None = None
    threshold: float | None = None
    alpha_threshold: float | None = None
    min_speck: int | None = None
    keep_specks: bool = False

    def __post_init__(self) -> None:
        if self.object not in WORDS:
            _checked_colour("object", self.object, f"{', '.join(WORDS)}, or a colour")
        if self.background is not None:
            _checked_colour("background", self.background, "a colour")
        for name in ("threshold", "alpha_threshold"):
            share = getattr(self, name)
            if share is not None and not 0 < number(name, share) < 1:
                raise ConfigError(f"{name} is {share:g}; expected a number between 0 and 1, without the ends")
        if self.min_speck is not None:
            whole("min_speck", self.min_speck)
        if self.keep_specks and self.min_speck:
            raise ConfigError(f"min_speck {self.min_speck} and keep_specks contradict each other; give one of them")
        if self.object in ("dark", "light", "alpha") and self.background is not None:
            raise ConfigError(f"object {self.object!r} does not look at the background; leave one of them out")
        if self.object == "alpha" and self.threshold is not None:
            raise ConfigError("object 'alpha' has no threshold of grey levels; give alpha_threshold instead")
        if self.object_colour and self.background and parse_colour(self.object) == parse_colour(self.background):
            raise ConfigError(f"object and background are both {self.object!r}; give two colours, or one of them")

    @property
    def object_colour(self) -> str | None:
        """The colour of the object, if one was given."""
        return None if self.object in WORDS else self.object


DEFAULT_OPTIONS = ObjectOptions()


def _checked_colour(name: str, text: str, expected: str) -> None:
    try:
        parse_colour(text)
    except (AttributeError, TypeError, ValueError):
        example = "such as red, #d04020 or rgb(208, 64, 32)"
        raise ConfigError(f"{name} {short(text)} is not known; expected {expected}, {example}") from None
