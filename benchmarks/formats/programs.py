"""The readers that are asked, and how: Python packages, JavaScript packages and programs of the system."""

import json
import re
import shutil
import struct
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from autopoly_env.errors import AutoPolyError
from autopoly_env.export.blender import find_blender
from benchmarks.formats.in_chromium import boxes
from benchmarks.formats.in_godot import areas

HERE = Path(__file__).parent
SECONDS = 300.0  # for a reader and all its files

Found = dict[str, Any]  # "area", "volume", "box", "messages", or "error"
Answer = tuple[str, list[Found]]  # a version, and what was found in each file


@dataclass(frozen=True)
class Asking:
    """Where readers are: interpreters of Python, and the folder that has node_modules."""

    pythons: tuple[str, ...]
    node_folder: Path | None


def ask_python(name: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    """The answer of the first interpreter that has the package; None where none has."""
    for python in asking.pythons:
        answer = _answer([python, str(HERE / "readers.py"), name, *map(str, paths)])
        if answer is not None:
            return answer
    return None


def ask_node(name: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    node = shutil.which("node")
    if node is None or asking.node_folder is None:
        return None
    return _answer([node, str(HERE / "readers.mjs"), name, str(asking.node_folder), *map(str, paths)])


def ask_chromium(_: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    return boxes(asking.node_folder, paths) if asking.node_folder else None


def ask_admesh(_: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    if shutil.which("admesh") is None:
        return None
    found: list[Found] = []
    for path in paths:
        told = dict(re.findall(r"([A-Z][a-z ]+?) *: *(-?[\d.]+)", _output("admesh", str(path))))
        fixes = ("Degenerate facets", "Edges fixed", "Facets removed", "Facets reversed", "Normals fixed")
        repaired = [fix for fix in fixes if float(told.get(fix, "1"))]
        found.append({"error": ", ".join(repaired)} if repaired else {"volume": float(told["Volume"])})
    return _first(r"version ([\d.]+)", _output("admesh", "--version")), found


def ask_prusa(_: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    program = "prusa-slicer"
    if shutil.which(program) is None:
        return None
    found: list[Found] = []
    for path in paths:
        enlarged = path.suffix == ".obj"  # it tells six digits after the point
        told = _output(program, *(["--scale", "100"] if enlarged else []), "--info", str(path))
        is_whole = "manifold = yes" in told and "repair" not in told
        volume = float(_first(r"volume = ([\d.]+)", told) or "nan")
        found.append({"volume": volume / (1e6 if enlarged else 1.0)} if is_whole else {"error": "needs repair"})
    return _first(r"PrusaSlicer-([\d.]+\d)", _output(program, "--help")), found


def ask_assimp(_: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    """What it writes as STL of what it has read."""
    if shutil.which("assimp") is None:
        return None
    found: list[Found] = []
    for path in paths:
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder, "made.stl")
            _output("assimp", "export", str(path), str(made), "-fstlb")
            found.append(_of_stl(made.read_bytes()) if made.exists() else {"error": "cannot read it"})
    return _first(r"Version ([\d.]+)", _output("assimp", "version")), found


def ask_blender(_: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    try:
        program = find_blender()
    except AutoPolyError:
        return None
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder, "answer.json")
        script = ["--python", str(HERE / "in_blender.py")]
        _output(program, "-b", "--factory-startup", *script, "--", str(answer), *map(str, paths))
        told = json.loads(answer.read_text())
    return told["version"], told["found"]


def ask_bpy(_: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    """Blender as a package of one of the interpreters."""
    for python in asking.pythons:
        with tempfile.TemporaryDirectory() as folder:
            answer = Path(folder, "answer.json")
            _output(python, str(HERE / "in_blender.py"), "--", str(answer), *map(str, paths))
            if answer.exists():
                told = json.loads(answer.read_text())
                return told["version"], told["found"]
    return None


def ask_godot(_: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    return areas(asking.node_folder, paths) if asking.node_folder else None


def ask_inkscape(_: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    """What svgpathtools finds in what it writes of what it has read."""
    if shutil.which("inkscape") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        made = [Path(folder, f"{k}.svg") for k in range(len(paths))]
        for path, copy in zip(paths, made, strict=True):
            _output("inkscape", str(path), "--export-plain-svg", f"--export-filename={copy}")
        answer = ask_python("svgpathtools", asking, made)
    return None if answer is None else (_first(r"Inkscape ([\d.]+)", _output("inkscape", "--version")), answer[1])


def ask_openscad(_: str, asking: Asking, paths: Sequence[Path]) -> Answer | None:
    """What it writes as STL of what it has read, drawings made 1 mm thick; it takes SVG to have 72 dots an inch."""
    if shutil.which("openscad") is None:
        return None
    found: list[Found] = []
    for path in paths:
        is_drawing = path.suffix in (".svg", ".dxf")
        with tempfile.TemporaryDirectory() as folder:
            made, program = Path(folder, "made.stl"), Path(folder, "made.scad")
            program.write_text("linear_extrude(1) import(name);" if is_drawing else "render() import(name);")
            _output("openscad", "-o", str(made), "-D", f"name={json.dumps(str(path))}", str(program))
            volume = _of_text_stl(made.read_text()) if made.exists() else float("nan")
        scale = (72.0 / 25.4) ** 2 if path.suffix == ".svg" else 1.0
        found.append({"area": volume * scale} if is_drawing else {"volume": volume})
    done = subprocess.run(["openscad", "--version"], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    return _first(r"version ([\d.]+)", done.stdout + done.stderr), found


Ask = Callable[[str, Asking, Sequence[Path]], Answer | None]

# Reader, what it is called in the table, what it is asked by, and the variants that it reads at all.
READERS: tuple[tuple[str, str, Ask, tuple[str, ...]], ...] = (
    ("three", "three.js", ask_node, ("obj", "solid", "gltf", "stl", "3mf", "svg", "svg-layers")),
    ("model-viewer", "model-viewer", ask_chromium, ()),  # which tells the box only
    ("babylon", "Babylon.js", ask_node, ("obj", "solid", "gltf", "stl")),
    ("trimesh", "trimesh", ask_python, ("obj", "solid", "gltf", "stl", "3mf")),
    ("open3d", "Open3D", ask_python, ("obj", "solid", "gltf", "stl")),
    ("pyvista", "PyVista", ask_python, ("obj", "solid", "gltf", "stl")),
    ("pymeshlab", "PyMeshLab", ask_python, ("obj", "solid", "gltf", "stl", "3mf")),
    ("igl", "libigl", ask_python, ("obj", "solid", "stl")),
    ("meshio", "meshio", ask_python, ("obj", "solid", "stl")),
    ("manifold3d", "manifold3d", ask_python, ("solid", "stl", "3mf")),
    ("assimp", "assimp", ask_assimp, ("obj", "solid", "gltf", "stl", "3mf")),
    ("blender", "Blender", ask_blender, ("obj", "solid", "gltf", "stl", "svg", "svg-layers")),
    ("bpy", "Blender, bpy", ask_bpy, ("obj", "solid", "gltf", "stl", "svg", "svg-layers", "usd")),
    ("admesh", "admesh", ask_admesh, ("stl",)),
    ("prusa", "PrusaSlicer", ask_prusa, ("solid", "stl", "3mf")),
    ("openscad", "OpenSCAD", ask_openscad, ("stl", "3mf", "svg", "dxf")),
    ("inkscape", "Inkscape", ask_inkscape, ("svg",)),
    ("svgelements", "svgelements", ask_python, ("svg", "svg-layers")),
    ("svgpathtools", "svgpathtools", ask_python, ("svg", "svg-layers")),
    ("usd", "OpenUSD, usd-core", ask_python, ("usd",)),
    ("ezdxf", "ezdxf", ask_python, ("dxf",)),
    ("godot", "Godot", ask_godot, ("godot",)),
    ("godot_parser", "godot-parser", ask_python, ("godot",)),
    ("pytiled_parser", "pytiled-parser", ask_python, ("tiled",)),
)


def _answer(command: list[str]) -> Answer | None:
    told = _output(*command).strip().splitlines()
    try:
        answer = json.loads(told[-1])
        return str(answer["version"]), answer["found"]
    except (IndexError, ValueError, KeyError, TypeError):
        return None


def _output(*command: str) -> str:
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=SECONDS)
    return done.stdout.decode("utf-8", "replace")


def _first(pattern: str, text: str) -> str:
    match = re.search(pattern, text)
    return match[1] if match else ""


def _of_text_stl(text: str) -> float:
    """The volume between the triangles of an STL in letters."""
    corners = [tuple(map(float, row)) for row in re.findall(r"vertex (\S+) (\S+) (\S+)", text)]
    volume = 0.0
    for (a, b, c), (d, e, f), (g, h, i) in zip(corners[::3], corners[1::3], corners[2::3], strict=True):
        volume += (a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)) / 6.0
    return volume


def _of_stl(data: bytes) -> Found:
    """Area and volume of the triangles in a binary STL."""
    area = volume = 0.0
    for k in range(struct.unpack_from("<I", data, 80)[0]):
        x = struct.unpack_from("<9f", data, 84 + 50 * k + 12)
        u, v = [x[3 + i] - x[i] for i in range(3)], [x[6 + i] - x[i] for i in range(3)]
        normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        area += 0.5 * sum(value**2 for value in normal) ** 0.5
        volume += sum(a * b for a, b in zip(x[:3], normal, strict=True)) / 6.0
    return {"area": area, "volume": volume}
