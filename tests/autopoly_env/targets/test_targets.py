"""Target sources: the same seed gives the same picture; what is promised of shapes, things and folders holds."""

import hashlib
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from skimage.measure import label

from autopoly_env.errors import AutoPolyError, ConfigError, SilhouetteError
from autopoly_env.mesh import PolyMesh, defects_of, is_valid
from autopoly_env.operators import preset
from autopoly_env.raster import coverage
from autopoly_env.sequence import ConstructionSequence
from autopoly_env.silhouette import Silhouette
from autopoly_env.targets import (
    HELD_OUT,
    LEARNING,
    SPLITS,
    ConstructionTargets,
    FolderTargets,
    ObjectTargets,
    TargetSource,
    growth,
    make_targets,
    split_seed,
)
from autopoly_env.targets.construction_kernels import n_regions
from autopoly_env.targets.dice import Dice
from autopoly_env.targets.families import FAMILIES, FAMILIES_V0, Family
from autopoly_env.targets.growth import OUTLINE_OPERATORS
from autopoly_env.targets.pencil import box
from docs import draw_targets
from tests.helpers.paths import ROOT

N_EACH = 25  # constructions of every difficulty; 200 and more in all
FULL = tuple(operator.name for operator in preset("full"))
THINGS = {name: ObjectTargets((name,)) for name in FAMILIES}


def digest(silhouette: Silhouette) -> str:
    return hashlib.sha256(np.packbits(silhouette.mask).tobytes()).hexdigest()[:12]


def parts_and_holes(mask: np.ndarray) -> tuple[int, int]:
    """Parts (joined over corners) and holes of a mask that stays clear of the border."""
    return int(label(mask, connectivity=2).max()), int(label(~mask, connectivity=1).max()) - 1


# --- seeds and names


PICTURES = {
    ("construction", 0): "606f8b82d7cc",
    ("construction", 1): "2c73a9a5ddc8",
    ("construction", 2**31): "b7b7e118ae94",
    ("objects", 0): "7d165fa1bd62",
    ("objects", 1): "c49355325440",
    ("objects", 2**31): "c3795600edea",
}


@pytest.mark.parametrize(("name", "seed"), PICTURES)
def test_seed__gives_the_picture_that_it_always_gave(name: str, seed: int) -> None:
    """The digests were taken with NumPy 2.4 and GEOS 3.14; NumPy 2.0 and GEOS 3.13 gave the same."""
    assert digest(make_targets(name).sample(seed)) == PICTURES[name, seed]


@pytest.mark.slow
def test_seed__gives_the_same_picture_in_another_process() -> None:
    seeds = [split_seed("test", i) for i in range(20)]
    program = (
        "from autopoly_env.targets import make_targets\n"
        "from tests.autopoly_env.targets.test_targets import digest\n"
        f"print(*(digest(make_targets(n).sample(s)) for n in ('construction', 'objects') for s in {seeds}))"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "17"}
    run = subprocess.run([sys.executable, "-c", program], cwd=ROOT, env=environment, capture_output=True, check=True)
    here = [digest(make_targets(name).sample(seed)) for name in ("construction", "objects") for seed in seeds]
    assert run.stdout.decode().split() == here
    assert len(set(here)) == len(here)


@pytest.mark.parametrize("name", ["construction", "objects"])
def test_sample__does_not_depend_on_what_was_sampled_before(name: str) -> None:
    source = make_targets(name)
    first = source.sample(5)
    source.sample(6)
    assert digest(source.sample(5)) == digest(first)


def test_splits__share_no_seed_and_use_them_all() -> None:
    assert split_seed("train", 0) == 0
    assert split_seed("train", 2**31 - 1) == 2**31 - 1
    assert split_seed("test", 0) == 2**31
    assert split_seed("test", 2**31 - 1) == 2**32 - 1
    assert SPLITS["train"][-1] < SPLITS["test"][0]


def test_train_split__is_what_is_learnt_from_and_then_what_is_held_out() -> None:
    assert (LEARNING, HELD_OUT) == (range(2**30), range(2**30, 2**31))
    assert [*LEARNING[:1], *HELD_OUT[-1:]] == [SPLITS["train"][0], SPLITS["train"][-1]]


