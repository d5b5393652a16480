"""What Blender keeps: the lesson with its object, how it is taught with the scene, what is said with the window."""

# Annotations are what Blender reads here, so they are values.
# mypy: disable-error-code="valid-type"

import bpy

from . import session


class Pupil(bpy.types.PropertyGroup):
    """Of an object: its lesson, and how far it has come."""

    lesson: bpy.props.StringProperty(name="Lesson", options={"HIDDEN"})
    done: bpy.props.IntProperty(name="Done", min=0, options={"HIDDEN"})


def _on_watching(settings: "Teaching", context: bpy.types.Context) -> None:
    if settings.is_watching:
        session.glance()


class Teaching(bpy.types.PropertyGroup):
    """Of a scene."""

    is_watching: bpy.props.BoolProperty(
        name="Your turn",
        description="Do the steps yourself: the coach says what to press, watches the mesh, and goes on when it fits",
        update=_on_watching,
    )
    tolerance: bpy.props.FloatProperty(
        name="Tolerance",
        description="How far from its place a vertex may be; the picture is 1 wide",
        default=0.01,
        min=0.001,
        max=0.05,
        precision=3,
        step=0.1,
    )
    settles: bpy.props.BoolProperty(
        name="Settle",
        description="When a step is right, put its vertices exactly where they belong",
        default=True,
    )
    shows_names: bpy.props.BoolProperty(
        name="Names", description="Write the numbers of what to click beside it", default=True
    )


class ListRow(bpy.types.PropertyGroup):
    """A line of the list."""

    words: bpy.props.StringProperty()
    number: bpy.props.IntProperty()


class Board(bpy.types.PropertyGroup):
    """What is shown now; no file keeps it."""

    of: bpy.props.StringProperty()
    rows: bpy.props.CollectionProperty(type=ListRow)
    row: bpy.props.IntProperty()
    said: bpy.props.StringProperty()
    icon: bpy.props.StringProperty(default="INFO")
    share: bpy.props.FloatProperty(min=0.0, max=1.0, subtype="FACTOR")
    work: bpy.props.StringProperty()  # what AutoPoly is doing, "" for nothing


class Preferences(bpy.types.AddonPreferences):
    """Where AutoPoly is, for those who have it."""

    bl_idname = __package__

    python: bpy.props.StringProperty(
        name="Python with AutoPoly",
        description="The path of a Python in which `python -m agents.solve` works, such as .venv/bin/python",
        subtype="FILE_PATH",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.prop(self, "python")
        self.layout.label(text="Only for Build from Image, and for sequences without a lesson beside them.")


def python_of(context: bpy.types.Context) -> str:
    """The path of a Python that has AutoPoly; "" where nobody has said."""
    addon = context.preferences.addons.get(__package__)
    return bpy.path.abspath(addon.preferences.python) if addon and addon.preferences else ""
