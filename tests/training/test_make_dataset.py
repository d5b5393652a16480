"""Data sets on disk: the same targets whoever makes them, whole after a kill, checked, read without pickles."""

import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image

from autopoly_env.errors import AutoPolyError, OutputError, RunError
from autopoly_env.files import write_atomically
from autopoly_env.targets import ConstructionTargets
from tests.helpers.commands import Run, runner
from tests.helpers.paths import ROOT
from tests.helpers.shapes import shapely_coverage
from training.datasets.build import MAX_N, MAX_SEED, SEEDS, DatasetSettings, build_dataset
from training.datasets.shards import Example, checksum, pack, read_manifest, read_shards, unpack
from training.make_dataset import main

SERIAL = ("--engine", "serial", "--resolution", 64)
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 2\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 1 3 4\n"


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs the command in this process, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return runner(main, capsys)


def same(one: Example, other: Example) -> bool:
    return replace(one, mask=other.mask) == other and np.array_equal(one.mask, other.mask)


# --- what is in a data set


def test_constructions__replay_to_their_masks(run: Run) -> None:
    assert run("constructions", "--n", 6, "--out", "data", "--difficulty", "3", *SERIAL).code == 0
    examples = list(read_shards("data"))
    assert [example.index for example in examples] == list(range(6))
    for example in examples:
        assert example.difficulty == 3
        assert example.mask.shape == (64, 64)
        sequence = example.sequence
        assert sequence is not None
        mesh = sequence.final()
        shape = shapely.union_all([shapely.Polygon(mesh.vertices[list(face)]) for face in mesh.faces])
        exact = shapely_coverage(shape, 64)
        assert (abs(exact[example.mask != (exact >= 0.5)] - 0.5) < 1e-9).all()
        source = ConstructionTargets(3, "paper", 64)
        assert example.sequence_json == source.sample_sequence(example.seed).to_json()


def test_objects__have_masks_and_no_sequences(run: Run) -> None:
    arguments = ("--n", 3, "--families", "mug,key", "--engine", "serial", "--resolution", 100)
    assert run("objects", "--out", "data", *arguments).code == 0
    for example in read_shards("data"):
        assert example.name.split("_")[0] in ("mug", "key")
        assert (example.sequence, example.difficulty, example.mask.shape) == (None, None, (100, 100))
        assert example.mask.any()


@pytest.mark.slow
def test_target__depends_on_seed_and_number_alone(run: Run) -> None:
    assert run("constructions", "--n", 7, "--out", "a", "--shard-size", 3, *SERIAL).code == 0
    assert run("constructions", "--n", 5, "--out", "b", "--workers", 2, "--resolution", 64).code == 0
    a, b = list(read_shards("a")), list(read_shards("b"))
    assert (len(a), len(b)) == (7, 5)
    assert all(same(one, other) for one, other in zip(a, b, strict=False))
    assert run("constructions", "--n", 5, "--out", "c", "--seed", 1, *SERIAL).code == 0
    assert not any(same(one, other) for one, other in zip(b, read_shards("c"), strict=True))


def test_source_seeds__of_different_seeds_and_splits_do_not_meet() -> None:
    """Every (split, seed) has MAX_N source seeds in a row: it is enough that their ends keep order."""
    ranges = []
    for split in SEEDS:
        for seed in range(MAX_SEED + 1):
            settings = DatasetSettings("constructions", split, seed)
            ranges.append((settings.source_seed(0), settings.source_seed(MAX_N - 1)))
    assert all(last - first == MAX_N - 1 for first, last in ranges)
    ranges.sort()
    assert all(last < first for (_, last), (first, _) in pairwise(ranges))
    train, test = DatasetSettings("objects", "train", 0), DatasetSettings("objects", "test", MAX_SEED)
    assert (train.source_seed(0), test.source_seed(MAX_N - 1)) == (0, 2**31 + 2**30 - 1)


def test_pack__gives_back_what_it_was_given() -> None:
    rng = np.random.default_rng(0)
    examples = [
        Example(4, 10, "a", rng.random((9, 9)) < 0.5, 2, '{"é": "—"}'),
        Example(5, 11, "a longer näme", rng.random((9, 9)) < 0.5, None, None),
    ]
    assert all(same(one, other) for one, other in zip(unpack(pack(examples)), examples, strict=True))
    assert pack(examples) == pack(examples)


# --- going on, and what can be wrong on disk


