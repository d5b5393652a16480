"""Rendering the templates of the page: every value is escaped where it is put in."""

import math
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from training.report.axes import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, number
from training.report.charts import colour_class, marker
from training.report.table import NONE, signed

FOLDER = Path(__file__).parent / "templates"

_TEMPLATES = Environment(
    loader=FileSystemLoader(FOLDER),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
_TEMPLATES.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
_TEMPLATES.filters |= {"colour": colour_class, "marker": marker, "number": number, "signed": signed}
_TEMPLATES.tests["finite"] = math.isfinite
_TEMPLATES.globals |= {
    "NONE": NONE,
    "WIDTH": WIDTH,
    "HEIGHT": HEIGHT,
    "TOP": TOP,
    "LEFT": LEFT,
    "BOTTOM": HEIGHT - BOTTOM,
    "RIGHT": WIDTH - RIGHT,
}


def render(template: str, **values: Any) -> str:
    """The text of a template with these values, which it has to have all."""
    return _TEMPLATES.get_template(template).render(values)


def own_text(name: str) -> str:
    """A file of ours beside the templates, which one that puts it in marks as safe."""
    return (FOLDER / name).read_text(encoding="utf-8")
