"""AutoPoly Coach: lessons in modelling. It shows what to do, watches the mesh, and says what differs.

Nothing of Blender is imported before `register`: what lies in files that do not name `bpy` works without it.
"""

bl_info = {  # for Blender 3.4 to 4.1; from 4.2 on blender_manifest.toml counts
    "name": "AutoPoly Coach",
    "author": "The AutoPoly authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Import > AutoPoly construction (.json); 3D View > Sidebar > AutoPoly",
    "description": "Teaches how a mesh is modelled, step by step, and watches",
    "category": "Mesh",
}


def register() -> None:
    """Make it known to Blender."""
    from . import registration

    registration.register()


def unregister() -> None:
    """Take all of it away again."""
    from . import registration

    registration.unregister()
