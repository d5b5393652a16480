"""The player: a construction as a page to watch and to do by hand, and the words that it tells it with."""

from autopoly_env.export.formats import Format, register_format
from autopoly_env.export.player.page import part_of, save_html, to_frame, to_html
from autopoly_env.export.player.words import Words, describe_start, describe_step

__all__ = ["Words", "describe_start", "describe_step", "part_of", "save_html", "to_frame", "to_html"]

register_format(
    Format(
        "html",
        (".html", ".htm"),
        "the player: a page to watch, with what to press in Blender",
        lambda export, path: save_html(export.sequence, path, export.target),
        shows_target=True,
    )
)
