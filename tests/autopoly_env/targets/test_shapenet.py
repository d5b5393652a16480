"""Silhouettes of 3-D models, against shapely; OBJ files as they are found; folders laid out as ShapeNet's."""

import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from autopoly_env.errors import AutoPolyError, ConfigError, SilhouetteError
from autopoly_env.targets import ShapeNetTargets, make_targets
from autopoly_env.targets.obj_file import read_obj
from autopoly_env.targets.projection import SIDE, Surface, silhouette_of
from autopoly_env.targets.projection_kernels import paint_polygons
from autopoly_env.targets.shapenet import SYNSETS, find_models
from tests.helpers.shapes import shapely_coverage

BOX_FACES = [(1, 2, 3, 4), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]


def box(x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> str:
    """The eight corners of a box, as lines of OBJ; BOX_FACES are its faces."""
    corners = [
        (x0, y0, z0),
        (x1, y0, z0),
        (x1, y1, z0),
        (x0, y1, z0),
        (x0, y0, z1),
        (x1, y0, z1),
        (x1, y1, z1),
        (x0, y1, z1),
    ]
    return "".join(f"v {x} {y} {z}\n" for x, y, z in corners)


def faces(numbers: list[tuple[int, ...]], form: str = "{}", shift: int = 0) -> str:
    return "".join(f"f {' '.join(form.format(v + shift) for v in face)}\n" for face in numbers)


TWO_BOXES = box(0, 0, 0, 2, 1, 3) + faces(BOX_FACES)  # 2 wide, 1 high, 3 deep
ARROW = TWO_BOXES + box(1.5, 1, 0, 2, 2, 0.5) + faces(BOX_FACES, shift=8)  # a tower at +x, -z


def write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def surface(vertices: np.ndarray, polygons: list[list[int]]) -> Surface:
    ends = np.cumsum([0, *map(len, polygons)])
    return Surface(np.asarray(vertices, float), np.array([v for p in polygons for v in p]), ends)


# --- silhouettes


@pytest.mark.parametrize(("view", "width", "height"), [("front", 2, 1), ("side", 3, 1), ("top", 2, 3)])
def test_silhouette__of_a_box_is_a_centred_rectangle(tmp_path: Path, view: str, width: int, height: int) -> None:
    mask = silhouette_of(read_obj(write(tmp_path / "box.obj", TWO_BOXES)), view, 128).mask
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    pixels = 128 * SIDE / max(width, height)
    assert len(columns) == pytest.approx(width * pixels, abs=1.01)
    assert len(rows) == pytest.approx(height * pixels, abs=1.01)
    assert mask.sum() == len(rows) * len(columns)
    assert rows[0] + rows[-1] == pytest.approx(127, abs=1) and columns[0] + columns[-1] == pytest.approx(127, abs=1)


@pytest.mark.parametrize(("view", "tower"), [("front", "upper left"), ("side", "upper right"), ("top", None)])
def test_view__shows_the_front_where_it_should(tmp_path: Path, view: str, tower: str | None) -> None:
    """Before the model its right is on our left; from its own left side (+x) it looks to the right."""
    mask = silhouette_of(read_obj(write(tmp_path / "arrow.obj", ARROW)), view, 64).mask
    top = np.flatnonzero(mask.any(axis=1))[0]
    columns = np.flatnonzero(mask[top])
    if tower is None:
        assert mask.sum() == pytest.approx(64**2 * SIDE**2 * 2 / 3, rel=0.04)  # it stands within the box
    else:
        assert (columns.mean() > 32) == ("right" in tower)


def test_top_view__has_the_front_above_and_the_right_on_the_right(tmp_path: Path) -> None:
    corner = box(0, 0, 0, 2, 1, 3) + faces(BOX_FACES) + box(2, 0, 0, 3, 1, 1) + faces(BOX_FACES, shift=8)  # at +x, -z
    mask = silhouette_of(read_obj(write(tmp_path / "corner.obj", corner)), "top", 64).mask
    right = np.flatnonzero(mask.any(axis=0))[-1]
    assert np.flatnonzero(mask[:, right]).mean() < 32


@st.composite
def soups(draw: st.DrawFn) -> tuple[np.ndarray, list[list[int]]]:
    """Triangles anywhere, some degenerate or twice: a surface with no order at all."""
    n = draw(st.integers(3, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    triangles = rng.integers(0, n, (draw(st.integers(1, 12)), 3)).tolist()
    return rng.normal(size=(n, 3)), triangles + triangles[:2]


@pytest.mark.slow
@given(soups())
@settings(max_examples=60)
def test_paint_polygons__sets_the_samples_that_lie_in_any_triangle(soup: tuple[np.ndarray, list[list[int]]]) -> None:
    vertices, triangles = soup
    points = 48.0 + 24.0 * vertices[:, :2]
    image = np.zeros((96, 96), np.bool_)
    corners = surface(vertices, triangles)
    paint_polygons(points[corners.corners], corners.ends, image)
    shape = shapely.union_all([shapely.Polygon(points[t]) for t in triangles if len(set(t)) == 3])
    centres = shapely.points(*np.meshgrid(np.arange(96) + 0.5, np.arange(96) + 0.5))
    wrong = image != shapely.contains(shape, centres)
    assert (shapely.distance(shape.boundary, centres[wrong]) < 1e-9).all()


def test_silhouette__of_a_concave_face_keeps_its_notch(tmp_path: Path) -> None:
    """A C of one polygon: a fan of triangles from its first corner would fill the notch."""
    points = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (3, 2), (3, 3), (0, 3)]
    text = "".join(f"v {-x} {y} 0\n" for x, y in points) + "f 1 2 3 4 5 6 7 8\n"
    mask = silhouette_of(read_obj(write(tmp_path / "c.obj", text)), "front", 96).mask
    expected = shapely_coverage(shapely.Polygon(0.5 + SIDE * (np.array(points) * (1, -1) + (-1.5, 1.5)) / 3), 96) >= 0.5
    assert (mask != expected).mean() < 0.01


def test_silhouette__has_no_gap_between_neighbours_whichever_way_they_run() -> None:
    """A disc of slivers that meet in its middle, every other one turned round."""
    angles = np.linspace(0, 2 * np.pi, 181)[:-1] + 0.01
    rim = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(180)))
    fan = [[180, k, (k + 1) % 180][:: (-1) ** k] for k in range(180)]
    mask = silhouette_of(surface(np.vstack((rim, [[0.1, 0.07, 0]])), fan), "front", 256).mask
    radii = np.hypot(*(np.indices((256, 256)) - 127.5))
    assert mask[radii < 0.5 * SIDE * 256 - 2].all()
    assert not mask[radii > 0.5 * SIDE * 256 + 2].any()


