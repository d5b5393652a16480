"""Blender scripts: what they say, and what real Blender makes of them, step by step, wherever it is installed.

Blender starts once for all of these tests.
"""

import ast
import json
import re
import subprocess
import textwrap
from collections import Counter
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from autopoly_env.errors import ConfigError, OutputError, SequenceError
from autopoly_env.export.blender import Job, find_blender, mismatches, run_in_blender
from autopoly_env.export.blender.script import END, TEMPLATE, blender_script, save_blender_script
from autopoly_env.export.gltf import save_gltf
from autopoly_env.export.obj import to_obj
from autopoly_env.mesh import PolyMesh
from autopoly_env.operators import OPERATORS
from autopoly_env.raster import coverage
from autopoly_env.sequence import ConstructionSequence
from benchmarks import replay_in_blender
from tests.helpers.drawings import HOUSE, painted
from tests.helpers.sequences import SCORE, gabled, played, walked
from tests.helpers.shapes import polygon
from tests.helpers.vases import cut_anyhow, vase

try:
    BLENDER, WHY_NOT = find_blender(), ""
except ConfigError as error:
    BLENDER, WHY_NOT = "", str(error)
needs_blender = pytest.mark.skipif(not BLENDER, reason=WHY_NOT)
NASTY = '"""\nimport os; os.system("touch {}")#\\\'\r\n{{}}<b>%s\N{GREEK SMALL LETTER LAMDA}\x00\ud800'
RESOLUTION = 512

# --- the script ---


def test_script_of_the_house__reads_as_its_steps() -> None:
    text = blender_script(gabled())
    steps = text[text.index("    start(") : text.index("# --- what a step is in Blender")]
    assert steps.rstrip() == textwrap.indent(
        textwrap.dedent("""\
            start(
                {0: (0.25, 0.75), 1: (0.75, 0.75), 2: (0.75, 0.25), 3: (0.25, 0.25)},
                {0: (0, 3, 2, 1)},
                next_vertex=4,
                next_face=1,
            )
            expect(4, 4, 1)

            # Step 1: IoU 0.5000, total 50.00
            edge_subdivide(0, 1)
            move({4: (0.5, 0.875)})
            expect(5, 5, 1)

            # Step 2: IoU 0.5000, total 50.00
            face_split(0, 2, 4)
            expect(5, 6, 2)

            # Step 3: IoU 0.5000, total 50.00
            edge_extrude(1, 2)
            move({5: (0.875, 0.75), 6: (0.875, 0.25)})
            expect(7, 9, 3)"""),
        "    ",
    )


PLAIN = blender_script(gabled("plain")).splitlines()


def name_in(script: str) -> str:
    """The name that a script gives, after checking that nothing else in it differs from a plain one."""
    lines = script.splitlines()
    (where,) = (k for k, line in enumerate(PLAIN) if line.startswith("NAME = "))
    assert lines[:where] + lines[where + 1 :] == PLAIN[:where] + PLAIN[where + 1 :]
    (statement,) = ast.parse(lines[where]).body
    assert isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant)
    assert isinstance(statement.value.value, str)
    return statement.value.value


@given(st.text() | st.sampled_from([NASTY, "'", '"', "\\", "'" * 3, '"' * 3, "\n#", "{}", "%s", END]))
def test_name__is_text_whatever_it_says(name: str) -> None:
    script = blender_script(gabled(name))
    found = name_in(script)
    assert script.isascii() and found.isprintable() and 1 <= len(found) <= 60


@pytest.mark.parametrize(("name", "shown"), [("chair", "chair"), ("Stühle\n2", "Stühle 2"), ("", "AutoPoly"), (7, "7")])
def test_name__is_one_line(name: Any, shown: str) -> None:
    assert name_in(blender_script(gabled(name))) == shown


def test_illegal_step__is_named_when_the_script_is_made(tmp_path: Path) -> None:
    sequence = gabled()
    inner = replace(sequence.steps[2], element={"edge": [4, 2]})
    edited = replace(sequence, steps=(*sequence.steps[:2], inner))
    with pytest.raises(SequenceError, match=r"^step 3, edge_extrude edge 4–2: .*it lies between two faces"):
        save_blender_script(edited, tmp_path / "house.py")
    assert not list(tmp_path.iterdir())


def test_vertex_that_is_not_finite__is_named_when_the_script_is_made() -> None:
    sequence = gabled()
    broken = replace(sequence.steps[0], moved=((4, 0.5, float("inf")),))
    with pytest.raises(SequenceError, match="step 1: a vertex is not finite"):
        blender_script(replace(sequence, steps=(broken,)))


