"""Rows about the rasteriser: loss and gradient against other renderers, growth with resolution, exactness."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import cycle, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from autopoly_env.arrays import FloatArray
from autopoly_env.mesh import PolyMesh
from autopoly_env.raster import batch_of, coverage, coverage_vjp, loss_and_gradient, loss_and_gradient_many
from autopoly_env.silhouette import Target
from benchmarks.report import Must, Row, faster, not_measured
from benchmarks.shapes import random_polygon, regular, star, target_of, wobbled
from benchmarks.timing import Call, least_seconds, median_seconds

ROOT = Path(__file__).resolve().parents[1]
N_BATCH = 32
SINGLE = Must(">=", 5.0)
BATCH = Must(">=", 10.0)
MITSUBA = Must(">=", 300.0)
DOUBLING = Must("<=", 2.5)
EXACTNESS = Must("<=", 1e-6)
_STEP = 1e-7  # of the central differences, in the unit square


def render_rows() -> Iterator[Row]:
    """Loss and gradient of one polygon and of many, against DEODR and Mitsuba."""
    try:
        peer = import_module("benchmarks.deodr_peer").DeodrPolygons
    except (ImportError, NameError) as problem:  # deodr itself trips with a NameError where trimesh is missing
        yield not_measured("8-gon at 64, DEODR", str(problem))
    else:
        yield from _single_rows(peer)
        yield from _batch_rows(peer)
    yield _mitsuba_row()


def _single_rows(peer: Callable[..., Any]) -> Iterator[Row]:
    for n, resolution, bound in ((8, 64, SINGLE), (32, 64, None), (8, 128, None), (8, 256, None)):
        target = target_of(regular(n, centre=(0.53, 0.52)), resolution)
        meshes = wobbled(regular(n), N_BATCH)
        calls = [_fused(meshes, target), _deodr(peer, meshes, target)]
        if bound is not None:
            calls.append(_render_and_pull_back(meshes, target))
        ours, theirs, *composed = median_seconds(*calls)
        yield faster(f"{n}-gon at {resolution}, DEODR", ours, theirs, bound)
        for seconds in composed:
            name = f"{n}-gon at {resolution}, DEODR"
            yield faster(name, seconds, theirs, None, "ours as coverage, loss in numpy, vjp")


def _fused(meshes: list[PolyMesh], target: Target) -> Call:
    turn = cycle(meshes)
    return lambda: loss_and_gradient(next(turn), target)


def _render_and_pull_back(meshes: list[PolyMesh], target: Target) -> Call:
    turn = cycle(meshes)

    def call() -> tuple[float, FloatArray]:
        mesh = next(turn)
        error = coverage(mesh, target.resolution) - target.coverage
        flat = error.ravel()
        loss = float(flat @ flat)
        error *= 2.0
        return loss, coverage_vjp(batch_of([mesh]), error[None])

    return call


def _deodr(peer: Callable[..., Any], meshes: list[PolyMesh], target: Target) -> Call:
    renderer = peer(meshes[0].vertices[None], target.coverage)
    turn = cycle([renderer.positions(mesh.vertices[None]) for mesh in meshes])
    return lambda: renderer.losses_and_gradient(next(turn))


def _batch_rows(peer: Callable[..., Any]) -> Iterator[Row]:
    """DEODR has no batch: either it is called again and again, or the polygons share one tall image."""
    target = target_of(regular(8, centre=(0.53, 0.52)), 64)
    meshes = wobbled(regular(8), N_BATCH)
    polygons = np.stack([mesh.vertices for mesh in meshes])
    one = _deodr(peer, meshes, target)
    tall = peer(polygons, target.coverage)
    positions = tall.positions(polygons)

    def again_and_again() -> None:
        for _ in range(N_BATCH):
            one()

    ours, calls, together = median_seconds(
        lambda: loss_and_gradient_many(meshes, target), again_and_again, lambda: tall.losses_and_gradient(positions)
    )
    name = f"{N_BATCH} 8-gons at 64, DEODR"
    yield faster(name, ours, calls, BATCH, f"DEODR called {N_BATCH} times")
    yield faster(name, ours, together, None, "DEODR, all polygons drawn in one tall image")


def _mitsuba_row() -> Row:
    name = "8-gon at 64, Mitsuba, 16 spp"
    child = subprocess.run([sys.executable, "-m", "benchmarks.mitsuba_peer"], capture_output=True, text=True, cwd=ROOT)
    if child.returncode:
        said = [line.strip() for line in child.stderr.splitlines() if "error" in line.lower()]
        return not_measured(name, said[0][:100] if said else f"exit code {child.returncode}")
    seconds = json.loads(child.stdout.splitlines()[-1])
    return faster(name, seconds["ours"], seconds["peer"], MITSUBA)


def growth_rows() -> Iterator[Row]:
    """Time of loss and gradient as the resolution doubles, which doubles the boundary and quadruples the area.

    Minima are compared, as growth is a matter of the method: what other processes do to the shared cache is not.
    """
    resolutions = (64, 128, 256, 512, 1024)
    for name, mesh in (("8-gon", regular(8)), ("100-vertex star", star(100))):
        target_mesh = regular(8, centre=(0.53, 0.52))
        calls = [_fused([mesh], target_of(target_mesh, size)) for size in resolutions]
        seconds = least_seconds(*calls, rounds=31, sample=0.02)  # long enough to measure with warm caches
        for (small, before), (large, after) in pairwise(zip(resolutions, seconds, strict=True)):
            bound = DOUBLING if large <= 512 else None  # beyond, the workspace outgrows the caches
            yield Row(f"{name}, {small} → {large}", after, before, after / before, bound, "s")


def gradient_rows(n_polygons: int = 200) -> Iterator[Row]:
    """Relative error of the gradient against central differences, over random polygons and targets.

    Plain differences do: the loss has a continuous gradient (only its second derivative jumps where a vertex or an
    edge crosses the grid), so a step of 1e-7 errs by far less than the bound, and so does
    rounding at that step.
    """
    rng = np.random.default_rng(0)
    errors = []
    for k in range(n_polygons):
        target = target_of(random_polygon(rng), (32, 64, 128)[k % 3])
        mesh = random_polygon(rng)
        _, gradient = loss_and_gradient(mesh, target)
        differences = _central_differences(mesh, target)
        errors.append(float(np.linalg.norm(gradient - differences) / np.linalg.norm(differences)))
    note = f"{n_polygons} polygons of 3 to 24 vertices"
    yield Row("median relative error", float(np.median(errors)), must=EXACTNESS, note=note)
    yield Row("worst relative error", max(errors), must=EXACTNESS, note=note)


def _central_differences(mesh: PolyMesh, target: Target) -> FloatArray:
    """Gradient (V, 2) of the loss of the rendered image, which shares no code with the analytic gradient's sums."""
    differences = np.empty_like(mesh.vertices)
    for index in np.ndindex(*mesh.vertices.shape):
        losses = []
        for step in (_STEP, -_STEP):
            moved = mesh.vertices.copy()
            moved[index] += step
            losses.append(np.sum((coverage(mesh.with_vertices(moved), target.resolution) - target.coverage) ** 2))
        differences[index] = (losses[0] - losses[1]) / (2.0 * _STEP)
    return differences
