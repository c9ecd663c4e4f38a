"""Ports held by others, and by whom they may be used: read from made-up trees, and once from this machine."""

import getpass
import os
import stat
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from made_up_tree import look, process, put

from hw.device_holders import holders
from rtctl.host import machine_ports


@pytest.fixture
def port(tmp_path):
    """A character device: /dev/null under the name of a USB adapter."""
    (tmp_path / "dev").mkdir()
    (tmp_path / "dev/ttyUSB0").symlink_to("/dev/null")
    return tmp_path


@pytest.mark.parametrize(
    ("command", "status", "fix"),
    [
        ("/usr/bin/minicom -D /dev/ttyUSB0", "fail", "kill 4242"),
        ("/usr/sbin/ModemManager", "fail", "systemctl mask --now ModemManager"),
        ("/usr/bin/brltty -b", "fail", "apt-get remove brltty"),
        ("python -m rtctl run rig.toml", "warn", "if that is this rig, running"),
        ("python -m rtctl.rt 4 77", "warn", "if that is this rig, running"),
        ("/opt/rtctl/.venv/bin/rtctl run rig.toml", "warn", "if that is this rig, running"),
        ("/root/rtctl/.venv/bin/python logger.py", "fail", "kill 4242"),
    ],
)
def test_a_port_that_another_process_holds_names_it(port, command, status, fix):
    process(port, 4242, command, holds=os.path.realpath("/dev/null"))
    process(port, 4243, "bash")
    first, held = look(port, {"port": "/dev/ttyUSB0"})
    assert first.status == "ok"
    assert (held.status, f"{command} (pid 4242)" in held.found) == (status, True)
    assert fix in held.fix


def test_a_lock_or_a_lock_file_of_another_users_process_tells_who_it_is(port):
    found = (port / "dev/ttyUSB0").stat()
    where = f"{os.major(found.st_dev):02x}:{os.minor(found.st_dev):02x}:{found.st_ino}"
    put(
        port,
        "proc/locks",
        f"1: POSIX ADVISORY WRITE 7 00:01:1 0 EOF\n2: FLOCK ADVISORY WRITE 4242 {where} 0 EOF",
    )
    put(port, "proc/4242/comm", "screen")
    put(port, "proc/77/comm", "picocom")
    put(port, "run/lock/LCK..null", "        77 picocom")
    put(port, "var/lock/LCK..null", "78")
    lines = look(port, {"port": "/dev/ttyUSB0"})
    assert [line.status for line in lines] == ["ok", "fail", "fail"]
    assert "picocom (pid 77)" in lines[1].found
    assert "screen (pid 4242)" in lines[2].found


def test_a_port_held_by_a_real_process_is_found_on_this_machine(tmp_path):
    master, slave = os.openpty()
    path = os.ttyname(slave)
    program = f"import time; held = open({path!r}, 'rb', 0); print('open', flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as child:
        assert child.stdout.readline() == b"open\n"
        found = holders(path)
        child.kill()
    os.close(master)
    os.close(slave)
    assert [pid for pid, _ in found] == [child.pid]
    assert "python" in found[0][1]


@pytest.mark.parametrize("plays", [True, False])
def test_who_plays_the_device_of_a_pseudo_terminal_is_not_to_be_ended(tmp_path, plays):
    """As the simulators: both ends open, the host's under a link."""
    master, slave = (-1, -1) if plays else os.openpty()
    ends = "os.openpty()" if plays else f"(0, os.open({os.ttyname(slave)!r}, os.O_RDWR | os.O_NOCTTY))"
    program = f"import os, time; ends = {ends}; print(os.ttyname(ends[1]), flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as child:
        link = tmp_path / "board"
        link.symlink_to(child.stdout.readline().strip())
        first, held = machine_ports.serial_port(Path("/"), "device", str(link))
        child.kill()
    if not plays:
        os.close(master)
        os.close(slave)
    assert (first.status, held.status) == ("ok", "ok" if plays else "fail")
    assert f"(pid {child.pid})" in held.found
    assert ("plays the device" in held.found, held.fix == "") == (plays, plays)


def test_a_port_of_no_group_gets_a_rule_and_not_membership_of_roots_group(port, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    (line,) = look(port, {"port": "/dev/ttyUSB0"})
    assert "usermod -aG root" not in line.fix
    assert 'GROUP="dialout"' in line.fix
    assert "do not run rtctl as root" in line.fix


@pytest.mark.parametrize(("member", "words"), [(False, "usermod -aG dialout"), (True, "log in again")])
def test_a_member_of_the_group_is_told_to_log_in_again(port, monkeypatch, member, words):
    monkeypatch.setattr(os, "access", lambda *_: False)
    me = getpass.getuser()
    group = SimpleNamespace(gr_name="dialout", gr_mem=[me] if member else [])
    monkeypatch.setattr("grp.getgrgid", lambda _gid: group)
    known = (port / "dev/ttyUSB0").stat()
    shown = SimpleNamespace(st_mode=stat.S_IFCHR | 0o660, st_gid=20, st_dev=known.st_dev, st_ino=known.st_ino)
    line = machine_ports._forbidden("drive", "/dev/ttyUSB0", "ttyUSB0", shown)
    assert words in line.fix
    assert ("usermod" in line.fix) != member
