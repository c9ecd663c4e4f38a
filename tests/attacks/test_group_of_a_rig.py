"""[gateway] group: its members reach the rig by its sockets, other users do not. Two users, so as root."""

import grp
import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from besieged import Daemon
from patience import PATIENCE_S

from rtctl.errors import ConfigError
from rtctl.wire.endpoints import RuntimeDirectory
from rtctl.wire.unix_group import group_id

ROOT = Path(__file__).parents[2]
STRANGER = 12345
VISITOR = """
import os, sys
sys.path.insert(0, sys.argv[1])
from rtctl.client import RigClient
from rtctl.errors import RtctlError
os.setgroups([int(one) for one in sys.argv[5:]])
os.setgid(int(sys.argv[3]))
os.setuid(int(sys.argv[3]))
try:
    with RigClient("mock", runtime_dir=sys.argv[2], timeout_s=float(sys.argv[4])) as rig:
        rig.stop()
        with rig.states() as states:
            print("stopped, role", rig.hello()["role"], next(iter(states)).tick >= 0)
except (RtctlError, OSError) as error:
    print(type(error).__name__)
"""


def visit(folder, patience_s, *groups):
    """What another user, of these groups, gets out of the rig; a reply is waited for for `patience_s`."""
    order = str(ROOT), str(folder), str(STRANGER), str(patience_s), *map(str, groups)
    command = [sys.executable, "-c", VISITOR, *order]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=2 * PATIENCE_S, check=True
    ).stdout.strip()


def some_group():
    """Of this machine, and none of this process."""
    return next(one for one in grp.getgrall() if one.gr_gid not in {os.getegid(), *os.getgroups()})


@pytest.mark.compiled
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be two users")
def test_a_member_of_the_group_may_stop_the_rig_and_nobody_else(tmp_path):
    group = some_group()
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        Path(folder).chmod(0o755)  # as /run/rtctl
        with Daemon(folder, f'group = "{group.gr_name}"\n') as daemon:
            assert visit(folder, PATIENCE_S, group.gr_gid) == "stopped, role operator True"
            assert visit(folder, 3.0) in ("NoReplyError", "ConfigError")
            shown = {path.name: path.lstat() for path in (daemon.folder / "mock").iterdir()}
            for name in ("command", "targets", "telemetry"):
                assert (stat.S_IMODE(shown[name].st_mode), shown[name].st_gid) == (0o660, group.gr_gid)
            assert stat.S_IMODE(shown["lock"].st_mode) == 0o600
            assert stat.S_IMODE(Path(folder, "keys").stat().st_mode) & 0o077 == 0
        Path(folder, "mock").chmod(0o750)
        RuntimeDirectory.acquire("mock", folder).release()  # a daemon without the group takes it back
        assert stat.S_IMODE(Path(folder, "mock").stat().st_mode) == 0o700


def test_a_group_that_is_none_is_refused_with_the_remedy():
    with pytest.raises(
        ConfigError, match=r"gateway.group 'no-such-group': there is no such group; make it \(sudo groupadd"
    ):
        group_id("no-such-group")
    assert group_id("") is None


def test_a_group_that_the_daemon_is_not_in_is_refused_with_the_remedy(monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: STRANGER)
    with pytest.raises(
        ConfigError, match="this process is not in that group; in a unit: SupplementaryGroups="
    ):
        group_id(some_group().gr_name)
