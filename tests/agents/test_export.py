"""The command `python -m agents.export`: every format read back, and one line for everything that can be wrong."""

import ast
import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from agents.export import main
from autopoly_env.errors import ConfigError
from autopoly_env.export import to_obj, to_svg
from autopoly_env.export.formats import LISTED, Format, find_format, formats, register_format
from autopoly_env.export.solid import to_solid_obj
from autopoly_env.sequence import ConstructionSequence
from tests.helpers.commands import Run, runner
from tests.helpers.constructions import STEPS, house, score
from tests.helpers.paths import ROOT

FORMATS = formats()
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs the command in this process; gives `code`, `out` and `err`."""
    return runner(main, capsys)


def saved(path: str = "house.json", sequence: ConstructionSequence | None = None) -> Path:
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    (sequence or house()).save(path)
    return Path(path)


def edited(change: Callable[[dict[str, Any]], object]) -> Path:
    """The house as somebody has edited it by hand."""
    data = json.loads(house().to_json())
    change(data)
    Path("edited.json").write_text(json.dumps(data))
    return Path("edited.json")


def target_image() -> Path:
    picture = Image.new("L", (64, 64))
    picture.paste(255, (16, 8, 48, 48))
    picture.save("target.png")
    return Path("target.png")


# What is written


@pytest.mark.parametrize("name", FORMATS)
def test_every_format__is_written_beside_the_sequence_and_named(run: Run, name: str) -> None:
    saved("work/house.json")
    done = run("work/house.json", "--to", name)
    assert (done.code, done.err) == (0, "")
    (written,) = set(os.listdir("work")) - {"house.json"}
    assert done.out.split() == [f"work/{written}"]
    assert written == f"house{FORMATS[name].suffix}" and Path("work", written).stat().st_size > 300


def test_html__is_the_default_and_shows_the_target(run: Run) -> None:
    assert run(saved(), "--target", target_image()).code == 0
    page = Path("house.html").read_text(encoding="utf-8")
    assert "data:image/png;base64," in page and "<title>house" in page


def test_target__is_the_object_that_the_options_name_and_is_shown(run: Run) -> None:
    sequence, image = saved(), target_image()
    assert run(sequence, "--target", image, "--object", "dark", "--show-mask").code == 0
    assert (np.asarray(Image.open("target-mask.png")) == 0).sum() == 64 * 64 - 32 * 40
    refused = run(sequence, "--show-mask")
    assert refused.code == 2 and "--target; give one" in refused.err


def test_obj__is_the_last_mesh_or_that_of_a_step(run: Run) -> None:
    meshes = house().meshes()
    run(saved(), "--to", "obj")
    assert Path("house.obj").read_text() == to_obj(meshes[-1])
    for step in (0, 3):
        run("house.json", "--to", "obj", "--step", step, "--out", "step.obj")
        assert Path("step.obj").read_text() == to_obj(meshes[step])


def visible_steps(root: ET.Element) -> list[str | None]:
    return [g.get("id") for g in root if g.tag == f"{SVG}g" and "display:none" not in g.get("style", "")]


def test_svg__is_the_last_mesh_or_that_of_a_step(run: Run) -> None:
    meshes = house().meshes()
    run(saved(), "--to", "svg")
    run("house.json", "--to", "svg", "--step", 2, "--out", "step.svg")
    assert (Path("house.svg").read_text(), Path("step.svg").read_text()) == (to_svg(meshes[-1]), to_svg(meshes[2]))
    assert "display:none" not in Path("house.svg").read_text()


def test_svg_with_layers__has_a_group_for_each_step_and_shows_the_last(run: Run) -> None:
    run(saved(), "--to", "svg", "--layers", "--target", target_image())
    root = ET.parse("house.svg").getroot()
    assert [child.get("id") for child in root] == ["target", *(f"step-{k}" for k in range(len(STEPS) + 1))]
    assert visible_steps(root) == [f"step-{len(STEPS)}"]
    ids = [element.get("id") for element in root.iter() if element.get("id")]
    assert len(set(ids)) == len(ids)
    for k, mesh in enumerate(house().meshes()):
        inside = {element.get("id") for group in root for element in group.iter() if group.get("id") == f"step-{k}"}
        assert {f"step-{k}-vertex-{name}" for name in mesh.vertex_ids} <= inside
        assert {f"step-{k}-face-{name}" for name in mesh.face_ids} <= inside
        assert len(inside) == 4 + mesh.complexity  # the group itself and the three in it


def test_svg_with_layers__of_a_step_ends_there(run: Run) -> None:
    run(saved(), "--to", "svg", "--step", 2, "--layers")
    root = ET.parse("house.svg").getroot()
    assert [child.get("id") for child in root] == ["step-0", "step-1", "step-2"]
    assert visible_steps(root) == ["step-2"]
    label = "{http://www.inkscape.org/namespaces/inkscape}label"
    assert [child.get(label) for child in root] == ["step 0: start", "step 1: edge_subdivide", "step 2: face_split"]


def test_gif__has_a_frame_for_each_mesh(run: Run) -> None:
    run(saved(), "--to", "gif", "--step", 4)
    with Image.open("house.gif") as picture:
        assert picture.n_frames == 5 and picture.is_animated


def test_png__is_the_sheet_and_knows_the_target(run: Run) -> None:
    run(saved(), "--to", "png", "--out", "plain.png")
    run("house.json", "--to", "png", "--target", target_image(), "--out", "over.png")
    plain, over = (np.asarray(Image.open(name)) for name in ("plain.png", "over.png"))
    assert plain.shape == over.shape and (plain != over).any()


@pytest.mark.parametrize(("name", "suffix"), [("gltf", ".gltf"), ("blender", ".py")])
def test_depth__reaches_gltf_and_blender(run: Run, name: str, suffix: str) -> None:
    for depth in (0, 0.25):
        assert run(saved(), "--to", name, "--depth", depth, "--out", f"{depth}{suffix}").code == 0
    assert Path(f"0{suffix}").read_bytes() != Path(f"0.25{suffix}").read_bytes()
    if suffix == ".py":
        ast.parse(Path("0.25.py").read_text())


def test_glb__is_chosen_by_the_name_of_the_file(run: Run) -> None:
    run(saved(), "--to", "gltf", "--out", "house.glb")
    assert Path("house.glb").read_bytes()[:4] == b"glTF"


@pytest.mark.slow
@pytest.mark.parametrize("ending", [suffix for made in FORMATS.values() for suffix in made.suffixes])
def test_ending_of_the_file__decides_where_no_format_is_named(run: Run, ending: str) -> None:
    (made,) = (made for made in FORMATS.values() if ending in made.suffixes)
    assert run(saved(), "--out", f"by_ending{ending}").code == 0
    assert run("house.json", "--to", made.name, "--out", f"by_name{ending}").code == 0
    assert Path(f"by_ending{ending}").read_bytes() == Path(f"by_name{ending}").read_bytes()
    assert run("house.json", "--out", f"SHOUTED{ending.upper()}").code == 0


def test_obj_with_depth__is_the_solid(run: Run) -> None:
    run(saved(), "--out", "solid.obj", "--depth", 0.2)
    assert Path("solid.obj").read_text() == to_solid_obj(house().final(), 0.2)


def test_triangles__reach_obj_flat_and_solid(run: Run) -> None:
    run(saved(), "--out", "flat.obj", "--triangles")
    run("house.json", "--out", "solid.obj", "--triangles", "--depth", 0.2)
    assert Path("flat.obj").read_text() == to_obj(house().final(), triangles=True)
    assert Path("solid.obj").read_text() == to_solid_obj(house().final(), 0.2, triangles=True)


@pytest.mark.parametrize("name", ["stl", "3mf"])
def test_depth_and_size__reach_the_formats_for_printers(run: Run, name: str) -> None:
    for k, given in enumerate(([], ["--size", 20], ["--size", 20, "--depth", 0.5])):
        assert run(saved(), "--to", name, *given, "--out", f"{k}.{name}").code == 0
    assert len({Path(f"{k}.{name}").read_bytes() for k in range(3)}) == 3


def test_texture__is_put_on_obj_and_gltf(run: Run) -> None:
    saved("work/house.json")
    assert run("work/house.json", "--to", "obj", "--texture", target_image()).code == 0
    assert sorted(os.listdir("work")) == ["house.json", "house.mtl", "house.obj", "house.texture.png"]
    assert run("work/house.json", "--out", "house.gltf", "--texture", "target.png", "--depth", 0.1).code == 0
    assert "TEXCOORD_0" in Path("house.gltf").read_text()
    done = run("work/house.json", "--to", "obj", "--texture", "none.png")
    assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1) and "none.png" in done.err


@pytest.mark.parametrize(
    ("name", "said"), [("obj", "which is x = 0 here"), ("gltf", '"0 start"'), ("blender", "HALF = 0.5 ")]
)
def test_half__reaches_obj_gltf_and_blender(run: Run, name: str, said: str) -> None:
    saved()
    done = run("house.json", "--to", name, "--half", "--step", "0", "--out", "half")
    assert (done.code, done.err) == (0, "")
    assert said in Path(done.out.strip()).read_text()


@pytest.mark.parametrize("name", ["obj", "gltf", "blender"])
def test_half__of_what_is_not_symmetric_is_one_line_and_exit_code_1(run: Run, name: str) -> None:
    saved()
    done = run("house.json", "--to", name, "--half")
    assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1)
    assert re.match(r"error: house.json: the outline is not its own mirror image about x = \S+, the middle: ", done.err)
    assert os.listdir() == ["house.json"]


@pytest.mark.parametrize(("name", "module"), [("dxf", "ezdxf"), ("usd", "pxr.Usd")])
def test_format_without_its_package__is_one_line(
    run: Run, name: str, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    done = run(saved(), "--to", name)
    assert (done.code, done.out, len(done.err.splitlines())) == (2, "", 1)
    assert f"pip install -e '.[{name}]' in the checkout" in done.err and os.listdir() == ["house.json"]


def test_endings_of_two_parts__go_before_those_of_one(run: Run) -> None:
    for name in ("a.mesh.png", "a.mask.png", "a.png"):
        assert run(saved(), "--out", name).code == 0
    assert run("house.json", "--to", "mask-png", "--out", "plain.png").code == 0
    modes = {name: Image.open(name).mode for name in ("a.mesh.png", "a.mask.png", "a.png", "plain.png")}
    assert modes == {"a.mesh.png": "RGBA", "a.mask.png": "L", "a.png": "RGB", "plain.png": "L"}
    assert run("house.json", "--to", "convex-json").code == 0 and Path("house.convex.json").exists()


@pytest.mark.parametrize("name", FORMATS)
def test_name_of_markup__is_written_by_every_format(run: Run, name: str) -> None:
    odd = '</script><b>"\'"\\ & ]]> {{x}} %s\n[node]\x00'
    done = run(saved("odd.json", house(settings={"target": odd})), "--to", name, "--out", "odd/")
    assert (done.code, done.err) == (0, "")
    (written,) = Path("odd").iterdir()
    if written.suffix in (".svg", ".gltf", ".json", ".py", ".tscn", ".usda"):
        text = written.read_text(encoding="utf-8")
        assert "\n[node]" not in text and "\x00" not in text
        {".svg": ET.fromstring, ".gltf": json.loads, ".json": json.loads, ".py": ast.parse}.get(written.suffix, str)(
            text
        )


def test_solid_that_is_none__is_one_line_and_exit_code_1(run: Run) -> None:
    start = house().meshes()[0]
    flipped = ConstructionSequence({}, start.with_vertices(start.vertices[[1, 0, 3, 2]]), score(50.0))
    done = run(saved("flipped.json", flipped), "--to", "stl", "--depth", 0.1)
    assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1)
    assert "the volume would be -" in done.err and os.listdir() == ["flipped.json"]


def test_several_into_a_folder_with_a_dot__are_written_there(run: Run) -> None:
    done = run(saved("a.json"), saved("b.json"), "--out", "house.v2", "--to", "obj")
    assert (done.code, sorted(os.listdir("house.v2"))) == (0, ["a.obj", "b.obj"])


def test_several__go_into_a_folder_each_by_its_own_name(run: Run) -> None:
    sources = [saved("a/chair/sequence.json"), saved("b/chair/sequence.json"), saved("mug.json"), saved("b/mug.json")]
    done = run(*sources, sources[0], "--to", "obj", "--out", "new/folder")
    assert (done.code, done.err) == (0, "")
    assert sorted(os.listdir("new/folder")) == ["chair-2.obj", "chair.obj", "mug-2.obj", "mug.obj"]
    assert len(done.out.splitlines()) == 4  # the one named twice is written once


def test_out__without_an_ending_is_a_folder_for_one_as_well(run: Run) -> None:
    run(saved("chair/sequence.json"), "--to", "svg", "--out", "drawings")
    assert os.listdir("drawings") == ["chair.svg"]


# What can be wrong


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data["steps"][2]["element"].update(edge=[0, 2]), "step 3, edge_extrude edge 0–2: no edge joins"),
        (lambda data: data["steps"][2]["element"].update(edge=[2, 4]), "step 3, edge_extrude edge 2–4: edge_extrude"),
        (
            lambda data: data["steps"][0]["element"].update(edge=[0, 77]),
            "step 1, edge_subdivide edge 0–77: vertex id 77",
        ),
        (lambda data: data["steps"][6]["element"].update(face=9), "step 7, face_delete face 9: face id 9"),
        (lambda data: data["steps"][3].update(operator="melt"), "step 4, melt face 0, sides 3: operator 'melt'"),
        (
            lambda data: data["steps"][0]["moved"].append([4, "x", 0]),
            "step 1: moved.1.1: Input should be a valid number",
        ),
        (lambda data: data["steps"][0].pop("score"), "step 1: score: Field required"),
        (lambda data: data.update(version=3), "the version is 3; this release reads versions 1 and 2"),
        (lambda data: data.update(format="tale"), "the format is 'tale'"),
    ],
)
def test_illegal_step__is_told_in_one_line_and_nothing_is_written(run: Run, change: Any, message: str) -> None:
    for name in FORMATS:
        done = run(edited(change), "--to", name, "--out", "results/")
        assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1)
        assert done.err.startswith(f"error: edited.json: {message}")
        assert os.listdir() == ["edited.json"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not JSON"),
        (b"{", "not JSON"),
        (b"[" * 100_000, "not JSON"),
        (b'{"format": NaN}', "not JSON (NaN is no finite number)"),
        (b"\xff\xfe\x00", "not UTF-8 text"),
        (b"7", "the format is 7"),
        (house().to_json().encode()[:900], "not JSON"),
    ],
)
def test_broken_file__is_told_in_one_line(run: Run, content: bytes, message: str) -> None:
    Path("broken.json").write_bytes(content)
    done = run("broken.json")
    assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1)
    assert "broken.json" in done.err and message in done.err
    assert os.listdir() == ["broken.json"]


def test_missing_file__does_not_keep_the_others_from_being_written(run: Run) -> None:
    done = run("none.json", ".", saved(), "--out", "results")
    assert done.code == 1 and done.out.split() == ["results/house.html"]
    assert [line.split(" (")[0] for line in done.err.splitlines()] == [
        "error: cannot read none.json",
        "error: cannot read .",
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "Missing argument"),
        (
            ["house.json", "--to", "fbx"],
            "unknown format 'fbx'; give one of html, svg, obj, gltf, gif, png, blender, stl, 3mf, usd, dxf, godot, ",
        ),
        (["house.json", "--to", "svg", "--depth", "1"], "--depth 1.0: svg is flat; use it with obj, gltf, blender"),
        (["house.json", "--to", "obj", "--depth", "-1"], "depth -1.0"),
        (["house.json", "--to", "stl", "--depth", "-1"], "depth -1.0"),
        (["house.json", "--to", "stl", "--depth", "thick"], "Invalid value for '--depth'"),
        (["house.json", "--to", "stl", "--size", "0"], "size 0.0: expected the side of the picture, above 0"),
        (["house.json", "--to", "3mf", "--size", "-5"], "size -5.0: expected the side of the picture, above 0"),
        (["house.json", "--to", "3mf", "--size", "nan"], "size nan: expected"),
        (["house.json", "--to", "obj", "--size", "5"], "--size 5.0: obj has a size of its own; use it with stl, 3mf"),
        (["house.json", "--to", "mask-png", "--size", "0"], "size 0.0: expected a whole number of pixels"),
        (["house.json", "--to", "godot", "--size", "-1"], "size -1.0: expected the side of the picture"),
        (["house.json", "--to", "stl", "--texture", "t.png"], "--texture t.png: stl has nothing of the kind; use it"),
        (["house.json", "--to", "mesh-png", "--out", "a.gif"], "expected a file name that ends in .mesh.png"),
        (["house.json", "--to", "svg", "--triangles"], "--triangles: svg has nothing of the kind; use it with obj"),
        (
            ["house.json", "--to", "svg", "--half"],
            "--half: svg has nothing of the kind; use it with obj",
        ),
        (["house.json", "--to", "gltf", "--half", "--depth", "1"], "half with depth 1: halves are flat; mirror it"),
        (["house.json", "--to", "obj", "--layers"], "--layers: obj has nothing of the kind; use it with svg"),
        (["house.json", "--to", "gltf", "--depth", "nan"], "depth nan"),
        (["house.json", "--to", "gltf", "--depth", "-1"], "depth -1.0"),
        (["house.json", "--to", "obj", "--target", "t.png"], "--target t.png: obj shows no target; use it with html"),
        (["house.json", "--to", "gltf", "--out", "house.txt"], "expected a file name that ends in .gltf or .glb"),
        (
            ["house.json", "--to", "obj", "--out", "a.svg"],
            "--out a.svg with --to obj: expected a file name that ends in",
        ),
        (
            ["house.json", "--out", "house.fbx"],
            "house.fbx: no format has the ending .fbx; give .html, .htm, .svg, .obj",
        ),
        (["house.json", "--out", "house.v2"], "house.v2: no format has the ending .v2; give .html"),
        (["house.json", "none.json", "--out", "a.obj"], "--out a.obj: one file for 2 sequences; give a folder"),
        (["house.json", "--to", "nowhere:FBX"], "format 'nowhere:FBX': there is no module nowhere"),
        (["house.json", "--to", "json:dumps"], "expected an autopoly_env.export.formats.Format"),
        (["house.json", "--out", "house.json"], "house.json: is a sequence"),
        (["house.json", "--step", "two"], "--step"),
    ],
)
def test_wrong_usage__is_one_line_and_exit_code_2(run: Run, arguments: list[str], message: str) -> None:
    before = saved().read_bytes()
    done = run(*arguments)
    assert (done.code, done.out, len(done.err.splitlines())) == (2, "", 1)
    assert done.err.startswith("error: ") and message in done.err
    assert os.listdir() == ["house.json"] and Path("house.json").read_bytes() == before


@pytest.mark.parametrize("step", [-1, 8])
def test_step__that_there_is_not_is_one_line(run: Run, step: int) -> None:
    done = run(saved(), "--step", step)
    assert (done.code, done.out, os.listdir()) == (1, "", ["house.json"])
    assert done.err == f"error: house.json: cannot trim 7 steps to {step}; give 0..7\n"


def test_target__that_is_no_image_is_one_line(run: Run) -> None:
    Path("text.png").write_text("no image")
    for image in ("text.png", "none.png"):
        done = run(saved(), "--target", image)
        assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1)
        assert image in done.err
    assert sorted(os.listdir()) == ["house.json", "text.png"]


def test_place__that_cannot_be_written_is_one_line(run: Run) -> None:
    Path("file").touch()
    for name in FORMATS:
        done = run(saved(), "--to", name, "--out", f"file/house{FORMATS[name].suffix}")
        assert (done.code, done.out, len(done.err.splitlines())) == (1, "", 1)
        assert "cannot write file/house" in done.err


# Formats from outside, and their registry

BROUGHT = """
from autopoly_env.export.formats import Format

