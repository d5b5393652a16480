"""Files for the coach in Blender, good and bad, and what comes of them there."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from autopoly_env.export.blender import ask_blender
from autopoly_env.export.coach import lesson_of, save_lesson
from autopoly_env.silhouette import Silhouette
from blender.build import build
from tests.helpers.constructions import house
from tests.helpers.paths import ROOT

DRIVER = Path(__file__).with_name("coach_in_blender.py")
# Stands in for AutoPoly: what it does goes by the name of the picture.
STAND_IN = """#!{python}
import pathlib, shutil, sys, time
what = next(pathlib.Path(a) for a in sys.argv if a.endswith((".png", ".json")))
out = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
print("error: 7 is no picture" if what.stem == "fails" else "a line")
if what.stem == "hangs":
    time.sleep(600)
if what.stem == "works":
    (out / "works").mkdir(parents=True)
    shutil.copy({lesson!r}, out / "works" / "lesson.json")
if what.stem == "sequence":
    shutil.copy({lesson!r}, out / "sequence.lesson.json")
sys.exit(what.stem == "fails")
"""


def situations(folder: Path, seconds: float = 300.0) -> dict[str, Any]:
    """What came of every situation that `coach_in_blender` gets the coach into. Raises as `ask_blender`."""
    files = folder / "files"
    files.mkdir()
    lesson = lesson_of(house())
    good = save_lesson(house(), files / "house.lesson.json", Silhouette(np.tri(32, dtype=bool)))
    write_bad(files, good.read_text(encoding="utf-8"), lesson)
    write_sequences(files)
    stand_in = folder / "python"
    stand_in.write_text(STAND_IN.format(python=sys.executable, lesson=str(good)), encoding="utf-8")
    stand_in.chmod(0o755)
    for name in ("works", "fails", "leaves nothing", "hangs", "house"):
        Image.new("L", (8, 8)).save(files / f"{name}.png")
    question = {"zip": str(build(folder)), "folder": str(files), "python": str(stand_in)}
    answer: dict[str, Any] = ask_blender(DRIVER, question, what="situations", seconds=seconds)
    return answer


def write_bad(files: Path, text: str, lesson: dict[str, Any]) -> None:
    """Files that are no lessons, and lessons whose operators are none."""
    (files / "empty.json").write_bytes(b"")
    (files / "torn.json").write_text(text[: len(text) // 2], encoding="utf-8")
    (files / "bytes.json").write_bytes(bytes(range(256)))
    (files / "list.json").write_text("[1, 2]", encoding="utf-8")
    (files / "deep.json").write_text("[" * 100_000, encoding="utf-8")
    (files / "other.json").write_text('{"name": "package", "version": "1.0.0"}', encoding="utf-8")
    (files / "newer.json").write_text(json.dumps(lesson | {"version": 2}), encoding="utf-8")
    (files / "nan.json").write_text(text.replace("0.25", "NaN"), encoding="utf-8")
    (files / "folder.json").mkdir()
    for name, change in BROKEN.items():
        steps = json.loads(json.dumps(lesson["steps"]))
        change(steps)
        (files / f"{name}.json").write_text(json.dumps(lesson | {"steps": steps}), encoding="utf-8")
    code = f"__import__('os').system('touch {files / 'was-run'}')"
    for name, call in {
        "house-code": [code, [0, 1]],
        "house-unknown": ["edge_juggle", [0, 1]],
        "house-none": None,
        "house-arguments": ["loop_cut", [code, 7, {"a": 1}]],
        "house-inner": ["bm", []],
        "house-elements": ["edge_subdivide", [0, 99]],
        "house-another": ["edge_subdivide", [1, 2]],
        "house-delete": ["face_delete", [0]],
    }.items():
        steps = json.loads(json.dumps(lesson["steps"]))
        steps[1]["call"] = call
        (files / f"{name}.json").write_text(json.dumps(lesson | {"steps": steps}), encoding="utf-8")


def write_sequences(files: Path) -> None:
    """A sequence with its lesson beside it, and one alone."""
    for name in ("with", "alone"):
        (files / name).mkdir()
        house().save(files / name / "sequence.json")
    save_lesson(house(), files / "with" / "lesson.json")
    save_lesson(house(2), files / "alone" / "other.lesson.json")


BROKEN = {
    "far": lambda steps: steps[0]["vertices"].update({"0": [1e300, 0.0]}),
    "no-face": lambda steps: steps[0].update(faces={}),
    "no-vertex": lambda steps: steps[0]["faces"].update({"0": [0, 1, 99]}),
    "huge-id": lambda steps: steps[0]["faces"].update({"99999999999": [0, 1, 2]}),
    "words": lambda steps: steps[1].update(title="x" * 100_000),
    "no-words": lambda steps: steps[1].update(title=7),
    "no-call": lambda steps: steps[1].update(call=7),
    "no-pick": lambda steps: steps[1].update(picks=[["knee", [1]]]),
    "no-steps": lambda steps: steps.clear(),
}
__all__ = ["BROKEN", "ROOT", "situations"]
