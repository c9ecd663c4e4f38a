import errno
import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
import zmq

from rtctl.errors import BusyError, ConfigError
from rtctl.wire import endpoints, protocol
from rtctl.wire.endpoints import RuntimeDirectory, kept_alone, private_umask
from rtctl.wire.protocol import endpoints_in, rig_directory, running_rigs, runtime_root

HOLD = """
import sys
from rtctl.wire.endpoints import RuntimeDirectory
held = RuntimeDirectory.acquire("mock", sys.argv[1])
print("held", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def root():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        yield Path(folder)


def test_the_folder_is_private_and_says_where_to_connect(root):
    with RuntimeDirectory.acquire("mock", root / "deeper") as runtime:
        assert stat.S_IMODE(runtime.path.stat().st_mode) == 0o700
        assert runtime.endpoints == endpoints_in(root / "deeper" / "mock")
        assert any(runtime.endpoints.command in line for line in runtime.describe())


def test_a_second_daemon_is_refused_and_told_who_holds_the_rig(root):
    with RuntimeDirectory.acquire("mock", root):
        with pytest.raises(BusyError, match=f"process {os.getpid()}"):
            RuntimeDirectory.acquire("mock", root)
        RuntimeDirectory.acquire("other", root).release()
    RuntimeDirectory.acquire("mock", root).release()


def test_a_second_daemon_of_a_name_is_kept_off_what_the_first_knows_of_its_devices(root):
    state = root / "state" / "mock"
    with kept_alone("mock", state):
        with (
            pytest.raises(BusyError, match=f"'mock' is already run by process {os.getpid()} .*another name"),
            kept_alone("mock", state),
        ):
            pass
        with kept_alone("other", root / "state" / "other"):
            pass
    with kept_alone("mock", state):
        pass


def test_where_nothing_can_be_written_nothing_is_kept_and_the_rig_runs(root):
    (root / "state").write_text("in its way")
    for _ in range(2):
        with kept_alone("mock", root / "state" / "mock"), kept_alone("mock", root / "state" / "mock"):
            pass


@pytest.mark.parametrize("how", ["removed", "another", "emptied"])
def test_a_folder_that_went_while_the_daemon_runs_is_noticed(root, how):
    with RuntimeDirectory.acquire("mock", root) as runtime:
        assert runtime.lost() == ""
        if how == "emptied":
            (runtime.path / "lock").unlink()
        else:
            runtime.path.rename(root / "aside")
        if how == "another":
            RuntimeDirectory.acquire("mock", root).release()
        assert f"{runtime.path}/lock: " in runtime.lost()


def test_a_full_disk_is_told_with_the_folder(root, monkeypatch):
    def full(*_arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))  # of a descriptor: without a name

    monkeypatch.setattr(os, "pwrite", full)
    with pytest.raises(ConfigError, match=f"^{root}/mock: cannot use it .*No space left"):
        RuntimeDirectory.acquire("mock", root)


def test_a_killed_daemon_leaves_nothing_in_the_way(root):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(root)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "held\n"
    assert running_rigs(root) == ["mock"]
    with pytest.raises(BusyError, match=f"process {process.pid}"):
        RuntimeDirectory.acquire("mock", root)
    process.kill()
    process.communicate()
    assert running_rigs(root) == []
    RuntimeDirectory.acquire("mock", root).release()


def test_a_stale_socket_is_no_obstacle_and_sockets_are_private(root):
    with RuntimeDirectory.acquire("mock", root) as runtime:
        path = runtime.path / "command"
        path.touch()
        context = zmq.Context()
        socket = context.socket(zmq.ROUTER)
        with private_umask():
            socket.bind(runtime.endpoints.command)
        assert path.is_socket()
        assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0
        socket.close(linger=0)
        context.term()


def test_a_folder_open_to_others_is_refused_with_the_remedy(root):
    (root / "mock").mkdir(mode=0o755)
    with pytest.raises(ConfigError, match="chmod go-rwx"):
        RuntimeDirectory.acquire("mock", root)


def test_a_parent_that_others_may_write_is_refused_unless_sticky(root):
    root.chmod(0o777)
    with pytest.raises(ConfigError, match="0777"):
        RuntimeDirectory.acquire("mock", root)
    root.chmod(0o1777)
    RuntimeDirectory.acquire("mock", root).release()


def test_a_link_is_refused(root):
    (root / "elsewhere").mkdir(mode=0o700)
    (root / "mock").symlink_to(root / "elsewhere")
    with pytest.raises(ConfigError, match="not a link"):
        RuntimeDirectory.acquire("mock", root)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_a_folder_of_somebody_else_is_refused(root):
    (root / "mock").mkdir(mode=0o700)
    os.chown(root / "mock", 12345, 12345)
    with pytest.raises(ConfigError, match="belongs to user 12345"):
        RuntimeDirectory.acquire("mock", root)


def test_a_file_in_the_way_is_a_named_error(root):
    (root / "file").touch()
    with pytest.raises(ConfigError, match=r"RTCTL_RUNTIME_DIR|not a link or a file"):
        RuntimeDirectory.acquire("mock", root / "file")


def test_a_path_too_long_for_a_socket_is_refused_before_anything_is_made(root):
    deep = root / ("d" * 100)
    with pytest.raises(ConfigError, match="107"):
        RuntimeDirectory.acquire("mock", deep)
    assert not deep.exists()


@pytest.mark.parametrize("name", ["", "../mock", "a/b", "1st", "x" * 33, "a b"])
def test_names_that_could_leave_the_folder_are_refused(root, name):
    with pytest.raises(ConfigError, match="rig name"):
        rig_directory(name, root)


def test_the_root_follows_the_environment_in_order(root, monkeypatch):
    for name in ("RTCTL_RUNTIME_DIR", "RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"):
        monkeypatch.delenv(name, raising=False)
    assert runtime_root().name == f"rtctl-{os.geteuid()}"
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(root))
    assert runtime_root() == root / "rtctl"
    monkeypatch.setenv("RUNTIME_DIRECTORY", "/run/one/rig:/run/two")
    assert runtime_root() == Path("/run/one")
    monkeypatch.setenv("RTCTL_RUNTIME_DIR", "/run/mine")
    assert runtime_root() == Path("/run/mine")


def test_a_client_finds_the_service_where_this_user_runs_no_such_rig(root, monkeypatch):
    service = root / "service"
    (service / "mock").mkdir(parents=True)
    monkeypatch.setenv("RTCTL_RUNTIME_DIR", str(root / "own"))
    monkeypatch.setattr(protocol, "SERVICE_ROOT", service)
    assert protocol.client_directory("mock") == service / "mock"
    assert protocol.client_directory("other") == root / "own" / "other"
    assert protocol.client_directory("mock", root) == root / "mock"
    (root / "own" / "mock").mkdir(parents=True)
    assert protocol.client_directory("mock") == root / "own" / "mock"
    for folder in (service, root / "own"):
        (folder / "mock" / "lock").write_text(f"{os.getpid()}\n")
    assert protocol.running_rigs() == ["mock", "mock"]


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to be another user")
def test_a_member_of_its_group_finds_a_rig_whose_lock_only_its_user_reads(tmp_path_factory):
    root = tmp_path_factory.mktemp("run")
    for folder in (root, *root.parents[:-1]):
        folder.chmod(folder.stat().st_mode | 0o055)
    folder, user, group = root / "mock", 54321, 54322
    folder.mkdir()
    (folder / "lock").write_text(f"{os.getpid()}\n")
    for path, mode in ((folder / "lock", 0o600), (folder, 0o750)):
        os.chown(path, user, group)
        path.chmod(mode)
    code = f"""