@pytest.mark.parametrize("split", ["train", "test"])
@pytest.mark.parametrize("index", [-1, 2**31])
def test_split_seed__refuses_an_index_that_would_leave_the_split(split: str, index: int) -> None:
    with pytest.raises(ConfigError, match=f"index {index} is outside"):
        split_seed(split, index)


@pytest.mark.parametrize("seed", [-1, 2**32])
@pytest.mark.parametrize("name", ["construction", "objects"])
def test_sample__refuses_a_seed_out_of_range(name: str, seed: int) -> None:
    with pytest.raises(ConfigError, match=r"give 0\.\.4294967295"):
        make_targets(name).sample(seed)


def test_sources__say_their_names(tmp_path: Path) -> None:
    Image.fromarray(np.eye(16, dtype=np.uint8) * 255).save(tmp_path / "line.png")
    sources: list[TargetSource] = [ConstructionTargets(), ObjectTargets(), FolderTargets(tmp_path)]
    assert [source.name for source in sources] == ["construction", "objects", tmp_path.name]


# --- constructions


def constructions() -> list[tuple[ConstructionTargets, int]]:
    """Sources of every difficulty and preset, each with the seeds of its first targets."""
    sources = [ConstructionTargets(d, operators) for d in (1, 2, 3, 5, 8) for operators in ("paper", "full")]
    return [(source, split_seed("train", i)) for source in sources for i in range(N_EACH)]


@pytest.fixture(scope="module")
def built() -> list[tuple[ConstructionTargets, Silhouette, ConstructionSequence]]:
    return [(source, source.sample(seed), source.sample_sequence(seed)) for source, seed in constructions()]


Built = list[tuple[ConstructionTargets, Silhouette, ConstructionSequence]]


def outline(mesh: PolyMesh) -> tuple[int, ...]:
    return tuple(sorted(map(len, mesh.topology.boundary_loops)))


@pytest.mark.slow
def test_sequence__starts_at_a_rectangle_and_replays_to_the_silhouette(built: Built) -> None:
    for source, silhouette, sequence in built:
        assert sequence.start.counts == (4, 4, 1)
        again = ConstructionSequence.from_json(sequence.to_json())
        assert again.final() == sequence.final()
        assert np.array_equal(coverage(again.final(), source.resolution) >= 0.5, silhouette.mask)


@pytest.mark.slow
def test_sequence__keeps_the_score_of_every_mesh(built: Built) -> None:
    for _, silhouette, sequence in built:
        assert sequence.settings["target"] == silhouette.name
        assert sequence.start_score["iou"] < 1.0
        last = sequence.steps[-1].score
        assert (last["iou"], last["self_intersections"]) == (1.0, 0)
        assert last["total"] == 100.0 - sum(sequence.final().counts)  # the paper's weights for synthetic shapes


@pytest.mark.slow
def test_difficulty__is_how_often_the_outline_changes(built: Built) -> None:
    for source, _, sequence in built:
        operators = [step.operator for step in sequence.steps]
        assert sum(operator in OUTLINE_OPERATORS for operator in operators) == source.difficulty
        meshes = sequence.meshes()
        before = [outline(meshes[0])]
        for operator, mesh in zip(operators, meshes[1:], strict=True):
            assert (outline(mesh) in before) == (operator == "face_split")  # a split comes with a deletion
            before.append(outline(mesh))


@pytest.mark.slow
def test_face_split__is_always_followed_by_the_deletion_of_a_part(built: Built) -> None:
    splits = 0
    for _, _, sequence in built:
        for step, following in zip(sequence.steps, sequence.steps[1:], strict=False):
            if step.operator == "face_split":
                splits += 1
                assert following.operator == "face_delete"
                parts = {step.element["face"], *step.created["faces"]}
                assert following.element["face"] in parts
        assert sequence.steps[-1].operator != "face_split"
    assert splits > 20


@pytest.mark.slow
def test_difficulty_range__is_drawn_evenly() -> None:
    source = ConstructionTargets((1, 3))
    n_changes = [
        sum(step.operator in OUTLINE_OPERATORS for step in source.sample_sequence(seed).steps) for seed in range(150)
    ]
    assert min(np.bincount(n_changes, minlength=4)[1:]) > 35


