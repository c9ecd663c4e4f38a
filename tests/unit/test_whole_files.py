"""Files that belong together are written together or not at all."""

import os
import resource
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from rtctl import pictures
from rtctl.errors import DataError
from rtctl.whole_files import LEFT_NS, whole, write_together, write_whole


def test_all_files_are_there_and_nothing_else(tmp_path):
    write_together(tmp_path / "a" / "b", {"one": b"1", "two": b"2"})
    assert {path.name: path.read_bytes() for path in (tmp_path / "a" / "b").iterdir()} == {
        "one": b"1",
        "two": b"2",
    }


def test_when_the_last_cannot_be_written_the_first_keeps_its_old_content(tmp_path):
    (tmp_path / "one").write_bytes(b"old")
    (tmp_path / "two").mkdir()
    with pytest.raises(DataError, match="two: is a folder; remove it"):
        write_together(tmp_path, {"one": b"new", "two": b"2"})
    assert (tmp_path / "one").read_bytes() == b"old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "two"]


def test_a_full_disk_leaves_neither_files_nor_folder(tmp_path, monkeypatch):
    def full(self, *arguments, **options):
        if self.name.startswith(".two"):
            raise OSError(28, "No space left on device")
        return open_file(self, *arguments, **options)

    open_file = Path.open
    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(DataError, match="two: cannot write: No space left on device"):
        write_together(tmp_path / "out", {"one": b"1", "two": b"2"})
    assert list(tmp_path.iterdir()) == []


def test_an_interruption_leaves_no_temporary_file(tmp_path, monkeypatch):
    def interrupted(_self, _target):
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_together(tmp_path / "out", {"one": b"1"})
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_place_of_the_folder_is_named(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(DataError, match="out: cannot write"):
        write_together(tmp_path / "out", {"one": b"1"})


@contextmanager
def room_for(n_bytes):
    """No file may grow beyond that, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_file_without_room_keeps_its_old_content_and_is_named(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("old")
    with (
        room_for(1000),
        pytest.raises(DataError, match=r"a\.csv: cannot write: .*free space"),
        whole(path) as new,
    ):
        new.write_bytes(bytes(5000))
    assert {one.name: one.read_text() for one in tmp_path.iterdir()} == {"a.csv": "old"}


@pytest.mark.parametrize(("name", "begins"), [("a.png", b"\x89PNG"), ("a.pdf", b"%PDF"), ("a.svg", b"<?xml")])
def test_a_picture_is_what_its_name_ends_with_and_whole_or_not_there(name, begins, tmp_path):
    figure = pictures.blank(3, 2)
    figure.subplots().plot([0, 1])
    with room_for(1000), pytest.raises(DataError, match="cannot write"):
        pictures.save(figure, tmp_path / name)
    assert list(tmp_path.iterdir()) == []
    pictures.save(figure, tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(begins)


def test_no_file_takes_the_place_of_a_pipe(tmp_path):
    pipe = tmp_path / "null"
    os.mkfifo(pipe)
    with pytest.raises(DataError, match="null: cannot write: it is no file"), whole(pipe) as new:
        new.write_bytes(b"1")
    with pytest.raises(OSError, match="it is no file"):
        write_whole(pipe, b"1")
    with pytest.raises(DataError, match="null: cannot write: it is no file"):
        write_together(tmp_path, {"null": b"1"})
    assert [path.name for path in tmp_path.iterdir()] == ["null"]
    assert pipe.is_fifo()


def test_what_is_in_a_file_is_on_the_disk_before_its_name(tmp_path, monkeypatch):
    done, replace, fsync = [], Path.replace, os.fsync
    monkeypatch.setattr(Path, "replace", lambda new, path: done.append("name") or replace(new, path))
    monkeypatch.setattr(os, "fsync", lambda fd: done.append("content") or fsync(fd))
    with whole(tmp_path / "a") as new:
        new.write_bytes(b"1")
    write_whole(tmp_path / "b", b"1")
    write_together(tmp_path, {"c": b"1"})
    assert done == ["content", "name"] * 3


LEFT_S = LEFT_NS / 1e9


@pytest.fixture
def gone():
    """The number of a process that has ended."""
    child = subprocess.Popen(["true"])
    child.wait()
    return child.pid


def aged(path, age_s):
    os.utime(path, ns=(time.time_ns() - int(age_s * 1e9),) * 2)


def left_by(folder, pid, age_s, name="zero.json"):
    path = folder / f".{name}.{pid}.tmp"
    path.write_text("half")
    aged(path, age_s)
    return path


def write_by_name(path):
    with whole(path) as new:
        new.write_bytes(b"whole")


WRITERS = [
    lambda path: write_whole(path, b"whole"),
    lambda path: write_together(path.parent, {path.name: b"whole"}),
    write_by_name,
]


@pytest.mark.parametrize("write", WRITERS)
def test_what_a_power_cut_left_is_removed_by_the_next_that_writes_the_same_file(tmp_path, gone, write):
    left_by(tmp_path, gone, 2 * LEFT_S)
    left_by(tmp_path, 10**30, 2 * LEFT_S)
    write(tmp_path / "zero.json")
    assert [path.name for path in tmp_path.iterdir()] == ["zero.json"]


@pytest.mark.parametrize("write", WRITERS)
def test_what_may_be_somebodys_is_left(tmp_path, gone, write):
    kept = [
        left_by(tmp_path, os.getppid(), 2 * LEFT_S),  # its process lives
        left_by(tmp_path, 1, 2 * LEFT_S),  # and is another user's
        left_by(tmp_path, gone, LEFT_S - 60.0),  # young: of another machine, perhaps
        left_by(tmp_path, gone + 1, -LEFT_S),  # of a clock that was set back since
        left_by(tmp_path, gone, 2 * LEFT_S, "other.json"),
        left_by(tmp_path, "x", 2 * LEFT_S),
        left_by(tmp_path, "-1", 2 * LEFT_S),  # every process, to kill(2)
        left_by(tmp_path, "\u0663", 2 * LEFT_S),
        left_by(tmp_path, "", 2 * LEFT_S),
    ]
    aside = tmp_path / "aside"
    aside.write_text("theirs")
    aged(aside, 2 * LEFT_S)
    link = tmp_path / ".zero.json.999999999.tmp"
    link.symlink_to(aside)
    folder = tmp_path / ".zero.json.999999998.tmp"
    folder.mkdir()
    aged(folder, 2 * LEFT_S)
    before = {path.name for path in tmp_path.iterdir()}
    write(tmp_path / "zero.json")
    assert {path.name for path in tmp_path.iterdir()} == before | {"zero.json"}
    assert all(path.read_text() == "half" for path in kept)


def test_a_leftover_that_cannot_be_removed_hinders_no_writing(tmp_path, gone, monkeypatch):
    part = left_by(tmp_path, gone, 2 * LEFT_S)

    def refused(self, *, missing_ok=False):
        if self == part:
            raise PermissionError(13, "Permission denied")
        return unlink(self, missing_ok=missing_ok)

    unlink = Path.unlink
    monkeypatch.setattr(Path, "unlink", refused)
    write_whole(tmp_path / "zero.json", b"whole")
    assert (tmp_path / "zero.json").read_bytes() == b"whole"
