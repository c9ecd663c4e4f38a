"""Where a user's state, cache and sockets are, whatever the environment says."""

from pathlib import Path

import pytest

from hw import outside
from hw.jit import cache_root
from rtctl.recording.state_folder import state_root
from rtctl.wire.protocol import runtime_root


@pytest.mark.parametrize("where", [state_root, cache_root])
def test_a_user_without_a_home_has_folders_all_the_same(where, monkeypatch):
    for name in ("RTCTL_STATE_DIR", "STATE_DIRECTORY", "XDG_STATE_HOME", "HOME",
                 "RTCTL_CACHE_DIR", "CACHE_DIRECTORY", "XDG_CACHE_HOME"):  # fmt: skip
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(outside.pwd, "getpwuid", {}.__getitem__)  # as where nobody knows the user
    assert where().is_absolute()
    assert where().name == "rtctl"


@pytest.mark.parametrize("where", [state_root, cache_root, runtime_root])
@pytest.mark.parametrize("told", ["", "here"])
def test_a_folder_that_depends_on_the_working_directory_is_none(where, told, monkeypatch, tmp_path):
    for name in ("RTCTL_STATE_DIR", "STATE_DIRECTORY", "RTCTL_CACHE_DIR", "CACHE_DIRECTORY",
                 "RTCTL_RUNTIME_DIR", "RUNTIME_DIRECTORY"):  # fmt: skip
        monkeypatch.delenv(name, raising=False)
    for name in ("HOME", "XDG_STATE_HOME", "XDG_CACHE_HOME", "XDG_RUNTIME_DIR"):
        monkeypatch.setenv(name, told)
    before = where()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path)
    assert where() == before
    assert where().is_absolute()
    assert where() != Path("/.local/state/rtctl")
