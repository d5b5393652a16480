"""glTF 2.0: the construction as an animation for viewers, game engines and modelling programs."""

import base64
import json
import os
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from autopoly_env.arrays import FloatArray, IntArray
from autopoly_env.errors import ConfigError
from autopoly_env.export.formats import Format, register_format
from autopoly_env.export.half import check_flat, halved
from autopoly_env.export.replay import finite_meshes, sequence_name, unmoved
from autopoly_env.export.solid import Solid, to_solid, to_triangles
from autopoly_env.export.texture import Texture
from autopoly_env.files import write_atomically
from autopoly_env.sequence import ConstructionSequence

STEP_SECONDS = 1.0
MOVE_SECONDS = 0.6  # of these
SUFFIXES = (".gltf", ".glb")  # text and binary
COLOUR = (0.32, 0.47, 0.76, 1.0)  # linear RGBA
FLOAT, UINT = 5126, 5125  # component types
VERTICES, INDICES = 34962, 34963  # what a buffer view is for
CLAMP = 33071  # a texture's rim goes on beyond it


def save_gltf(
    sequence: ConstructionSequence,
    path: str | os.PathLike[str],
    depth: float = 0.0,
    texture: Texture | None = None,
    *,
    half: bool = False,
) -> Path:
    """Write a sequence as glTF: text with all data in it for the suffix .gltf, binary for .glb.

    Each step is a node with the mesh after it, cut into triangles, x right, y up, z towards the viewer; `depth` (units
    of the unit square) makes it a closed solid behind z = 0. The one animation shows a step a second, by the nodes'
    scale 0 or 1; the vertices' moves are a morph target. At rest the last step shows and the others have scale 0,
    in the middle of the last mesh, which all places are relative to: so the box of the scene is that mesh's own. As
    viewers count morph targets in as well, the last mesh is there once more without, as `N done`, where it has one. A
    `texture` is part of the file. Of a `half` the last mesh's alone is written, its node on the axis.

    Raises ConfigError for another suffix, a depth below 0 or not finite or a half with depth, SequenceError naming a
    step that cannot be replayed, OutputError if the file cannot be written or the mesh has no half.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ConfigError(f"{path}: expected a file name that ends in .gltf (text) or .glb (binary)")
    axis = None
    if half:
        check_flat(depth)
        mesh, axis = halved(finite_meshes(sequence)[-1])
        sequence = replace(sequence, start=mesh, steps=())
    document, data = _document(sequence, depth, texture, axis)
    if suffix == ".glb":
        return write_atomically(path, _binary(document, data))
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode("ascii")
    return write_atomically(path, json.dumps(document, indent=1) + "\n")


class _Buffer:
    """The one buffer of a file, and the views and accessors that tell what lies where in it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add_bytes(self, data: bytes) -> int:
        """Append what is no numbers, filled up to whole words; gives the view's index."""
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
        self.data += data + b"\0" * (-len(data) % 4)
        return len(self.views) - 1

    def add(self, values: npt.ArrayLike, use: int | None = None) -> int:
        """Append scalars (n,) or vectors (n, 2 or 3), floats or, for INDICES, integers; gives the accessor's index."""
        array = np.asarray(values, np.uint32 if use == INDICES else np.float32)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes}
        self.views.append(view | ({"target": use} if use else {}))
        self.data += array.astype(array.dtype.newbyteorder("<")).tobytes()
        rows = array.reshape(len(array), -1)
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": UINT if use == INDICES else FLOAT,
                "count": len(array),
                "type": "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}",
                "min": rows.min(axis=0).tolist(),
                "max": rows.max(axis=0).tolist(),
            }
        )
        return len(self.accessors) - 1


