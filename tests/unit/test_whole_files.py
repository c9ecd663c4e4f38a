"""Files that belong together are written together or not at all."""

from pathlib import Path

import pytest

from rtctl.errors import DataError
from rtctl.whole_files import write_together


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
