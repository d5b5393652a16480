"""Blender: scripts that rebuild a construction with its operators, and real Blender to run them in."""

from autopoly_env.export.blender.real import Job, ask_blender, find_blender, mismatches, run_in_blender
from autopoly_env.export.blender.script import arguments_of, blender_script, places_of, rings_of, save_blender_script
from autopoly_env.export.formats import Format, register_format

__all__ = [
    "Job",
    "arguments_of",
    "ask_blender",
    "blender_script",
    "find_blender",
    "mismatches",
    "places_of",
    "rings_of",
    "run_in_blender",
    "save_blender_script",
]

register_format(
    Format(
        "blender",
        (".py",),
        "a Python script that builds the mesh with Blender's own operators",
        lambda export, path: save_blender_script(
            export.sequence, path, export.depth, target=export.target, half=export.half
        ),
        shows_target=True,
        shows_depth=True,
        options=("half",),
    )
)
