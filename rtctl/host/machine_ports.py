"""Serial ports and USB devices: there, permitted, held by nobody else, and without a slow latency timer."""

from __future__ import annotations

import getpass
import grp
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from hw.device_holders import holders, is_other_end
from hw.outside import real
from rtctl.host.machine_line import Line, is_rtctl, text

NOT_ROOT = "do not run rtctl as root instead"

MEDDLERS = {
    "ModemManager": "it takes every new port for a modem: sudo systemctl mask --now ModemManager",
    "brltty": "it takes USB adapters for Braille displays: sudo apt-get remove brltty",
    "gpsd": "it takes USB adapters for GPS receivers: sudo systemctl disable --now gpsd.socket",
}
"""Programs that open ports by themselves, and what keeps them from it."""


def serial_port(root: Path, label: str, port: str) -> Iterator[Line]:
    """Presence and permission of a port or other device file, who holds it, and its adapter's latency
    timer."""
    path = root / port.lstrip("/")
    try:
        found = path.stat()
    except PermissionError:
        yield Line(label, "fail", f"{port}: this user may not look there", f"ls -ld {Path(port).parent}")
        return
    except OSError:
        # by-id: these names stay when a port is plugged in elsewhere, ttyUSB0 does not
        there = sorted(p.name for p in (root / "dev/serial/by-id").glob("*"))
        listed = f"; there are {', '.join(there)}" if there else "; no serial device is plugged in"
        yield Line(
            label,
            "fail",
            f"no {port}{listed}",
            "plug it in and power it, or correct port (ls -l /dev/serial/by-id)",
        )
        return
    if not stat.S_ISCHR(found.st_mode):
        yield Line(label, "fail", f"{port} is not a device", "correct port in the rig file")
        return
    if not os.access(path, os.R_OK | os.W_OK):
        yield _forbidden(label, port, real(path).name, found)
    else:
        yield Line(label, "ok", f"{port} is there and may be used")
    yield from _held(root, label, port)
    if (line := latency(root, real(path).name)) is not None:
        yield line


def _forbidden(label: str, port: str, name: str, found: os.stat_result) -> Line:
    group = _group(found.st_gid)
    rights = stat.S_IRGRP | stat.S_IWGRP
    # nobody should be made a member of root's group for a port
    if found.st_gid == 0 or found.st_mode & rights != rights:
        rule = f'KERNEL=="{name}", GROUP="dialout", MODE="0660"'
        fix = (
            f"echo '{rule}' | sudo tee /etc/udev/rules.d/99-rtctl-port.rules && sudo udevadm control "
            "--reload && sudo udevadm trigger; sudo usermod -aG dialout $USER, then log in again; "
            f"{NOT_ROOT}"
        )
        return Line(label, "fail", f"{port} is for {group} only and no group may use it", fix)
    if _is_member(found.st_gid):
        fix = "log in again (newgrp for this shell alone): a session keeps the groups it began with"
        return Line(
            label, "fail", f"{port} belongs to group {group}, which this session has not got yet", fix
        )
    fix = f"sudo usermod -aG {group} $USER, then log in again; {NOT_ROOT}"
    return Line(label, "fail", f"{port} belongs to group {group}, this user may not use it", fix)


def _is_member(gid: int) -> bool:
    """Whether the system has this user in the group, whatever this session has."""
    try:
        return getpass.getuser() in grp.getgrgid(gid).gr_mem
    except (KeyError, OSError):
        return False


def _group(gid: int) -> str:
    try:
        return grp.getgrgid(gid).gr_name
    except KeyError:
        return str(gid)


def _held(root: Path, label: str, port: str) -> Iterator[Line]:
    for pid, command in holders(port, root):
        if is_other_end(pid, port, root):  # it keeps our end open, too: closing it would be a hang-up
            yield Line(label, "ok", f"{port} is no wire: {command} (pid {pid}) plays the device")
            continue
        who = f"{port} is held by {command} (pid {pid})"
        # no failure: whoever asks the doctor beside a running rig meets its own daemon
        if is_rtctl(root, pid):
            fix = (
                "nothing, if that is this rig, running; else end it: Ctrl-C, or sudo systemctl stop "
                "rtctl@NAME"
            )
            yield Line(label, "warn", who, fix)
            continue
        remedy = next((text for name, text in MEDDLERS.items() if name in command), None)
        yield Line(label, "fail", who, remedy or f"end it: kill {pid}; or name another port in the rig file")


def usb_device(root: Path, label: str, wanted: str) -> Line:
    """Presence and permission of a USB device: `vendor:product`, or with its serial number behind a second
    colon."""
    there: dict[str, Path] = {}
    for folder in sorted((root / "sys/bus/usb/devices").glob("*")):
        vendor, product = text(folder / "idVendor"), text(folder / "idProduct")
        if vendor and product:
            number = text(folder / "serial") or ""
            # as lsusb writes them; an adapter without a serial number has none in its name
            there[f"{vendor}:{product}:{number}".lower().rstrip(":")] = folder
    asked = wanted.lower()
    found = next(
        (folder for name, folder in there.items() if name == asked or name.startswith(asked + ":")), None
    )
    if found is None:
        listed = f"; there are {', '.join(sorted(there))}" if there else ""
        return Line(
            label,
            "fail",
            f"no USB device {wanted}{listed}",
            "plug it in and power it (lsusb lists what is there)",
        )
    node = "/dev/bus/usb/{:03d}/{:03d}".format(
        *(int(text(found / name) or "0") for name in ("busnum", "devnum"))
    )
    if (root / node.lstrip("/")).exists() and not os.access(root / node.lstrip("/"), os.R_OK | os.W_OK):
        # without the number: udev's rule is for any adapter of the kind that is plugged in
        vendor, product = asked.split(":")[:2]
        rule = (
            f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{vendor}", ATTR{{idProduct}}=="{product}", '
            'GROUP="dialout", MODE="0660"'
        )
        fix = (
            f"echo '{rule}' | sudo tee /etc/udev/rules.d/99-rtctl-usb.rules, plug it in again; sudo usermod "
            f"-aG dialout $USER; {NOT_ROOT}"
        )
        return Line(label, "fail", f"USB device {wanted} ({node}): this user may not use it", fix)
    return Line(label, "ok", f"USB device {wanted} is there")


def latency(root: Path, name: str) -> Line | None:
    """The latency timer of the USB adapter behind a port; None for other ports."""
    found = text(root / "sys/bus/usb-serial/devices" / name / "latency_timer")
    if found is None:
        return None
    if found == "1":  # ftdi_sio begins with 16 ms: a reply that fills no USB packet waits for this timer
        return Line(f"latency timer {name}", "ok", "1 ms")
    rule = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'
    fix = (
        f"echo 1 | sudo tee /sys/bus/usb-serial/devices/{name}/latency_timer; "
        f"lasting: rtctl service install, or echo '{rule}' | sudo tee /etc/udev/rules.d/99-rtctl-serial.rules"
    )
    return Line(f"latency timer {name}", "warn", f"{found} ms: samples wait that long in the adapter", fix)


def usb_adapters(root: Path) -> list[Line]:
    """Latency timers of every USB serial adapter there is: for a report without a rig file."""
    names = sorted(path.name for path in (root / "sys/bus/usb-serial/devices").glob("*"))
    return [line for name in names if (line := latency(root, name)) is not None]