def _document(
    sequence: ConstructionSequence, depth: float, texture: Texture | None, axis: float | None
) -> tuple[dict[str, Any], bytes]:
    """The text and the data. Nodes stand in the middle of the last mesh, or on the axis where there is one."""
    meshes = finite_meshes(sequence)
    buffer, end = _Buffer(), STEP_SECONDS * len(meshes)
    middle = _middle(to_solid(meshes[-1], depth), axis)
    times = [(STEP_SECONDS * number, STEP_SECONDS * (number + 1)) for number in range(len(meshes))]
    shapes: list[dict[str, Any]] = []
    nodes: list[dict[str, Any]] = []
    animation: dict[str, Any] = {"name": "construction", "channels": [], "samplers": []}
    for number, mesh in enumerate(meshes):
        step = sequence.steps[number - 1] if number else None
        name = f"{number} {step.operator if step else 'start'}"
        solid = to_solid(mesh, depth)
        shapes.append(_shape(buffer, name, solid.vertices - middle, to_triangles(solid)))
        if texture:
            places = buffer.add(texture.places(mesh.vertices)[list(solid.sources)], VERTICES)
            shapes[-1]["primitives"][0]["attributes"]["TEXCOORD_0"] = places
        nodes.append({"name": name, "mesh": number, "translation": middle.tolist()})
        offsets = (unmoved(step, meshes[number - 1], mesh) - mesh.vertices) * (1, -1) if step else np.zeros((1, 2))
        if step and offsets.any():
            _add_morph(buffer, shapes[-1], np.pad(offsets, ((0, 0), (0, 1)))[list(solid.sources)])
            begin = STEP_SECONDS * number
            _animate(buffer, animation, number, "weights", "LINEAR", [begin, begin + MOVE_SECONDS], [1.0, 0.0])
    if "targets" in shapes[-1]["primitives"][0]:
        plain = {name: value for name, value in shapes[-1]["primitives"][0].items() if name != "targets"}
        shapes.append({"name": f"{len(meshes) - 1} done", "primitives": [plain]})
        nodes.append({"name": shapes[-1]["name"], "mesh": len(meshes), "translation": middle.tolist()})
        begin = times[-1][0] + MOVE_SECONDS
        times[-1:] = [(times[-1][0], begin), (begin, end)]
    for number, (node, (begin, gone)) in enumerate(zip(nodes, times, strict=True)):
        if gone < end:
            node["scale"] = [0.0, 0.0, 0.0]
        _animate(buffer, animation, number, "scale", "STEP", *_scales(begin, gone, end))
    nodes.append({"name": sequence_name(sequence), "children": list(range(len(nodes)))})
    look = _textured(buffer, texture) if texture else _look({"baseColorFactor": COLOUR})
    return {
        "asset": {"version": "2.0", "generator": "AutoPoly"},
        "scene": 0,
        "scenes": [{"name": sequence_name(sequence), "nodes": [len(nodes) - 1]}],
        "nodes": nodes,
        "meshes": shapes,
        **look,
        "animations": [animation],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }, bytes(buffer.data)


def _look(base: dict[str, Any]) -> dict[str, Any]:
    """The one material."""
    roughness = {"pbrMetallicRoughness": base | {"metallicFactor": 0.0, "roughnessFactor": 0.8}}
    return {"materials": [{"name": "AutoPoly", "doubleSided": True, **roughness}]}


def _textured(buffer: _Buffer, texture: Texture) -> dict[str, Any]:
    """The material with the picture, and where in the file that is."""
    image = {"name": "picture", "bufferView": buffer.add_bytes(texture.png), "mimeType": "image/png"}
    sampler = {"wrapS": CLAMP, "wrapT": CLAMP}
    maps = {"images": [image], "samplers": [sampler], "textures": [{"source": 0, "sampler": 0}]}
    return maps | _look({"baseColorTexture": {"index": 0}})


def _middle(solid: Solid, axis: float | None) -> FloatArray:
    """(3,) the middle of its box, x that of the axis if there is one, in numbers that single precision has."""
    middle = 0.5 * (solid.vertices.min(axis=0) + solid.vertices.max(axis=0))
    if axis is not None:
        middle[0] = axis
    return middle.astype(np.float32).astype(np.float64)


def _shape(buffer: _Buffer, name: str, vertices: FloatArray, triangles: IntArray) -> dict[str, Any]:
    """A glTF mesh of triangles."""
    primitive = {
        "attributes": {"POSITION": buffer.add(vertices, VERTICES)},
        "indices": buffer.add(triangles.ravel(), INDICES),
        "material": 0,
    }
    return {"name": name, "primitives": [primitive]}


def _scales(begin: float, gone: float, end: float) -> tuple[list[float], list[list[float]]]:
    """When a node appears and goes, and its scale from then on; all have a key at 0, and one that stays at the end."""
    keys = {0.0: float(begin == 0.0), begin: 1.0, gone: float(gone == end)}
    return list(keys), [[scale] * 3 for scale in keys.values()]


def _add_morph(buffer: _Buffer, shape: dict[str, Any], offsets: FloatArray) -> None:
    """A morph target that takes the vertices back to where the operator left them."""
    shape["primitives"][0]["targets"] = [{"POSITION": buffer.add(offsets, VERTICES)}]
    shape["weights"] = [0.0]
    shape["extras"] = {"targetNames": ["unmoved"]}  # where viewers and Blender look for names


def _animate(
    buffer: _Buffer,
    animation: dict[str, Any],
    node: int,
    path: str,
    interpolation: str,
    times: list[float],
    values: npt.ArrayLike,
) -> None:
    sampler = {"input": buffer.add(times), "output": buffer.add(values), "interpolation": interpolation}
    animation["channels"].append({"sampler": len(animation["samplers"]), "target": {"node": node, "path": path}})
    animation["samplers"].append(sampler)


def _binary(document: dict[str, Any], data: bytes) -> bytes:
    """The container: a header of 12 bytes, then the text and the data as chunks of whole words."""
    text = json.dumps(document).encode("ascii")
    chunks = ((b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", data + b"\0" * (-len(data) % 4)))
    body = b"".join(struct.pack("<I", len(content)) + kind + content for kind, content in chunks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


register_format(
    Format(
        "gltf",
        SUFFIXES,
        "an animation for viewers and engines; binary in a file .glb",
        lambda export, path: save_gltf(export.sequence, path, export.depth, export.texture, half=export.half),
        shows_depth=True,
        options=("texture", "half"),
    )
)
