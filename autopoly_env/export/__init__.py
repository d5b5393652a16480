"""Writers of meshes and construction sequences in the formats that other programs read.

A name here loads the writer that it is from, and no other.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from autopoly_env.export.obj import from_obj, load_obj, to_obj
    from autopoly_env.export.player import save_html, to_html
    from autopoly_env.export.sheet import contact_sheet, save_png
    from autopoly_env.export.svg import sequence_to_svg, to_svg

__all__ = [
    "contact_sheet",
    "from_obj",
    "load_obj",
    "save_html",
    "save_png",
    "sequence_to_svg",
    "to_html",
    "to_obj",
    "to_svg",
]

_WRITERS = {
    "obj": ("from_obj", "load_obj", "to_obj"),
    "player": ("save_html", "to_html"),
    "sheet": ("contact_sheet", "save_png"),
    "svg": ("sequence_to_svg", "to_svg"),
}


def __getattr__(name: str) -> Any:
    for writer, names in _WRITERS.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{writer}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
