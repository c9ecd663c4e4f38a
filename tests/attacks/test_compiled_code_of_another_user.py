"""Whoever can put a file where compiled code is kept would have it executed by the next user, on the rig."""

import os
import pickle  # noqa: TID251 - what an attacker would write
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.compiled
ROOT = Path(__file__).parents[2]
MODULE = """
import sys
sys.path.insert(0, {root!r})
from hw.jit import compiled

@compiled
def double(x):
    return 2.0 * x

print(double(21.0))
"""


class Bomb:
    """Unpickled, it leaves a mark."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return os.mkdir, (str(self.mark),)


def run(program, cache):
    env = {**os.environ, "RTCTL_CACHE_DIR": str(cache), "NUMBA_DISABLE_JIT": "0"}
    command = [sys.executable, str(program)]
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=250, check=False)
    assert done.stdout == "42.0\n", done.stderr
    return done.stderr


@pytest.fixture(scope="module")
def compiled_once(tmp_path_factory):
    folder = tmp_path_factory.mktemp("program")
    (folder / "doubled.py").write_text(MODULE.format(root=str(ROOT)))
    run(folder / "doubled.py", folder / "cache")
    return folder


@pytest.fixture
def program(compiled_once, tmp_path):
    shutil.copytree(compiled_once / "cache", tmp_path / "cache")
    return lambda: run(compiled_once / "doubled.py", tmp_path / "cache")


def kept(tmp_path):
    return [path for path in (tmp_path / "cache" / "compiled").rglob("*.nb?") if "double" in path.name]


def test_it_is_kept_where_nobody_else_can_look_or_write(tmp_path, program):
    compiled = tmp_path / "cache" / "compiled"
    assert {path.suffix for path in kept(tmp_path)} == {".nbi", ".nbc"}
    assert {stat.S_IMODE(path.stat().st_mode) for path in kept(tmp_path)} == {0o600}
    compiled.chmod(0o755)  # as earlier versions left it
    program()
    assert {stat.S_IMODE(path.stat().st_mode) for path in (compiled, *compiled.iterdir())} == {0o700}


def plant(path, mark):
    path.write_bytes(pickle.dumps(Bomb(mark)))
    if os.geteuid() == 0:
        os.chown(path, 12345, 12345)
    else:
        path.chmod(0o666)  # anybody may have written it


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_a_file_of_another_user_is_never_executed(tmp_path, program, suffix):
    mark = tmp_path / "executed"
    (path,) = (path for path in kept(tmp_path) if path.suffix == suffix)
    path.write_bytes(pickle.dumps(Bomb(mark)))
    plant(path, mark)
    program()
    assert not mark.exists()


@pytest.mark.parametrize("way", ["link", "owner"])
def test_a_folder_of_another_user_is_neither_used_nor_left_unsaid(tmp_path, program, way):
    compiled, mark = tmp_path / "cache" / "compiled", tmp_path / "executed"
    for path in kept(tmp_path):
        plant(path, mark)
    if way == "link":
        compiled.rename(tmp_path / "elsewhere")
        compiled.symlink_to(tmp_path / "elsewhere")
    elif os.geteuid() == 0:
        os.chown(compiled, 12345, 12345)
    else:
        pytest.skip("only root can give a folder away")
    assert "RTCTL_CACHE_DIR" in program()
    assert not mark.exists()
