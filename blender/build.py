"""Packs the coach for Blender: `python -m blender.build [FOLDER]`, or `make extension`.

One zip serves all: Blender 4.2 and newer install it as an extension, 3.4 to 4.1 as an add-on, for which Blender's own
builder leaves out the folder. It is the same to the byte wherever it is made, and Blender's own validator looks at it
where there is one. What each step is in Blender comes from the script that `agents.export --to blender` writes.
Exit codes: 0 the zip is there, 1 Blender would not have it, 2 it cannot be written.
"""

import argparse
import io
import re
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path

from autopoly_env.errors import AutoPolyError, ConfigError
from autopoly_env.export.blender import find_blender
from autopoly_env.export.blender.script import END, TEMPLATE
from autopoly_env.files import write_atomically

SOURCE = Path(__file__).with_name("autopoly_coach")
LICENSE = Path(__file__).parent.parent / "LICENSE"
WHAT_ENDS = "# --- what ends a step ---\n"
FIRST = (4, 2)  # of the versions of Blender that know extensions
SECONDS = 120.0
LONG_AGO = (1980, 1, 1, 0, 0, 0)  # the first moment that a zip knows
HEAD = '''"""What each step is in Blender, from the scripts that AutoPoly exports; written by `make extension`."""

import bmesh

'''


def packed() -> dict[str, bytes]:
    """The files of the extension by name."""
    sources = sorted(path for path in SOURCE.iterdir() if path.suffix in (".py", ".toml"))
    files = {path.name: path.read_bytes() for path in sources}
    return files | {"making.py": making().encode("utf-8"), "LICENSE": LICENSE.read_bytes()}


def making() -> str:
    """The module of Blender's operators: a section of the scripts that are exported."""
    _, _, rest = TEMPLATE.read_text(encoding="utf-8").partition(END)
    section, _, _ = rest.partition(WHAT_ENDS)
    return HEAD + section.rstrip() + "\n"


def version() -> str:
    """As the manifest says."""
    (found,) = re.findall(r'^version = "(.*)"$', (SOURCE / "blender_manifest.toml").read_text(encoding="utf-8"), re.M)
    return str(found)


def zipped(files: dict[str, bytes]) -> bytes:
    """A zip with one folder, the same whoever makes it when."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, data in sorted(files.items()):
            archive.writestr(zipfile.ZipInfo(f"{SOURCE.name}/{name}", LONG_AGO), data, zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def build(folder: Path) -> Path:
    """Write the zip, whole or not at all. Raises OutputError."""
    folder.mkdir(parents=True, exist_ok=True)
    return write_atomically(folder / f"{SOURCE.name}-{version()}.zip", zipped(packed()))


def judged(path: Path) -> tuple[bool, str]:
    """Whether Blender's own validator takes the zip, as far as there is one, and what to say about it."""
    missing = "not validated, which takes Blender 4.2 or newer: set BLENDER to the path of one"
    try:
        program = find_blender()
        told = _said_by(program, "--version")
    except (ConfigError, OSError, subprocess.SubprocessError):
        return True, missing
    found = re.search(r"Blender (\d+)\.(\d+)", told.stdout)
    if found is None or tuple(map(int, found.groups())) < FIRST:
        return True, missing
    done = _said_by(program, "--command", "extension", "validate", str(path))
    lines = (done.stdout + done.stderr).strip().splitlines() or ["it said nothing"]
    return done.returncode == 0, f"validated by {found[0]}" if done.returncode == 0 else f"{found[0]}: {lines[-1]}"


def _said_by(*command: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=SECONDS)


def main(arguments: Sequence[str] | None = None) -> int:
    """Build, and say where it is; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m blender.build", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("dist"), help="where the zip goes (dist)")
    try:
        path = build(parser.parse_args(arguments).folder)
    except (AutoPolyError, OSError) as error:
        print("error:", error, file=sys.stderr)
        return 2
    is_valid, words = judged(path)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB, {words}")
    return 0 if is_valid else 1


if __name__ == "__main__":
    sys.exit(main())