# --- OBJ files


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(TWO_BOXES.replace("f", "g part\nusemtl red\nf"), id="groups"),
        pytest.param(box(0, 0, 0, 2, 1, 3) + "vn 0 0 1\n" + faces(BOX_FACES, "{}//1"), id="v//n"),
        pytest.param(box(0, 0, 0, 2, 1, 3) + "vt 0 0\nvn 0 0 1\n" + faces(BOX_FACES, "{}/1/1"), id="v/t/n"),
        pytest.param(box(0, 0, 0, 2, 1, 3) + faces(BOX_FACES, shift=-9), id="negative"),
        pytest.param(TWO_BOXES + faces(BOX_FACES) + faces([(1, 2, 3)] * 3), id="twice and non-manifold"),
        pytest.param(TWO_BOXES + faces([(1, 1, 1), (2, 2, 3)]) + "f 1 2\nf 1\nf\nl 1 2\np 1\n", id="degenerate"),
        pytest.param("v 9e9 9e9 9e9\n" + box(0, 0, 0, 2, 1, 3) + faces(BOX_FACES, shift=1), id="unused vertex"),
        pytest.param("# comment \\\r\n\r\n" + TWO_BOXES.replace("\n", " 1 1 # end\r\n", 8), id="comments and colours"),
        pytest.param(TWO_BOXES.replace("f 1 2", "f 1 \\\n 2\\\n"), id="lines carried on"),
        pytest.param("\t" + TWO_BOXES.replace(" ", "\t "), id="tabs"),
    ],
)
def test_read_obj__takes_what_is_found_in_the_wild(tmp_path: Path, text: str) -> None:
    expected = silhouette_of(read_obj(write(tmp_path / "plain.obj", TWO_BOXES)), "side", 64).mask
    found = silhouette_of(read_obj(write(tmp_path / "wild.obj", text)), "side", 64).mask
    assert np.array_equal(found, expected)


