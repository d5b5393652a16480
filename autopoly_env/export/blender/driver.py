"""Runs inside Blender: one exported script after the other, each in an empty file, and notes what went wrong.

`blender -b --factory-startup --python blender_driver.py -- JOBS PROBLEMS`: JOBS is a JSON list of [script, argument,
...], PROBLEMS becomes a JSON list of as many texts, empty where all went well.
"""

import json
import runpy
import sys

import bpy


def run(script: str, arguments: list[str]) -> str:
    """Run a script as if it were alone in Blender; what went wrong in a line, or nothing."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    sys.argv = ["blender", "--", *arguments]
    try:
        runpy.run_path(script, run_name="__main__")
    except SystemExit as stop:
        return " ".join(f"ended with {stop.code}".split()) if stop.code else ""
    except Exception as error:
        return " ".join(f"{type(error).__name__}: {error}".split())
    return ""


if __name__ == "__main__":
    jobs, problems = sys.argv[sys.argv.index("--") + 1 :]
    with open(jobs, encoding="utf-8") as stream:
        asked = json.load(stream)
    answers = [run(script, arguments) for script, *arguments in asked]
    with open(problems, "w", encoding="utf-8") as stream:
        json.dump(answers, stream)
