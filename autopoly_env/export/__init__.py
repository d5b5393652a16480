"""Writers of meshes and construction sequences in the formats that other programs read."""

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