@pytest.mark.slow
def test_every_mesh__is_valid_and_lies_in_the_picture_without_crossing_overlap_or_flip(built: Built) -> None:
    for _, _, sequence in built:
        for mesh in sequence.meshes():
            assert is_valid(mesh)
            assert defects_of(mesh) == (0, 0)
            assert coverage(mesh, 64).max() <= 1.0 + 1e-9
            assert 0.0 < mesh.vertices.min() and mesh.vertices.max() < 1.0


@pytest.mark.slow
def test_shape__is_centred_and_covers_a_fair_share_of_the_picture(built: Built) -> None:
    for _, silhouette, sequence in built:
        assert 0.08 <= silhouette.mask.mean() <= 0.6
        low, high = sequence.final().vertices.min(axis=0), sequence.final().vertices.max(axis=0)
        np.testing.assert_allclose(0.5 * (low + high), 0.5, atol=1e-12)
        assert 0.59 < (high - low).max() < 0.89


@pytest.mark.slow
def test_shape__survives_erosion_and_a_small_picture(built: Built) -> None:
    for _, _, sequence in built:
        mesh = sequence.final()
        expected = (mesh.topology.n_components, mesh.topology.n_holes)
        assert parts_and_holes(coverage(mesh, 64) >= 0.5) == expected
        faces = shapely.union_all([shapely.Polygon(mesh.vertices[list(face)]) for face in mesh.faces])
        thinner = faces.buffer(-0.5 / 128.0, join_style="mitre")
        assert len(shapely.get_parts(thinner)) == mesh.topology.n_components
        assert thinner.area > 0.85 * faces.area


@pytest.mark.slow
def test_operators__are_the_ones_asked_for() -> None:
    used = {"paper": set[str](), "full": set[str](), "edge_extrude,edge_dissolve": set[str]()}
    for operators, names in used.items():
        source = ConstructionTargets(3, operators)
        names.update(step.operator for seed in range(60) for step in source.sample_sequence(seed).steps)
    assert used["paper"] == {"edge_subdivide", "edge_extrude", "face_split", "face_delete"}
    assert used["full"] == used["paper"] | {"face_hole", "vertex_dissolve"}
    assert used["edge_extrude,edge_dissolve"] == {"edge_extrude"}


def test_face_split__is_left_out_where_nothing_can_be_deleted() -> None:
    source = ConstructionTargets(2, ["edge_subdivide", "face_split"])
    assert {step.operator for seed in range(30) for step in source.sample_sequence(seed).steps} == {"edge_subdivide"}


def test_construction__ends_where_the_operators_cannot_reach_the_difficulty() -> None:
    source = ConstructionTargets(2, "vertex_dissolve")  # a triangle has no vertex to give
    with pytest.raises(ConfigError, match="gave no shape of difficulty 2"):
        source.sample(0)


def test_resolution__changes_the_pixels_and_not_the_shape() -> None:
    small, large = ConstructionTargets(3).sample(4), ConstructionTargets(3, resolution=256).sample(4)
    assert (small.resolution, large.resolution) == (128, 256)
    assert np.abs(large.target(128).coverage - small.mask).mean() < 0.02


# --- things


N_THINGS = 24


@pytest.fixture(scope="module")
def things() -> dict[str, list[np.ndarray]]:
    return {name: [source.sample(seed).mask for seed in range(N_THINGS)] for name, source in THINGS.items()}


@pytest.mark.slow
def test_there_are__many_families_and_a_source_of_all_draws_every_one() -> None:
    assert len(FAMILIES) >= 16
    source = ObjectTargets(resolution=64)
    drawn = [source.sample(seed).name.rsplit("_", 1) for seed in range(600)]
    assert {name for name, _ in drawn} == set(FAMILIES)
    assert [int(seed) for _, seed in drawn] == list(range(600))


LEAST_HOLES = {
    "anchor": 1,
    "bicycle": 3,
    "camera": 1,
    "clock": 1,
    "fence": 3,
    "jug": 1,
    "key": 1,
    "ladder": 1,
    "mug": 1,
    "pan": 1,
    "saw": 1,
    "scissors": 2,
    "shelf": 2,
    "teapot": 1,
    "trophy": 2,
}


