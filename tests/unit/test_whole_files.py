"""Files that belong together are written together or not at all."""

import os
import resource
from contextlib import contextmanager
from pathlib import Path

import pytest

from rtctl import pictures
from rtctl.errors import DataError
from rtctl.whole_files import whole, write_together, write_whole


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
