"""Files are whole or not there."""

import errno
import os
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopoly_env.errors import OutputError
from autopoly_env.files import file_stem, read_text, write_atomically


@pytest.mark.parametrize(("data", "stored"), [("ümlaut\n", "ümlaut\n".encode()), (b"\x00\xff", b"\x00\xff")])
def test_write__makes_folders_and_replaces_what_was_there(tmp_path: Path, data: str | bytes, stored: bytes) -> None:
    path = tmp_path / "a" / "b" / "file"
    assert write_atomically(path, b"old and longer") == path == write_atomically(str(path), data)
    assert path.read_bytes() == stored
    assert [p.name for p in path.parent.iterdir()] == ["file"]


def test_write__sweeps_up_what_a_killed_process_has_left_half_written(tmp_path: Path) -> None:
    old, fresh, other = (tmp_path / name for name in (".0123456789ab.tmp", ".ba9876543210.tmp", ".mine.tmp"))
    for path in (old, fresh, other):
        path.touch()
    for path in (old, other):
        os.utime(path, (0, 0))
    write_atomically(tmp_path / "file", "text")
    assert sorted(path.name for path in tmp_path.iterdir()) == [".ba9876543210.tmp", ".mine.tmp", "file"]


def test_write__follows_a_link(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    link = tmp_path / "latest"
    link.symlink_to(tmp_path / "folder" / "file")
    write_atomically(link, "text")
    assert link.is_symlink() and (tmp_path / "folder" / "file").read_text() == "text"


@pytest.mark.parametrize(
    ("failure", "raised"), [(OSError(errno.ENOSPC, "No space"), OutputError), (KeyboardInterrupt(), KeyboardInterrupt)]
)
def test_write__leaves_the_old_file_and_nothing_else_when_it_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: BaseException, raised: type[BaseException]
) -> None:
    path = tmp_path / "file"
    path.write_text("old")

    def fail(part: Any, _target: Any) -> None:
        assert Path(part).parent == tmp_path and Path(part).read_text() == "new"
        raise failure

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(raised):
        write_atomically(path, "new")
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("file", "old")]


def test_write__removes_the_half_that_fitted_on_a_full_disk(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (65536, limits[1]))
    try:
        with pytest.raises(OutputError, match=r"cannot write .*big.* \(File too large\)"):
            write_atomically(tmp_path / "big", bytes(1 << 20))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("place", ["file/below", "folder"])
def test_write__refuses_an_impossible_place_in_one_line(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    with pytest.raises(OutputError, match=re.escape(f"cannot write {tmp_path / place} (")) as caught:
        write_atomically(tmp_path / place, "text")
    assert "\n" not in str(caught.value)
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "folder"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_write__refuses_an_unwritable_folder(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="Permission denied"):
        write_atomically(tmp_path / "file", "text")


@pytest.mark.skipif(not Path("/dev/null").is_char_device(), reason="there is no /dev/null")
def test_write__never_replaces_a_device() -> None:
    with pytest.raises(OutputError, match="no ordinary file"):
        write_atomically("/dev/null", "text")


@pytest.mark.parametrize("name", ["a" * 251 + ".png", "é" * 125 + ".json"])
def test_write__takes_names_as_long_as_the_disk_does(tmp_path: Path, name: str) -> None:
    write_atomically(tmp_path / name, "text")
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("path", ["é" * 300, "a\0b", "", "/"])
def test_write__refuses_what_is_no_name_in_one_line(path: str) -> None:
    with pytest.raises(OutputError, match=r"^cannot write "):
        write_atomically(path, "text")


@given(st.text(st.characters(codec=None, exclude_characters="/\0"), min_size=1, max_size=120))
def test_stem__is_a_name_that_leaves_room_for_more(name: str) -> None:
    stem = file_stem(Path(name + ".png"))
    assert 0 < len(stem.encode()) <= 200
    assert not stem.startswith(".")


def test_read__takes_an_ordinary_file_within_bounds_only(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes("ümlaut".encode())
    assert read_text(path, 7) == "ümlaut"
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    path.with_name("bytes").write_bytes(b"\xff")
    for bad, most, reason in (
        (path, 6, "it has more than 6e-06 MB"),
        (pipe, 9, "it is no ordinary file"),
        (tmp_path, 9, "Is a directory"),
        (tmp_path / "bytes", 9, "not UTF-8 text"),
        (tmp_path / "a\0b", 9, "embedded null byte"),
        (tmp_path / "none", 9, "No such file or directory"),
    ):
        with pytest.raises(OSError) as caught:
            read_text(bad, most)
        assert caught.value.strerror == reason