@pytest.mark.slow
@pytest.mark.parametrize("family", LEAST_HOLES)
def test_family__has_the_holes_that_make_it(things: dict[str, list[np.ndarray]], family: str) -> None:
    assert min(parts_and_holes(mask)[1] for mask in things[family]) >= LEAST_HOLES[family]


@pytest.mark.parametrize("family", ["bottle", "hammer", "screwdriver", "umbrella", "aeroplane", "cutlery"])
def test_family__has_no_holes(things: dict[str, list[np.ndarray]], family: str) -> None:
    assert max(parts_and_holes(mask)[1] for mask in things[family]) == 0


WHOLE = ["chair", "stool", "table", "bed", "sofa", "shelf", "glass", "teapot", "jug", "trophy", "bicycle", "house"]
WHOLE += ["fence", "signpost", "anchor", "padlock", "ladder", "key", "wrench", "hammer", "scissors", "saw", "spade"]
WHOLE += ["umbrella", "screwdriver", "guitar", "aeroplane"]


@pytest.mark.slow
@pytest.mark.parametrize("family", WHOLE)
def test_family__is_in_one_piece(things: dict[str, list[np.ndarray]], family: str) -> None:
    assert {parts_and_holes(mask)[0] for mask in things[family]} == {1}


@pytest.mark.slow
@pytest.mark.parametrize("family", ["mug", "boat", "rocket", "brush", "cutlery", "bulb", "car", "lamp", "pot"])
def test_family__comes_in_one_piece_and_in_several(family: str) -> None:
    n_parts = [parts_and_holes(THINGS[family].sample(seed).mask)[0] for seed in range(80)]
    assert min(n_parts) == 1 < max(n_parts)


@pytest.mark.parametrize("family", FAMILIES)
def test_thing__is_clear_of_the_border_and_fills_the_picture(things: dict[str, list[np.ndarray]], family: str) -> None:
    for mask in things[family]:
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        extents = rows[-1] - rows[0] + 1, columns[-1] - columns[0] + 1
        assert 0.7 * 256 <= max(extents) <= 0.92 * 256
        assert min(rows[0], columns[0], 255 - rows[-1], 255 - columns[-1]) >= 0.04 * 256


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_things__of_a_family_differ(things: dict[str, list[np.ndarray]], family: str) -> None:
    masks = things[family]
    overlaps = [(a & b).sum() / (a | b).sum() for i, a in enumerate(masks) for b in masks[:i]]
    assert max(overlaps) < 0.99
    assert np.median(overlaps) < 0.85


@pytest.mark.slow
def test_thing__has_nothing_as_thin_as_a_pixel_but_corners(things: dict[str, list[np.ndarray]]) -> None:
    """What a 2 x 2 square cannot reach, and what a gap of that width holds, are pixels at corners."""
    for masks in things.values():
        for mask in masks:
            for picture in (mask, ~mask):
                squares = picture[1:, 1:] & picture[1:, :-1] & picture[:-1, 1:] & picture[:-1, :-1]
                reached = np.zeros_like(picture)
                for i in (0, 1):
                    for j in (0, 1):
                        reached[i : 255 + i, j : 255 + j] |= squares
                lost = label(picture & ~reached, connectivity=2)
                assert np.bincount(lost.ravel())[1:].max(initial=0) <= 4


def test_families__may_be_chosen() -> None:
    chosen = ObjectTargets(["mug", "key"])
    assert {chosen.sample(seed).name.split("_")[0] for seed in range(30)} == {"mug", "key"}
    assert digest(ObjectTargets("mug,key").sample(3)) == digest(chosen.sample(3))


def test_families_v0__are_the_41_that_seeds_have_always_been_drawn_among() -> None:
    assert (len(FAMILIES_V0), FAMILIES_V0[0], FAMILIES_V0[26], FAMILIES_V0[-1]) == (41, "chair", "ladder", "rocket")
    assert set(FAMILIES_V0) <= set(FAMILIES)
    drawn = " ".join(ObjectTargets(resolution=64).sample(seed).name.split("_")[0] for seed in range(12))
    assert drawn == "teapot pan screwdriver car anchor umbrella pan sofa lamp signpost screwdriver glass"