@pytest.mark.parametrize("depth", [-1.0, float("nan")])
def test_depth_that_is_none__is_refused(depth: float) -> None:
    with pytest.raises(ConfigError, match="expected 0 \\(flat\\) or more"):
        blender_script(gabled(), depth=depth)


def test_script__knows_every_operator() -> None:
    tree = ast.parse(TEMPLATE.read_text(encoding="utf-8"))
    assert set(OPERATORS) <= {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


# --- the program ---


def test_missing_blender__is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("BLENDER", raising=False)
    with pytest.raises(ConfigError, match=r"not found as 'blender'; install it \(apt-get .*\) or set BLENDER"):
        find_blender()


@pytest.mark.parametrize(
    ("body", "complaint"),
    [("echo cannot open a display; exit 11", r"exit code 11 \(cannot open a display\)"), ("sleep 20", "after 0.2 s")],
)
def test_blender_that_breaks_down__is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str, complaint: str
) -> None:
    program = tmp_path / "blender"
    program.write_text(f"#!/bin/sh\n{body.replace('sleep', 'exec sleep')}\n")
    program.chmod(0o755)
    monkeypatch.setenv("BLENDER", str(program))
    with pytest.raises(OutputError, match=complaint):
        run_in_blender([Job(tmp_path / "house.py")], seconds=0.2 if "sleep" in body else 60.0)


def report_of(meshes: list[PolyMesh]) -> dict[str, Any]:
    """What Blender would report of these meshes."""
    steps = [
        {
            "counts": list(mesh.counts),
            "vertices": {str(v): [x, 1 - y] for v, (x, y) in zip(mesh.vertex_ids, mesh.vertices.tolist(), strict=True)},
            "faces": {
                str(name): [mesh.vertex_ids[v] for v in face[::-1]]
                for name, face in zip(mesh.face_ids, mesh.faces, strict=True)
            },
        }
        for mesh in meshes
    ]
    return {"steps": steps}


def test_mismatches__are_found() -> None:
    sequence = gabled()
    report = report_of(sequence.meshes())
    assert mismatches(sequence, report) == []
    report["steps"][1]["counts"] = [5, 6, 1]
    report["steps"][1]["vertices"]["4"][0] += 2e-5
    report["steps"][2]["faces"]["0"].reverse()
    del report["steps"][3]["vertices"]["6"]
    assert mismatches(sequence, report) == [
        "step 1 (edge_subdivide): (V, E, F) is (5, 6, 1), not (5, 5, 1)",
        "step 1 (edge_subdivide): a vertex lies 2.0e-05 off",
        "step 2 (face_split): the faces are others",
        "step 3 (edge_extrude): the vertices have other ids",
    ]
    assert mismatches(sequence, {"steps": report["steps"][:2]}) == ["Blender made 1 steps of 3"]


def test_replay_of_folders__tells_what_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    meshes = gabled().meshes()

    def pretend(jobs: list[Job], *, seconds: float) -> list[str]:
        """A Blender that makes the house right, whatever it is asked for."""
        for job in jobs:
            Path(job.arguments[1]).write_text(json.dumps(report_of(meshes)), encoding="utf-8")
        return [""] * len(jobs)

    monkeypatch.setattr(replay_in_blender, "run_in_blender", pretend)
    monkeypatch.setattr(replay_in_blender, "find_blender", lambda: "blender")
    for name, sequence in (("good", gabled()), ("other", gabled().trim(2))):
        (tmp_path / name).mkdir()
        sequence.save(tmp_path / name / "sequence.json")
    assert replay_in_blender.main([str(tmp_path / "good")]) == 0
    assert "sequences: 1   steps: 3   sequences that differ: 0" in capsys.readouterr().out
    (tmp_path / "cut").mkdir()
    (tmp_path / "cut" / "sequence.json").write_text("{", encoding="utf-8")
    assert replay_in_blender.main([str(tmp_path)]) == 1
    said = capsys.readouterr().out
    assert "Blender made 3 steps of 2" in said and "not JSON" in said and "sequences that differ: 2" in said