def test_negative_corner__counts_back_from_the_vertices_so_far(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -4 -3 -2\n"
    assert read_obj(write(tmp_path / "a.obj", text)).corners.tolist() == [0, 1, 2, 0, 1, 2]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no faces"),
        ("v 0 0 0\nv 1 0 0\n", "has no faces"),
        ("v 0 0 0\nv 1 0\n", r"line 2: 'v 1 0' is no vertex"),
        ("v 0 0 zero\n", "line 1"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "line 4"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "line 4"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x/1\n", "line 4"),
        ("v 0 0 0\nv 1 0 0\nf 1 2 3\n", "names vertex 3 of 2"),
        ("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("v 0 0 1e999\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n", "line 4"),
        ("\x00\x01\x02PK\x03\x04", "has no faces"),
    ],
)
def test_broken_obj__is_named_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = write(tmp_path / "broken.obj", text)
    with pytest.raises(SilhouetteError, match=message) as caught:
        read_obj(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_flat_model__shows_from_one_side_only(tmp_path: Path) -> None:
    plate = read_obj(write(tmp_path / "plate.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"))
    assert silhouette_of(plate, "front", 32).mask.sum() == pytest.approx((32 * SIDE) ** 2, rel=0.1)
    with pytest.raises(SilhouetteError, match="thinner"):
        silhouette_of(plate, "side", 32)


# --- folders


def shapenet(root: Path, version: int) -> Path:
    """Five chairs and three mugs; chair number k is k + 1 times as wide as high."""
    file = {1: "model.obj", 2: "models/model_normalized.obj"}[version]
    for k in range(5):
        write(root / SYNSETS["chair"] / f"c{k}" / file, box(0, 0, 0, 1, 1, k + 1) + faces(BOX_FACES))
    for k in range(3):
        write(root / SYNSETS["mug"] / f"m{k}" / file, TWO_BOXES)
    write(root / "taxonomy.json", "[]")
    (root / SYNSETS["mug"] / "empty").mkdir()
    return root


@pytest.mark.parametrize("version", [1, 2])
def test_folder__of_either_version_gives_each_model_once_a_turn(tmp_path: Path, version: int) -> None:
    source = ShapeNetTargets(shapenet(tmp_path, version), "chair", resolution=64)
    names = [f"chair_c{k}" for k in range(5)]
    assert [model.name for model in source.models] == names
    for turn in range(2):
        assert sorted(source.sample(5 * turn + k).name for k in range(5)) == names
    widths = {name: 0 for name in names}
    for model in source.models:
        widths[model.name] = int(source.load(model).mask.any(axis=1).sum())
    assert sorted(widths, key=lambda name: -widths[name]) == names


@pytest.mark.parametrize("categories", ["mug, chair", ["03797390", "chair"], None])
def test_categories__go_by_name_or_synset(tmp_path: Path, categories: str | list[str] | None) -> None:
    models = find_models(shapenet(tmp_path, 2), categories)
    assert len(models) == 8
    assert {model.synset for model in models} == {SYNSETS["mug"], SYNSETS["chair"]}


def test_split__is_a_partition_that_only_the_names_decide(tmp_path: Path) -> None:
    for k in range(200):
        write(tmp_path / "one" / "03001627" / f"{k:032x}" / "model.obj", "v 0 0 0\n")
        write(tmp_path / "two" / "03001627" / f"{k:032x}" / "models" / "model_normalized.obj", "v 1 1 1\n")
    parts = [
        {m.model for m in ShapeNetTargets(tmp_path / "one", split=s).models} for s in ("train", "validation", "test")
    ]
    assert sum(map(len, parts)) == len(set.union(*parts)) == 200
    assert [len(part) for part in parts] == pytest.approx([140, 20, 40], abs=20)
    assert {m.model for m in ShapeNetTargets(tmp_path / "two", split="test").models} == parts[2]


def test_split__follows_the_official_file(tmp_path: Path) -> None:
    root = shapenet(tmp_path, 2)
    rows = [
        "1,3001627,3001627,c0,train",
        "2,03001627,03001627,c1,val",
        "3,03797390,0,m2,test",
        "4,03001627,0,gone,test",
    ]
    write(root / "all.csv", "id,synsetId,subSynsetId,modelId,split\n" + "\n".join(rows) + "\n")
    found = {s: [m.model for m in ShapeNetTargets(root, split=s).models] for s in ("train", "validation", "test")}
    assert found == {"train": ["c0"], "validation": ["c1"], "test": ["m2"]}


def test_source__is_the_same_after_a_journey_to_a_worker(tmp_path: Path) -> None:
    source = make_targets("shapenet", root=shapenet(tmp_path, 1), categories="mug", view="top")
    there = pickle.loads(pickle.dumps(source))
    assert (there.name, there.view, there.models) == ("shapenet", "top", source.models)
    assert np.array_equal(there.sample(1).mask, source.sample(1).mask)


def test_unreadable_model__is_named_and_spoils_no_other(tmp_path: Path) -> None:
    root = shapenet(tmp_path, 2)
    write(root / SYNSETS["mug"] / "m1" / "models" / "model_normalized.obj", "v 0 0\n")
    source = ShapeNetTargets(root, "mug")
    with pytest.raises(SilhouetteError, match=r"m1/models/model_normalized\.obj, line 1"):
        source.load(source.models[1])
    assert source.load(source.models[0]).mask.any()


def with_split_file(root: Path, text: str) -> ShapeNetTargets:
    write(root / "all.csv", text)
    return ShapeNetTargets(root, split="test")


MISTAKES: dict[str, tuple[Callable[[Path], object], str]] = {
    "no folder": (lambda root: ShapeNetTargets(root / "nowhere"), "cannot read .*nowhere"),
    "an empty tree": (lambda root: ShapeNetTargets(root / "03797390" / "empty"), "has no categories"),
    "an unknown category": (lambda root: ShapeNetTargets(root, "ship"), "'ship' is unknown; give one of airplane"),
    "a category not there": (lambda root: ShapeNetTargets(root, "bed"), r"\(02818832\) is not there; there are 03"),
    "no category": (lambda root: ShapeNetTargets(root, []), "no category was given"),
    "an unknown split": (lambda root: ShapeNetTargets(root, split="dev"), "split='dev'"),
    "an unknown view": (lambda root: ShapeNetTargets(root, view="back"), "view='back'"),
    "an empty split": (lambda root: with_split_file(root, "synsetId,modelId,split\n"), "none of 8 models"),
    "a damaged split file": (lambda root: with_split_file(root, "a,b\n1,2\n"), "expected columns"),
    "a resolution too small": (lambda root: ShapeNetTargets(root, resolution=8).sample(0), "expected 16 to 2048"),
    "a seed out of range": (lambda root: ShapeNetTargets(root).sample(-1), "seed -1"),
    "no root": (lambda root: make_targets("shapenet"), "need the option 'root'"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake__is_told_in_one_line(tmp_path: Path, mistake: str) -> None:
    make, message = MISTAKES[mistake]
    with pytest.raises(ConfigError, match=message) as caught:
        make(shapenet(tmp_path, 2))
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, AutoPolyError)