def test_a_new_family__changes_no_seed_of_version_0(monkeypatch: pytest.MonkeyPatch) -> None:
    source = ObjectTargets(resolution=64)
    before = [digest(source.sample(seed)) for seed in range(30)]
    slab = {"slab": Family(lambda dice: box(0.0, 0.0, 1.0, dice.between(0.2, 0.4)))}
    everything = {**slab, **FAMILIES, "plank": slab["slab"]}
    monkeypatch.setattr("autopoly_env.targets.objects.FAMILIES", everything)
    assert [digest(source.sample(seed)) for seed in range(30)] == before
    assert ObjectTargets(["slab"], resolution=64).sample(3).name == "slab_3"
    assert {ObjectTargets("mug,plank").sample(seed).name.split("_")[0] for seed in range(20)} == {"mug", "plank"}


def test_thing__is_the_same_at_another_resolution() -> None:
    small, large = ObjectTargets(resolution=128).sample(9), ObjectTargets(resolution=512).sample(9)
    assert (small.name, small.resolution, large.resolution) == (large.name, 128, 512)
    assert np.abs(large.target(128).coverage - small.mask).mean() < 0.03


# --- folders


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for i in range(5):
        mask = np.zeros((32, 32), np.uint8)
        mask[4 : 10 + 3 * i, 4:20] = 255
        Image.fromarray(mask).save(tmp_path / f"box{i}.png")
    return tmp_path


def test_folder__gives_every_image_once_before_one_comes_again(folder: Path) -> None:
    source = make_targets(folder)
    turns = [[source.sample(5 * turn + i).name for i in range(5)] for turn in range(8)]
    assert all(sorted(turn) == [f"box{i}" for i in range(5)] for turn in turns)
    assert len(set(map(tuple, turns))) > 4


def test_folder__gives_the_same_image_for_a_seed_again_and_after_pickling(folder: Path) -> None:
    source = FolderTargets(folder)
    assert source.names == ("box0", "box1", "box2", "box3", "box4")
    copy = pickle.loads(pickle.dumps(source))
    for seed in (0, 3, 2**31, 2**32 - 1):
        assert source.sample(seed) is source.sample(seed)
        assert copy.sample(seed).name == source.sample(seed).name


def test_folder__leaves_out_what_it_cannot_use_and_says_so(folder: Path) -> None:
    (folder / "broken.png").write_bytes(b"no image")
    Image.new("L", (9, 9)).save(folder / "black.png")
    with pytest.warns(UserWarning, match=r"2 of 7 pictures .* left out: .*black\.png.*; .*broken\.png"):
        source = FolderTargets(folder)
    assert source.names == ("box0", "box1", "box2", "box3", "box4")
    assert {source.sample(seed).name for seed in range(5)} == set(source.names)


def test_folder__refuses_when_nothing_can_be_used(tmp_path: Path) -> None:
    Image.new("L", (9, 9)).save(tmp_path / "black.png")
    with pytest.raises(SilhouetteError, match=r"holds no picture with an object: .*black\.png"):
        make_targets(tmp_path)


def test_folder__takes_the_options_that_say_what_is_the_object(folder: Path) -> None:
    dark = make_targets(folder, object="dark")
    assert dark.sample(0).mask.sum() == 32 * 32 - make_targets(folder).sample(0).mask.sum()


def test_folder__refuses_a_seed_out_of_range(folder: Path) -> None:
    with pytest.raises(ConfigError, match="seed 4294967296"):
        FolderTargets(folder).sample(2**32)


# --- what may be asked for


def test_make_targets__gives_the_source_with_its_options() -> None:
    assert make_targets("construction", difficulty=2, operators="full") == ConstructionTargets(2, "full")
    assert make_targets("objects", families=["mug"], resolution=64) == ObjectTargets(["mug"], 64)


