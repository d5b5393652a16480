"""The options of every command that reads pictures: what in them is the object (docs/pictures-in.md)."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:  # the rest is imported when it is used, so that --help is quick
    from autopoly_env.silhouette import ObjectOptions, Silhouette

MASK = "mask.png"
PANEL = "What in a picture is the object"  # a heading of the help

Object = Annotated[
    str,
    typer.Option(
        "--object",
        metavar="WHAT",
        help="The object: auto, dark, light, alpha (what is opaque), or a colour such as red or '#d04020'.",
        rich_help_panel=PANEL,
    ),
]
Background = Annotated[
    str | None,
    typer.Option(
        metavar="COLOUR",
        help="The object is what differs from this.",
        show_default="the border's",
        rich_help_panel=PANEL,
    ),
]
Threshold = Annotated[
    float | None,
    typer.Option(
        help="Grey level between dark and light, 0 to 1; with a colour, the distance from it.",
        show_default="by the picture",
        rich_help_panel=PANEL,
    ),
]
AlphaThreshold = Annotated[
    float | None,
    typer.Option(
        help="Alpha from which on a pixel is opaque, as a share of the largest.",
        show_default="0.5",
        rich_help_panel=PANEL,
    ),
]
MinSpeck = Annotated[
    int | None,
    typer.Option(
        metavar="PIXELS",
        help="Parts and holes of fewer pixels are dirt.",
        show_default="by the picture's size",
        rich_help_panel=PANEL,
    ),
]
KeepSpecks = Annotated[bool, typer.Option("--keep-specks", help="Nothing is dirt.", rich_help_panel=PANEL)]
ShowMask = Annotated[
    bool,
    typer.Option("--show-mask", help="Write the object that was found, black on white, too.", rich_help_panel=PANEL),
]


def read_options(
    object_: str,
    background: str | None,
    threshold: float | None,
    alpha_threshold: float | None,
    min_speck: int | None,
    keep_specks: bool,
) -> "ObjectOptions":
    """The options as they were typed. Raises ConfigError, naming the option that is wrong."""
    from autopoly_env.silhouette import ObjectOptions

    return ObjectOptions(object_, background, threshold, alpha_threshold, min_speck, keep_specks)


def as_dict(options: "ObjectOptions") -> dict[str, Any]:
    """The options that are not the default, as a construction sequence keeps them."""
    from autopoly_env.silhouette import DEFAULT_OPTIONS

    default = asdict(DEFAULT_OPTIONS)
    return {name: value for name, value in asdict(options).items() if value != default[name]}


def save_mask(silhouette: "Silhouette", path: Path) -> Path:
    """Write the object black on white, a picture that every command reads again. Raises OutputError."""
    from PIL import Image

    from autopoly_env.export import save_png

    return save_png(Image.fromarray(~silhouette.mask).convert("L"), path)
