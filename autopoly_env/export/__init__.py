"""Writers of meshes and construction sequences in the formats that other programs read."""

from autopoly_env.export.obj import to_obj
from autopoly_env.export.sheet import contact_sheet, save_png
from autopoly_env.export.svg import to_svg

__all__ = ["contact_sheet", "save_png", "to_obj", "to_svg"]