def interrupt_after(monkeypatch: pytest.MonkeyPatch, n_shards: int) -> None:
    """Press Ctrl-C when so many shards are written."""
    written = []

    def write(path: Path, data: bytes) -> Path:
        if len(written) == n_shards:
            raise KeyboardInterrupt
        written.append(path)
        return write_atomically(path, data)

    monkeypatch.setattr("training.datasets.build.write_atomically", write)


def test_resume__gives_the_same_bytes_and_remakes_nothing_that_is_there(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = ("constructions", "--n", 7, "--shard-size", 2, *SERIAL)
    assert run(*arguments, "--out", "whole").code == 0
    with monkeypatch.context() as patched:
        interrupt_after(patched, 2)
        said = run(*arguments, "--out", "data")
    assert (said.code, said.out) == (130, "")
    assert said.err == "stopped by Ctrl-C; what was done is in data: go on with --resume\n"
    assert len(list(read_shards("data", partial=True))) == 4
    with pytest.raises(RunError, match="2 of 4 shards are not made yet; go on with --resume"):
        list(read_shards("data"))
    kept = Path("data/shard-00001.npz").stat().st_mtime_ns
    assert run(*arguments, "--out", "data", "--resume").code == 0
    assert Path("data/shard-00001.npz").stat().st_mtime_ns == kept
    for name in (*read_manifest("whole").names, "dataset.json"):
        assert Path("data", name).read_bytes() == Path("whole", name).read_bytes()


@pytest.mark.slow
def test_killed_run__leaves_only_whole_shards_and_goes_on(run: Run, tmp_path: Path) -> None:
    arguments = [
        "constructions",
        "--n",
        "4000",
        "--shard-size",
        "20",
        *map(str, SERIAL),
        "--out",
        str(tmp_path / "data"),
    ]
    process = subprocess.Popen([sys.executable, "-m", "training.make_dataset", *arguments], cwd=ROOT)
    deadline = time.monotonic() + 60
    while not Path("data/shard-00001.npz").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    there = list(read_shards("data", partial=True))
    assert 10 <= len(there) < 4000
    n = read_manifest("data").n
    assert n == 4000
    assert all(
        same(example, DatasetSettings("constructions", resolution=64).example(example.index)) for example in there[:3]
    )


def damage(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize(
    "harm", [damage, lambda path: path.write_bytes(path.read_bytes()[:-1]), Path.unlink], ids=["bit", "cut", "gone"]
)
def test_damaged_shard__is_found_by_verify_refused_by_readers_and_repaired(
    run: Run, harm: Callable[[Path], object]
) -> None:
    arguments = ("constructions", "--n", 4, "--shard-size", 2, "--out", "data", *SERIAL)
    run(*arguments)
    before = Path("data/shard-00001.npz").read_bytes()
    said = run("verify", "data")
    assert (said.code, said.out) == (0, "data: 2 of 2 shards are as they should be (4 targets)\n")
    harm(Path("data/shard-00001.npz"))
    said = run("verify", "data")
    assert said.code == 1
    assert said.out.startswith("data: 1 of 2 shards")
    assert len(said.err.splitlines()) == 1 and "data/shard-00001.npz" in said.err
    with pytest.raises(RunError, match=r"shard-00001\.npz"):
        list(read_shards("data"))
    assert run(*arguments, "--resume").code == 0
    assert Path("data/shard-00001.npz").read_bytes() == before


def forge(folder: str, data: bytes) -> None:
    """Put other bytes in place of a shard, with the checksum that goes with them."""
    manifest = read_manifest(folder)
    write_atomically(Path(folder, "shard-00000.npz"), data)
    shards = (replace(manifest.shards[0], sha256=checksum(data)),)
    replace(manifest, shards=shards).write(Path(folder))


def with_pickle() -> bytes:
    stream = io.BytesIO()
    np.savez(stream, masks=np.array([{"a": 1}], object))
    return stream.getvalue()


@pytest.mark.parametrize(
    "data", [b"", b"PK\x03\x04", b"\x80\x04N.", with_pickle()], ids=["empty", "zip", "pickle", "in it"]
)
def test_forged_shard__is_refused_and_nothing_unpickled(run: Run, data: bytes) -> None:
    run("constructions", "--n", 2, "--out", "data", *SERIAL)
    forge("data", data)
    with pytest.raises(RunError, match="is no shard") as caught:
        list(read_shards("data"))
    assert "\n" not in str(caught.value)
    assert run("verify", "data").code == 1


def test_verify__replays_the_sequences(run: Run) -> None:
    run("constructions", "--n", 2, "--out", "data", *SERIAL)
    first, second = read_shards("data")
    assert first.sequence_json is not None
    forge(
        "data", pack([replace(first, sequence_json=first.sequence_json.replace('"moved": [[', '"moved": [[9')), second])
    )
    said = run("verify", "data")
    assert (said.code, len(said.err.splitlines())) == (1, 1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected JSON"),
        ('{"format": "autopoly-run"}', "expected the format 'autopoly-dataset'"),
        ('{"format": "autopoly-dataset", "version": 2}', "has version 2"),
        ('{"format": "autopoly-dataset", "version": 1, "settings": {}, "n": 0, "shard_size": 1}', "damaged: n:"),
        (
            '{"format": "autopoly-dataset", "version": 1, "settings": {}, "n": 1, "shard_size": 1, '
            '"shards": [{"name": "../x", "n": 1, "sha256": ""}]}',
            "'../x'",
        ),
    ],
)
def test_damaged_manifest__is_one_line(run: Run, text: str, message: str) -> None:
    Path("data").mkdir()
    Path("data/dataset.json").write_text(text)
    said = run("verify", "data")
    assert (said.code, said.out, len(said.err.splitlines())) == (1, "", 1)
    assert message in said.err


def test_failed_shard__is_told_and_the_others_are_made(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    sample = ConstructionTargets.sample

    def fail_on_two(source: ConstructionTargets, seed: int) -> object:
        if seed == 2:
            raise AutoPolyError("no luck")
        return sample(source, seed)

    monkeypatch.setattr(ConstructionTargets, "sample", fail_on_two)
    said = run("constructions", "--n", 3, "--shard-size", 1, "--out", "data", *SERIAL)
    assert (said.code, said.err) == (1, "error: shard-00002.npz: no luck\n")
    assert said.out == "data: 2 of 3 targets in 2 of 3 shards\n"


def test_full_disk__leaves_what_was_written_whole(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_room(path: Path, _: bytes) -> Path:
        raise OutputError(f"cannot write {path} (No space left on device); give a writable path")

    with monkeypatch.context() as patched:
        patched.setattr("training.datasets.build.write_atomically", no_room)
        said = run("constructions", "--n", 3, "--out", "data", *SERIAL)
    assert (said.code, len(said.err.splitlines())) == (1, 1)
    assert "No space left" in said.err
    assert os.listdir("data") == ["dataset.json"]


def test_fresh__replaces_a_data_set_and_leaves_other_files_alone(run: Run) -> None:
    run("constructions", "--n", 3, "--shard-size", 1, "--out", "data", *SERIAL)
    Path("data/notes.txt").write_text("mine")
    assert run("objects", "--n", 1, "--out", "data", "--fresh", *SERIAL).code == 0
    assert sorted(os.listdir("data")) == ["dataset.json", "notes.txt", "shard-00000.npz"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "Missing command"),
        (["constructions", "--out", "new"], "Missing option '--n'"),
        (["constructions", "--n", "0", "--out", "new"], "n=0"),
        (["constructions", "--n", "9999999", "--out", "new"], "at most 4194304 targets"),
        (["constructions", "--n", "1", "--out", "new", "--shard-size", "0"], "shard_size=0"),
        (["constructions", "--n", "1", "--out", "new", "--difficulty", "hard"], "--difficulty hard"),
        (["constructions", "--n", "1", "--out", "new", "--difficulty", "5-3"], "difficulty (5, 3)"),
        (["constructions", "--n", "1", "--out", "new", "--operators", "melt"], "melt"),
        (["constructions", "--n", "1", "--out", "new", "--split", "dev"], "split='dev'"),
        (["constructions", "--n", "1", "--out", "new", "--seed", "256"], "seed 256: expected 0 to 255"),
        (["constructions", "--n", "1", "--out", "new", "--resolution", "8"], "resolution 8"),
        (["constructions", "--n", "1", "--out", "new", "--engine", "steam"], "engine 'steam'"),
        (["constructions", "--n", "1", "--out", "new", "--resume", "--fresh"], "give one of them"),
        (["objects", "--n", "1", "--out", "new", "--families", "ship"], "family 'ship' is unknown"),
        (["constructions", "--n", "1", "--out", "data"], "holds a data set; go on with --resume"),
        (["constructions", "--n", "2", "--out", "data", "--resume"], "was begun with settings"),
        (["silhouettes", "--out", "new"], "Missing argument"),
        (["silhouettes", "a.obj", "--out", "new", "--view", "back"], "view='back'"),
        (["silhouettes", "data", "--out", "new"], "has no categories"),
    ],
)
def test_wrong_usage__is_one_line_and_exit_code_2(run: Run, arguments: list[str], message: str) -> None:
    Path("a.obj").write_text(TETRAHEDRON)
    run("constructions", "--n", 1, "--out", "data", *SERIAL)
    said = run(*arguments)
    assert (said.code, said.out, len(said.err.splitlines())) == (2, "", 1)
    assert message in said.err


# --- silhouettes of models


def test_silhouettes__are_drawn_and_what_cannot_be_read_is_recorded(run: Run) -> None:
    Path("sub").mkdir()
    Path("a.obj").write_text(TETRAHEDRON)
    Path("sub/a.obj").write_text(TETRAHEDRON)
    Path("broken.obj").write_text("v 0 0\n")
    said = run("silhouettes", "a.obj", "broken.obj", "sub/a.obj", "gone.obj", "--out", "out", *SERIAL)
    assert (said.code, said.out) == (1, "out: 2 of 4 silhouettes\n")
    assert len(said.err.splitlines()) == 2
    records = [json.loads(line) for line in Path("out/silhouettes.jsonl").read_text().splitlines()]
    assert [record["picture"] for record in records] == ["a.png", None, "a-2.png", None]
    assert "broken.obj, line 1" in records[1]["error"]
    picture = np.asarray(Image.open("out/a.png"))
    assert picture.shape == (64, 64)
    wide, high = picture.any(axis=0).sum(), picture.any(axis=1).sum()
    assert wide / high == pytest.approx(2.0, rel=0.1)  # from the side: z is 2, y is 1


@pytest.mark.parametrize("kind", ["stl", "ply", "off", "glb"])
def test_silhouettes__of_what_trimesh_reads_are_those_of_the_obj(run: Run, kind: str) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install -e '.[bench]')")
    Path("a.obj").write_text(TETRAHEDRON)
    trimesh.load_mesh("a.obj").export(f"b.{kind}")
    assert run("silhouettes", "a.obj", f"b.{kind}", "--out", "out", "--view", "top", *SERIAL).code == 0
    assert Path("out/a.png").read_bytes() == Path("out/b.png").read_bytes()