def write(export, path):
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"{len(export.sequence.steps)} steps, {export.depth}")

def fail(export, path):
    if len(export.sequence.steps) > 4:
        raise KeyError(path.name)
    write(export, path)

COUNT = Format("count", (".txt",), "how many steps", write, shows_depth=True)
BROKEN = Format("broken", (".txt",), "fails", fail)
LAZY = Format("lazy", (".txt",), "writes nothing", lambda export, path: None)
"""


@pytest.fixture
def brought(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("brought_formats.py").write_text(BROUGHT)
    monkeypatch.syspath_prepend(str(tmp_path))


def test_format_from_outside__is_written(run: Run, brought: None) -> None:
    done = run(saved(), "--to", "brought_formats:COUNT", "--depth", 0.5)
    assert (done.code, done.out, done.err) == (0, "house.txt\n", "")
    assert Path("house.txt").read_text() == f"{len(STEPS)} steps, 0.5"


def test_documented_format__is_written(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    docs = (ROOT / "docs" / "player.md").read_text(encoding="utf-8")
    (snippet,) = (code for code in re.findall(r"```python\n(.*?)```", docs, re.DOTALL) if "COUNT = Format" in code)
    Path("counting.py").write_text(snippet)
    assert run(saved("a.json"), saved("b.json"), "--to", "counting:COUNT", "--out", "counts").code == 0
    assert Path("counts/a.txt").read_text() == Path("counts/b.txt").read_text() == f"{len(STEPS)} steps\n"


def test_writer_that_fails__is_one_line_and_the_others_are_written(run: Run, brought: None) -> None:
    saved("long.json")
    house().trim(2).save("short.json")
    done = run("long.json", "short.json", "--to", "brought_formats:BROKEN", "--out", "texts")
    assert (done.code, done.out) == (1, "texts/short.txt\n")
    check = "(autopoly_env.conformance.check_format shows where)"
    what = "the writer of 'broken', of brought_formats, failed: KeyError: 'long.txt' (brought_formats.py line 10)"
    assert done.err == f"error: long.json: texts/long.txt: {what}; expected a file or an OutputError {check}\n"
    done = run("short.json", "--to", "brought_formats:LAZY")
    what = f"the writer of 'lazy', of brought_formats, made no such file {check}"
    assert (done.code, done.err) == (1, f"error: short.json: short.txt: {what}\n")


def test_listed__is_what_the_formats_say_of_themselves() -> None:
    assert [(made.name, made.help) for made in FORMATS.values()] == [(name, line) for name, _, line in LISTED]
    assert FORMATS["gltf"].suffixes == (".gltf", ".glb")
    endings = [suffix for made in FORMATS.values() for suffix in made.suffixes]
    assert len(set(endings)) == len(endings)


def test_register_format__refuses_what_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("autopoly_env.export.formats._registered", dict(FORMATS))
    register_format(Format("count", (".txt",), "", print))
    assert find_format("count").suffix == ".txt" and list(formats())[-1] == "count"
    for name, suffix in (("count", ".a"), ("other", ".txt"), ("other", ".glb"), ("obj", ".b")):
        with pytest.raises(ConfigError, match="the name or an ending is taken by"):
            register_format(Format(name, (suffix,), "", print))
    with pytest.raises(ConfigError, match=r"expected some, such as \.obj"):
        Format("plain", ("obj",), "", print)


@pytest.mark.slow
def test_one_writer__does_not_load_the_others() -> None:
    code = (
        "import sys\nfrom autopoly_env.export.formats import find_format\nfind_format('gltf')\n"
        "print(*[name for name in sys.modules if name.startswith('autopoly_env.export.')])"
    )
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    shown = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout
    loaded = {name.removeprefix("autopoly_env.export.").split(".")[0] for name in shown.split()}
    assert "gltf" in loaded and not loaded & {"obj", "svg", "gif", "sheet", "player", "blender"}


def test_ctrl_c__is_one_line_and_leaves_nothing(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    saved()
    monkeypatch.setattr("autopoly_env.files.os.replace", interrupted)
    done = run("house.json")
    assert (done.code, done.out, done.err) == (130, "", "error: stopped by Ctrl-C\n")
    assert os.listdir() == ["house.json"]


def test_help__names_every_format_and_loads_nothing_heavy() -> None:
    heavy = {"numba", "skimage", "shapely"}
    code = f"import sys, agents.export; agents.export.main(['--help']); assert not {heavy} & set(sys.modules)"
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    shown = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout
    assert set(FORMATS) <= set(shown.replace(",", " ").replace(".", " ").split())
    assert "python -m agents.export out/chair/sequence.json" in shown