WRONG = {
    "a name that is none": (
        lambda: make_targets("cosntruction"),
        "construction, objects, shapenet or the path of a folder",
    ),
    "an unknown option": (lambda: make_targets("objects", family="mug"), "families, resolution"),
    "an option for a folder": (lambda: make_targets(ROOT / "examples", resolution=64), "folders have no option"),
    "an unknown split": (lambda: split_seed("validation", 0), "train or test"),
    "no difficulty": (lambda: ConstructionTargets(0), "from 1 to"),
    "a difficulty beyond all": (lambda: ConstructionTargets((1, 99)), "from 1 to"),
    "a difficulty the wrong way round": (lambda: ConstructionTargets((4, 2)), "from 1 to"),
    "a broken difficulty": (lambda: ConstructionTargets((1.5, 2)), "from 1 to"),
    "an unknown operator": (lambda: ConstructionTargets(operators=["bevel"]), "bevel"),
    "operators that show nothing": (lambda: ConstructionTargets(operators="face_split"), "at least one of"),
    "too few pixels": (lambda: ConstructionTargets(resolution=8), "32 to 1024"),
    "too few pixels for a thing": (lambda: ObjectTargets(resolution=8), "64 to 2048"),
    "an unknown family": (lambda: ObjectTargets("mug,spoon"), "'spoon' is unknown; give some of chair"),
    "no family": (lambda: ObjectTargets([]), "no family was given"),
    "a folder without images": (lambda: make_targets(ROOT / "tests"), "holds no images"),
}


@pytest.mark.parametrize("what", WRONG)
def test_wrong_setting__is_refused_in_one_line_that_says_what_is_allowed(what: str) -> None:
    call, words = WRONG[what]
    with pytest.raises(AutoPolyError) as caught:
        call()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_pictures_of_the_documentation__are_small_and_can_be_drawn_again(tmp_path: Path) -> None:
    draw_targets.main(tmp_path)
    names = [path.name for path in sorted(tmp_path.iterdir())]
    assert names == ["targets_construction.png", "targets_objects.png", "targets_sequence.png"]
    for name in names:
        assert (tmp_path / name).stat().st_size < 120_000
        with Image.open(tmp_path / name) as drawn, Image.open(draw_targets.PICTURES / name) as kept:
            assert drawn.size == kept.size


def test_documentation__counts_the_families_and_shows_the_pictures() -> None:
    text = (draw_targets.PICTURES.parent / "targets.md").read_text(encoding="utf-8")
    assert f"{len(FAMILIES)} families" in text
    assert all(f"(pictures/{path.name})" in text for path in draw_targets.PICTURES.glob("targets_*.png"))


# --- the kernels of growth, and the draws


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.3, 0.5, 0.7]))
def test_regions__are_those_that_scikit_image_labels(seed: int, share: float) -> None:
    image = (np.random.default_rng(seed).random((24, 24)) < share).astype(float)
    assert n_regions(image) == label(image, background=-1, connectivity=1).max()


def test_dice__give_the_same_numbers_however_they_are_asked_for() -> None:
    one, other = Dice(3, 7), Dice(3, 7)
    ahead = one.ahead(2000)
    assert len(ahead) >= 2000 and (ahead[:700] == one.use(700)).all()
    assert [other.between(0.0, 1.0) for _ in range(699)] == ahead[:699].tolist()
    other.skip(1)
    assert one.between(0.0, 1.0) == other.between(0.0, 1.0) == ahead[700]
    assert (one.array(3, 2) == 2.0 * ahead[701:707].reshape(3, 2) - 1.0).all()
    assert (ahead == np.random.default_rng([3, 7]).random(len(ahead))).all()


@pytest.mark.parametrize("difficulty", [3, 10])
def test_growth__is_the_same_however_many_numbers_are_drawn_ahead(
    difficulty: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = ConstructionTargets(difficulty, "full")
    before = [source.sample_sequence(seed) for seed in range(12)]
    monkeypatch.setattr(growth, "_N_DRAWS", 8)
    assert [source.sample_sequence(seed) for seed in range(12)] == before


def test_growth__is_told_by_the_operators_as_the_kernel_did_it() -> None:
    for seed in range(40):
        grown = growth.grow(Dice(1, seed), FULL, 4)
        if grown is not None:
            *_, last = grown.told()
            assert last.mesh.faces == grown.last.faces and (last.mesh.vertices == grown.last.vertices).all()
