"""The small files in a rig's state folder: whole or as they were, of these devices or of none."""

import errno
import math
import os

import numpy as np
import pytest

from rtctl import state_file
from rtctl.recording import state_folder
from rtctl.wire.endpoints import kept_alone


@pytest.mark.parametrize("name", ["a.json.new", ".a.json.{pid}.tmp", "a.json"])
def test_nothing_is_written_where_a_link_in_the_folder_leads(tmp_path, name):
    victim, file = tmp_path / "victim", tmp_path / "state" / "a.json"
    victim.write_text("precious")
    file.parent.mkdir()
    (file.parent / name.format(pid=os.getpid())).symlink_to(victim)
    state_file.write(file, "ab", {"joint": 1})
    assert victim.read_text() == "precious"
    assert state_file.read(file, "ab", 1000) == {"joint": 1}


def test_what_was_kept_comes_back_of_the_same_devices_only(tmp_path):
    file = tmp_path / "state" / "a.json"
    state_file.write(file, "ab", {"joint": {"factor": np.float64(0.9), "sums": np.array([1.0, 2.0])}})
    assert state_file.read(file, "ab", 1000) == {"joint": {"factor": 0.9, "sums": [1.0, 2.0]}}
    assert state_file.read(file, "cd", 1000) == {}
    assert state_file.read(file, "ab", 10) == {}


@pytest.mark.parametrize("number", [math.nan, math.inf, np.float64("nan"), np.array([1.0, math.nan])])
def test_a_number_that_is_none_is_refused_and_the_file_is_as_it_was(tmp_path, number):
    file = tmp_path / "a.json"
    state_file.write(file, "ab", {"joint": {"factor": 0.9}})
    with pytest.raises(ValueError, match="not JSON compliant"):
        state_file.write(file, "ab", {"joint": {"factor": number}})
    assert state_file.read(file, "ab", 1000) == {"joint": {"factor": 0.9}}


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"devices_sha256": "ab"}', '{"devices_sha256": "ab", "axes": 1}']
)
def test_a_damaged_file_says_nothing(tmp_path, text):
    file = tmp_path / "a.json"
    file.write_text(text)
    assert state_file.read(file, "ab", 1000) == {}


def test_the_services_state_that_is_not_for_this_user_is_not_looked_at(tmp_path, monkeypatch):
    class Closed(type(tmp_path)):
        def is_dir(self):
            raise PermissionError(errno.EACCES, "Permission denied", str(self))

    monkeypatch.setenv("RTCTL_STATE_DIR", str(tmp_path / "own"))
    monkeypatch.setattr(state_folder, "SYSTEM_STATE", Closed(tmp_path / "service"))
    assert state_folder.written_folder("mock") == tmp_path / "own" / "mock"


def test_the_folder_of_a_rig_is_not_for_everybody_whoever_makes_it(tmp_path):
    before = os.umask(0)
    try:
        with kept_alone("rig", tmp_path / "rig"):
            pass
        state_file.write(tmp_path / "other" / "a.json", "ab", {})
    finally:
        os.umask(before)
    assert [(tmp_path / name).stat().st_mode & 0o777 for name in ("rig", "other")] == [0o750, 0o750]
