"""What model-viewer, in Chromium without a window, has for the box of a glTF scene."""

import functools
import http.server
import json
import re
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

PAGE = """<model-viewer src="NAME" loading="eager" reveal="auto" style="width:300px;height:300px"></model-viewer>
<pre>nothing</pre>
<script type="module" src="node_modules/@google/model-viewer/dist/model-viewer.min.js"></script>
<script type="module">
const viewer = document.querySelector("model-viewer");
viewer.addEventListener("load", () => {
  const boxes = [viewer.getBoundingBoxCenter(), viewer.getDimensions()].map(({ x, y, z }) => [x, y, z]);
  document.querySelector("pre").textContent = JSON.stringify(boxes);
});
</script>"""
OPTIONS = ("--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
SECONDS = 60.0  # a file


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: Any) -> None:
        pass


def boxes(node_folder: Path, paths: Sequence[Path]) -> tuple[str, list[dict[str, Any]]] | None:
    """A version, and the box in each file; None without Chromium or model-viewer below the folder's node_modules."""
    chromium, package = shutil.which("chromium"), node_folder / "node_modules" / "@google" / "model-viewer"
    if chromium is None or not package.exists():
        return None
    version = json.loads((package / "package.json").read_text())["version"]
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "node_modules").symlink_to(node_folder / "node_modules")
        for k, path in enumerate(paths):
            shutil.copy(path, Path(folder, f"{k}.glb"))
            Path(folder, f"{k}.html").write_text(PAGE.replace("NAME", f"{k}.glb"))
        handler = functools.partial(_Quiet, directory=folder)
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            root = f"http://127.0.0.1:{server.server_port}"
            found = [_box(chromium, f"{root}/{k}.html") for k in range(len(paths))]
            server.shutdown()
    return version, found


def _box(chromium: str, page: str) -> dict[str, Any]:
    command = [chromium, *OPTIONS, "--virtual-time-budget=20000", "--dump-dom", page]
    shown = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=SECONDS).stdout
    told = re.search(r"<pre>(\[.*?\])</pre>", shown)
    if told is None:
        return {"error": "nothing was loaded"}
    middle, size = json.loads(told[1])
    return {"box": [[m + sign * s / 2.0 for m, s in zip(middle, size, strict=True)] for sign in (-1.0, 1.0)]}