import os
from pathlib import Path
from rtctl.wire.protocol import running_rigs
os.setgroups([{group}] * GROUPED)
os.setgid(54323)
os.setuid(54323)
print(running_rigs(Path({str(root)!r})))
"""
    for grouped, found in ((1, "['mock']"), (0, "[]")):
        text = code.replace("GROUPED", str(grouped))
        shown = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
        assert shown.stdout.strip() == found


ORPHAN = """
import os, sys, time
from rtctl.wire.endpoints import RuntimeDirectory
held = RuntimeDirectory.acquire("mock", sys.argv[1])
order_read, order_write = os.pipe()
if os.fork() == 0:
    os.close(order_write)
    print("held", os.getpid(), flush=True)
    sys.stdin.readline()
    os._exit(0)
held.note_holder(1)
os._exit(0)
"""


def test_the_loop_of_a_host_that_died_holds_the_rig_until_it_has_ended(root, monkeypatch):
    """It ramps its torque down: a new daemon waits for it, and is refused when it does not end."""
    process = subprocess.Popen(
        [sys.executable, "-c", ORPHAN, str(root)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline().startswith("held")
    process.wait()
    monkeypatch.setattr(endpoints, "ORPHAN_S", 0.05)
    with pytest.raises(BusyError, match="process 1 "):
        RuntimeDirectory.acquire("mock", root)
    monkeypatch.setattr(endpoints, "ORPHAN_S", 30.0)
    process.stdin.write("end\n")
    process.stdin.flush()
    RuntimeDirectory.acquire("mock", root).release()
    process.communicate()