def test_replay_without_blender_or_sequences__is_wrong_usage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("BLENDER", str(tmp_path / "nowhere"))
    assert replay_in_blender.main([str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("error: Blender was not found as ")
    monkeypatch.setattr(replay_in_blender, "find_blender", lambda: "blender")
    with pytest.raises(SystemExit, match="2"):
        replay_in_blender.main([str(tmp_path)])
    assert "no sequence.json below" in capsys.readouterr().err


# --- in Blender ---

SHOWN = """
import bpy, json, runpy, sys
file, answer = sys.argv[-2:]
if file.endswith(".py"):
    sys.argv = ["blender"]
    runpy.run_path(file, run_name="__main__")
else:
    import numpy
    if not hasattr(numpy, "bool"):  # which the glTF reader of Blender 3.4 asks for, and newer numpys lack
        numpy.bool = bool
    bpy.ops.import_scene.gltf(filepath=file)
scene, frames = bpy.context.scene, []
meshes = [o for o in bpy.data.objects if o.type == "MESH"]
for frame in range(1, 24 * len(meshes) + 1):
    scene.frame_set(frame)
    graph = bpy.context.evaluated_depsgraph_get()
    for o in meshes:
        if not o.hide_render and o.evaluated_get(graph).scale.x > 0.5:
            keys = o.data.shape_keys
            unmoved = keys.key_blocks["unmoved"].value if keys else None
            frames.append([frame, o.name, unmoved, len(o.data.vertices), len(o.data.polygons)])
with open(answer, "w") as stream:
    json.dump(frames, stream)
"""


REFERENCE = """
import bpy, json, runpy, sys
file, answer = sys.argv[-2:]
sys.argv = ["blender"]
runpy.run_path(file, run_name="__main__")
(made,) = (o for o in bpy.data.objects if o.type == "EMPTY")
with open(answer, "w") as stream:
    size, alpha = list(made.data.size), list(made.data.pixels)[3::4]
    json.dump([list(made.location), made.empty_display_size, size, alpha], stream)
"""


MIRRORED = """
import bpy, json, runpy, sys
file, answer = sys.argv[-2:]
if file.endswith(".py"):
    sys.argv = ["blender"]
    runpy.run_path(file, run_name="__main__")
elif file.endswith(".obj"):
    bpy.ops.wm.obj_import(filepath=file, forward_axis="Y", up_axis="Z")
else:
    bpy.ops.import_scene.gltf(filepath=file, import_shading="FLAT")
(half,) = (o for o in bpy.data.objects if o.type == "MESH")
if not half.modifiers:
    half.modifiers.new("Mirror", "MIRROR")  # as it comes
whole = half.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
areas = [sum(p.area for p in mesh.polygons) for mesh in (half.data, whole)]
xs = [(half.matrix_world @ v.co).x for v in whole.vertices]
sides = {}
for p in whole.polygons:
    for a, b in p.edge_keys:
        sides[a, b] = sides.get((a, b), 0) + 1
normals = [p.normal.z if abs(p.normal.z) > 0.5 else -p.normal.y for p in whole.polygons]
with open(answer, "w") as stream:
    json.dump([*areas, min(xs), max(xs), list(sides.values()).count(1), max(sides.values()), min(normals)], stream)
"""
VASES = {f"vase-{seed}": cut_anyhow(polygon(vase(seed, 2 + seed)), seed, 2 * seed) for seed in range(6)}


@dataclass(frozen=True)
class Made:
    """What Blender made of everything, in a folder by name."""

    folder: Path
    sequences: dict[str, ConstructionSequence]
    problems: dict[str, str]

    def obj(self, name: str) -> tuple[np.ndarray, list[list[int]]]:
        rows = [line.split() for line in (self.folder / f"{name}.obj").read_text(encoding="utf-8").splitlines()]
        points = np.array([[float(value) for value in row[1:]] for row in rows if row[0] == "v"])
        return points, [[int(corner.split("/")[0]) - 1 for corner in row[1:]] for row in rows if row[0] == "f"]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """All sequences in one Blender; solids and animations are every other one."""
    folder = tmp_path_factory.mktemp("blender")
    sequences = {"house": gabled()}
    sequences |= {f"game-{seed}": played(seed) for seed in range(20)}
    sequences |= {f"walk-{seed}": walked(seed, 60, (0.0, 0.002, 0.02)[seed % 3]) for seed in range(12)}
    sequences |= {f"model-{seed}": walked(seed, 40, (0.0, 0.002, 0.02)[seed % 3], "modeller") for seed in range(24)}
    jobs = {}
    for name, sequence in sequences.items():
        options = {"depth": 0.1 * is_odd(name), "keyframes": name in ("house", "walk-2", "walk-3")}
        script = save_blender_script(sequence, folder / f"{name}.py", **options)
        jobs[name] = Job(script, ("--report", f"{folder / name}.json", "--obj", f"{folder / name}.obj"))
    jobs["picture"] = Job(folder / "game-0.py", ("--render", f"{folder / 'picture.png'}", "--size", str(RESOLUTION)))
    wrong = (folder / "house.py").read_text(encoding="utf-8").replace("expect(5, 6, 2)", "expect(5, 6, 3)")
    (folder / "wrong.py").write_text(wrong, encoding="utf-8")
    jobs["wrong"] = Job(folder / "wrong.py")
    jobs["unknown"] = Job(folder / "house.py", ("--paint",))
    jobs["negative"] = Job(folder / "house.py", ("--depth=-1",))
    (folder / "shown.py").write_text(SHOWN, encoding="utf-8")
    for name, file in (("frames", folder / "house.py"), ("gltf", save_gltf(gabled(), folder / "house.glb", 0.1))):
        jobs[name] = Job(folder / "shown.py", (str(file), f"{folder / name}.json"))
    save_blender_script(gabled(), folder / "backed.py", target=painted(HOUSE))
    (folder / "reference.py").write_text(REFERENCE, encoding="utf-8")
    jobs["reference"] = Job(folder / "reference.py", (f"{folder / 'backed.py'}", f"{folder / 'reference.json'}"))
    (folder / "mirrored.py").write_text(MIRRORED, encoding="utf-8")
    for name, mesh in VASES.items():
        sequence = ConstructionSequence({}, mesh, SCORE)
        (folder / f"{name}.obj").write_text(to_obj(mesh, half=True))
        halves = (save_blender_script(sequence, folder / f"{name}.py", half=True), folder / f"{name}.obj")
        for file in (*halves, save_gltf(sequence, folder / f"{name}.glb", half=True)):
            jobs[file.name] = Job(folder / "mirrored.py", (str(file), f"{file}.json"))
    problems = dict(zip(jobs, run_in_blender(list(jobs.values()), seconds=600.0), strict=True))
    return Made(folder, sequences, problems)


def is_odd(name: str) -> bool:
    return name != "house" and int(name.split("-")[1]) % 2 == 1


@pytest.mark.slow
@needs_blender
def test_blender__has_the_same_mesh_after_every_step(made: Made) -> None:
    for name, sequence in made.sequences.items():
        assert made.problems[name] == ""
        report = json.loads((made.folder / f"{name}.json").read_text(encoding="utf-8"))
        assert mismatches(sequence, report) == [], name
    n_times = Counter(step.operator for sequence in made.sequences.values() for step in sequence.steps)
    assert min(n_times[name] for name in OPERATORS) >= 50, "every operator was tried often"
    assert any(step.element.get("sides") == k for s in made.sequences.values() for step in s.steps for k in (3, 4))


@pytest.mark.slow
@needs_blender
def test_obj_from_blender__keeps_n_gons_and_the_silhouette(made: Made) -> None:
    centres = (np.arange(RESOLUTION) + 0.5) / RESOLUTION
    n_compared = 0
    for name in (name for name in made.sequences if name.startswith("game") and not is_odd(name)):
        mesh = made.sequences[name].final()
        points, faces = made.obj(name)
        assert sorted(map(len, faces)) == sorted(map(len, mesh.faces)), name
        shape = shapely.union_all([shapely.make_valid(shapely.Polygon(points[face, :2])) for face in faces])
        is_plain = shape.area == pytest.approx(mesh.face_areas().sum(), abs=1e-5)  # no face crosses another or itself
        if is_plain and shape.area > 0.05:  # of a sliver a rim of half pixels is too large a part
            filled = shapely.contains_xy(shape, *np.meshgrid(centres, 1.0 - centres))
            assert iou(filled, coverage(mesh, RESOLUTION) >= 0.5) >= 0.995, name
            n_compared += 1
    assert n_compared >= 4


@pytest.mark.slow
@needs_blender
def test_picture_under_the_mesh__lies_in_the_unit_square(made: Made) -> None:
    assert made.problems["reference"] == ""
    place, size, pixels, alpha = json.loads((made.folder / "reference.json").read_text(encoding="utf-8"))
    mask = painted(HOUSE).mask
    assert place == pytest.approx([0.5, 0.5, -0.01]) and size == 1.0 and pixels == list(mask.shape)
    np.testing.assert_array_equal(np.array(alpha).reshape(mask.shape)[::-1] > 0.5, mask)  # Blender's rows begin below


@pytest.mark.slow
@needs_blender
def test_picture_from_blender__has_our_silhouette(made: Made) -> None:
    assert made.problems["picture"] == ""
    with Image.open(made.folder / "picture.png") as picture:
        alpha = np.asarray(picture)[..., 3]
    ours = coverage(made.sequences["game-0"].final(), RESOLUTION) >= 0.5
    assert ours.shape == alpha.shape and iou(alpha >= 128, ours) >= 0.995


def iou(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / (a | b).sum())


@pytest.mark.slow
@needs_blender
def test_solid_from_blender__is_closed_and_has_the_volume_area_times_depth(made: Made) -> None:
    for name in filter(is_odd, made.sequences):
        points, faces = made.obj(name)
        along = Counter(pair for face in faces for pair in pairwise((*face, face[0])))
        assert all(n == 1 and along[(b, a)] == 1 for (a, b), n in list(along.items())), name
        corners = [(face[0], *pair) for face in faces for pair in pairwise(face[1:])]
        volume = np.linalg.det(points[corners]).sum() / 6.0
        assert volume == pytest.approx(0.1 * made.sequences[name].final().face_areas().sum(), abs=1e-5), name
        assert (points[:, 2].min(), points[:, 2].max()) == (-0.1, 0.0)


@pytest.mark.slow
@needs_blender
@pytest.mark.parametrize("ending", ["py", "obj", "glb"])
@pytest.mark.parametrize("name", VASES)
def test_half__is_made_whole_by_blenders_mirror(made: Made, name: str, ending: str) -> None:
    assert made.problems[f"{name}.{ending}"] == ""
    answer = json.loads((made.folder / f"{name}.{ending}.json").read_text(encoding="utf-8"))
    half, whole, low, high, n_rim, most, up = answer
    mesh = VASES[name]
    area, middle = float(mesh.face_areas().sum()), 0.0 if ending == "obj" else 0.5
    assert [half, whole] == pytest.approx([0.5 * area, area], rel=1e-5)
    assert [low, high] == pytest.approx(np.array((-0.5, 0.5)) * np.ptp(mesh.vertices[:, 0]) + middle, abs=1e-6)
    assert n_rim == len(mesh.topology.boundary_half_edges) and most == 2  # nothing is left open at the axis
    assert up > 0.99


@pytest.mark.slow
@needs_blender
def test_counts_that_do_not_hold__stop_the_script_at_their_step(made: Made) -> None:
    assert re.search(r"step 2: Blender has \(V, E, F\) = \(5, 6, 2\), expected \(5, 6, 3\)", made.problems["wrong"])


@pytest.mark.slow
@needs_blender
@pytest.mark.parametrize(("kind", "first_frames"), [("frames", [1, 25, 49, 73]), ("gltf", [1, 24, 48, 72])])
def test_time_line__shows_one_step_after_the_other(made: Made, kind: str, first_frames: list[int]) -> None:
    assert made.problems[kind] == ""
    frames = json.loads((made.folder / f"{kind}.json").read_text(encoding="utf-8"))
    frames = [row for row in frames if row[0] <= 96]  # afterwards the last one stays
    assert [frame for frame, *_ in frames] == list(range(1, 97)), "one object is shown at a time"
    names = [name.split()[-2 if kind == "gltf" else -1] for _, name, *_ in frames]
    assert [names.index(str(step)) + 1 for step in range(4)] == first_frames
    unmoved = {frame: value for frame, _, value, *_ in frames}
    assert [unmoved[frame] for frame in first_frames] == [None, 1.0, None, 1.0]
    assert unmoved[first_frames[1] + 20] == 0.0
    assert unmoved[96] == (None if kind == "gltf" else 0.0)  # `3 done` shows it in glTF
    assert 0.2 < unmoved[first_frames[3] + 8] < 0.8


@pytest.mark.slow
@needs_blender
def test_script_alone__writes_what_it_is_asked_for_and_runs_no_text(tmp_path: Path) -> None:
    trap = tmp_path / "trap"
    script = save_blender_script(gabled(NASTY.format(trap)), tmp_path / "a script.py")
    options = [f"--{kind}={tmp_path / kind}.{kind}" for kind in ("blend", "obj", "report")]
    command = [BLENDER, "-b", "--factory-startup", "--python", str(script), "--"]
    command += [*options, "--keyframes", "--depth=0.25"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300)
    assert done.returncode == 0, done.stdout
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {"a script.py", "blend.blend", "obj.obj", "report.report"} and not trap.exists()
    report = json.loads((tmp_path / "report.report").read_text(encoding="utf-8"))
    assert report["name"].startswith('""" import os; os.system') and len(report["steps"]) == 4
    rows = [line.split() for line in (tmp_path / "obj.obj").read_text(encoding="utf-8").splitlines()]
    assert sorted(float(row[3]) for row in rows if row[0] == "v") == [-0.25] * 7 + [0.0] * 7


@pytest.mark.slow
@needs_blender
def test_script__refuses_options_that_it_does_not_know(made: Made) -> None:
    assert [made.problems[name] for name in ("unknown", "negative")] == ["ended with 2"] * 2