def test_silhouettes__of_a_file_that_trimesh_cannot_read_fail_alone(run: Run) -> None:
    pytest.importorskip("trimesh", reason="trimesh is not installed (pip install -e '.[bench]')")
    Path("a.obj").write_text(TETRAHEDRON)
    Path("b.stl").write_bytes(b"\x00" * 10)
    Path("c.xyzzy").write_text("?")
    said = run("silhouettes", "b.stl", "c.xyzzy", "a.obj", "--out", "out", *SERIAL)
    assert (said.code, len(said.err.splitlines())) == (1, 2)
    assert Path("out/a.png").exists()


def test_silhouettes__without_trimesh_say_which_extra_has_it(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "trimesh", None)
    said = run("silhouettes", "b.stl", "--out", "out")
    assert (said.code, said.err.splitlines()) == (
        2,
        ["error: b.stl needs trimesh; pip install -e '.[bench]', or give .obj files"],
    )


def test_silhouettes__of_a_shapenet_folder_take_a_category_and_a_split(run: Run) -> None:
    for synset, model in (("03001627", "c0"), ("03001627", "c1"), ("03797390", "m0")):
        path = Path("net", synset, model, "models", "model_normalized.obj")
        path.parent.mkdir(parents=True)
        path.write_text(TETRAHEDRON)
    Path("net/all.csv").write_text("synsetId,modelId,split\n03001627,c0,train\n03001627,c1,test\n03797390,m0,test\n")
    arguments = ("--categories", "chair", "--split", "test", "--out", "out", *SERIAL)
    assert run("silhouettes", "net", *arguments).code == 0
    assert sorted(os.listdir("out")) == ["chair_c1.png", "silhouettes.jsonl"]


def test_engine__gives_back_every_shard_as_it_is_done(tmp_path: Path) -> None:
    """What `build_dataset` tells its caller is what is on the disk."""
    from training.datasets.build import begin_dataset

    settings = DatasetSettings("constructions", resolution=64)
    manifest = begin_dataset(tmp_path, settings, 4, 2, resume=False, fresh=False)
    told: list[str] = []
    build_dataset(
        tmp_path,
        settings,
        manifest,
        engine="serial",
        on_shard=lambda shard, _: told.append(shard.name if shard else ""),
    )
    assert told == ["shard-00000.npz", "shard-00001.npz"]
    assert [checksum((tmp_path / name).read_bytes()) for name in told] == [
        s.sha256 for s in read_manifest(tmp_path).shards
    ]
