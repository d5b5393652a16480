"""Blender: scripts that rebuild a construction with its operators, and real Blender to run them in."""

from autopoly_env.export.blender.real import Job, find_blender, mismatches, run_in_blender
from autopoly_env.export.blender.script import blender_script, save_blender_script

__all__ = ["Job", "blender_script", "find_blender", "mismatches", "run_in_blender", "save_blender_script"]
