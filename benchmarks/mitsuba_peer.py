"""Mitsuba 3 as a peer. Run as a program, in a process of its own: its compiler may abort the process it runs in.

Prints one JSON object: least seconds of a loss with gradient, ours and Mitsuba's, of an 8-gon at 64x64. Its scene is
the triangulated polygon as a glowing mesh, its samples 16 a pixel. The camera is a perspective one, because its
projective sampling takes no other; facing the polygon's plane, it shows the same picture. What is done in its favour:
a grey variant; no samples for what has no gradient here (shading, indirect visibility); the scene is built beforehand.
"""

import json
from itertools import count

import drjit as dr
import mitsuba as mi
import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.raster import loss_and_gradient
from benchmarks.shapes import regular, target_of
from benchmarks.timing import Call, least_seconds
from benchmarks.triangulation import triangulate

_SAMPLES = 16


def main(resolution: int = 64) -> None:
    """Measure both side by side and print the minima: the longer call would be cut more often on a busy machine."""
    mesh = regular(8)
    target = target_of(regular(8, centre=(0.53, 0.52)), resolution)
    theirs = loss_with_gradient(mesh.vertices, target.coverage)
    ours, peer = least_seconds(lambda: loss_and_gradient(mesh, target), theirs, rounds=21)
    print(json.dumps({"ours": ours, "peer": peer}))


def loss_with_gradient(polygon: FloatArray, target: FloatArray) -> Call:
    """A function that returns the loss and the gradient (V, 3) of a polygon (V, 2) against a target (R, R)."""
    mi.set_variant("llvm_ad_mono")
    mi.set_log_level(mi.LogLevel.Error)
    scene = _scene(polygon, len(target))
    parameters = mi.traverse(scene)
    name = next(key for key in parameters.keys() if key.endswith("vertex_positions"))  # noqa: SIM118
    start = mi.Float(_in_space(polygon))
    wanted = mi.TensorXf(target[..., None].astype(np.float32))
    seeds = count()

    def measure() -> tuple[FloatArray, FloatArray]:
        positions = mi.Float(start)
        dr.enable_grad(positions)
        parameters[name] = positions
        parameters.update()
        image = mi.render(scene, parameters, spp=_SAMPLES, spp_grad=_SAMPLES, seed=mi.UInt32(next(seeds)))
        loss = dr.sum(dr.square(image - wanted))
        dr.backward(loss)
        gradient = dr.grad(positions)
        dr.eval(loss, gradient)
        return np.array(loss), np.array(gradient).reshape(-1, 3)

    return measure


def _scene(polygon: FloatArray, resolution: int) -> "mi.Scene":
    triangles, _ = triangulate(polygon)
    glow = mi.Properties()
    glow["emitter"] = mi.load_dict({"type": "area"})
    shape = mi.Mesh("polygon", len(polygon), len(triangles), props=glow)
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = _in_space(polygon)
    parameters["faces"] = triangles[:, ::-1].ravel()  # it glows towards the camera
    parameters.update()
    view = mi.ScalarTransform4f().look_at(origin=[0.5, 0.5, -1], target=[0.5, 0.5, 0], up=[0, -1, 0])
    film = {
        "type": "hdrfilm",
        "width": resolution,
        "height": resolution,
        "rfilter": {"type": "box"},
        "pixel_format": "luminance",
    }
    sensor = {"type": "perspective", "fov": float(np.degrees(2 * np.arctan(0.5))), "to_world": view, "film": film}
    integrator = {"type": "direct_projective", "sppc": 0, "sppi": 0}
    return mi.load_dict({"type": "scene", "integrator": integrator, "polygon": shape, "sensor": sensor})


def _in_space(polygon: FloatArray) -> FloatArray:
    return np.column_stack((polygon, np.zeros(len(polygon)))).ravel().astype(np.float32)


if __name__ == "__main__":
    main()
