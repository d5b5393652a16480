"""All that Blender is told of, in the order in which it has to be."""

import bpy

from . import building, operators, overlay, panel, properties, session

PROPERTIES = (properties.Pupil, properties.Teaching, properties.ListRow, properties.Board, properties.Preferences)
CLASSES = (*PROPERTIES, *operators.CLASSES, *panel.CLASSES)
POINTERS = (
    (bpy.types.Object, properties.Pupil),
    (bpy.types.Scene, properties.Teaching),
    (bpy.types.WindowManager, properties.Board),
)


def register() -> None:
    """Make everything known."""
    for one in CLASSES:
        bpy.utils.register_class(one)
    for owner, group in POINTERS:
        owner.autopoly_coach = bpy.props.PointerProperty(type=group)
    bpy.types.TOPBAR_MT_file_import.append(panel.draw_menu)
    session.watch()
    overlay.show()


def unregister() -> None:
    """Take all of it away, and leave nothing running."""
    building.end()
    overlay.hide()
    session.unwatch()
    bpy.types.TOPBAR_MT_file_import.remove(panel.draw_menu)
    for owner, _ in POINTERS:
        del owner.autopoly_coach
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
