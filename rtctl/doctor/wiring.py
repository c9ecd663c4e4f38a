"""The devices of the rig file: are they there, may this user open them, are their links set up."""

from __future__ import annotations

import grp
import json
import os
import socket
import stat
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rtctl.doctor.line import Line, text

Run = Callable[[Sequence[str]], str]
"""Runs a command and returns what it printed, empty when it failed."""

_ARPHRD_CAN = "280"


def run(command: Sequence[str]) -> str:
    """Run a command that changes nothing; its output, empty when it is missing or fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=5, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout if done.returncode == 0 else ""


def check(root: Path, devices: Sequence[tuple[str, Mapping[str, Any]]], ask: Run = run) -> list[Line]:
    """Presence, permission and set-up of each device: (label, validated options) each.

    What a device needs is read off its options: `port` names a serial port, `host` a network address,
    `bus` a CAN bus. Any backend that uses these names is looked at, third parties' too.
    """
    out: list[Line] = []
    for label, options in devices:
        before = len(out)
        port, host, bus = options.get("port"), options.get("host"), options.get("bus")
        if isinstance(port, str):
            out += serial_port(root, label, port)
        if isinstance(host, str):
            out.append(address(label, host))
        if isinstance(bus, Mapping):
            out += can_bus(root, label, bus, ask)
        if len(out) == before:
            out.append(Line(label, "ok", "nothing to be wired"))
    return out or usb_adapters(root)


def serial_port(root: Path, label: str, port: str) -> Iterator[Line]:
    """Presence and permission of a serial port, and the latency timer of its USB adapter."""
    path = root / port.lstrip("/")
    try:
        mode = path.stat()
    except OSError:
        there = sorted(p.name for p in (root / "dev/serial/by-id").glob("*"))
        listed = f"; there are {', '.join(there)}" if there else ""
        yield Line(
            label,
            "fail",
            f"no {port}{listed}",
            "plug it in and power it, or correct port (ls -l /dev/serial/by-id)",
        )
        return
    if not stat.S_ISCHR(mode.st_mode):
        yield Line(label, "fail", f"{port} is not a device", "correct port in the rig file")
        return
    if not os.access(path, os.R_OK | os.W_OK):
        group = _group(mode.st_gid)
        fix = f"sudo usermod -aG {group} $USER, then log in again"
        yield Line(label, "fail", f"{port} belongs to group {group}, this user may not use it", fix)
        return
    yield Line(label, "ok", f"{port} is there and may be used")
    name = path.resolve().name
    if (line := _latency(root, name)) is not None:
        yield line


def _group(gid: int) -> str:
    try:
        return grp.getgrgid(gid).gr_name
    except KeyError:
        return str(gid)


def _latency(root: Path, name: str) -> Line | None:
    found = text(root / "sys/bus/usb-serial/devices" / name / "latency_timer")
    if found is None:
        return None
    if found == "1":
        return Line(f"latency timer {name}", "ok", "1 ms")
    rule = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'
    fix = (
        f"echo 1 | sudo tee /sys/bus/usb-serial/devices/{name}/latency_timer; "
        f"lasting: echo '{rule}' | sudo tee /etc/udev/rules.d/99-rtctl-serial.rules"
    )
    return Line(f"latency timer {name}", "warn", f"{found} ms: samples wait that long in the adapter", fix)


def usb_adapters(root: Path) -> list[Line]:
    """Latency timers of every USB serial adapter there is: for a report without a rig file."""
    names = sorted(path.name for path in (root / "sys/bus/usb-serial/devices").glob("*"))
    return [line for name in names if (line := _latency(root, name)) is not None]


def address(label: str, host: str) -> Line:
    """Whether an address can be reached at all: name, route. Nothing is sent."""
    try:
        family, _, _, _, where = socket.getaddrinfo(host, 9, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, socket.SOCK_DGRAM) as made:
            made.connect(where)
            ours = made.getsockname()[0]
    except OSError as error:
        fix = f"check host in the rig file and the network: ip route get {host}"
        return Line(label, "fail", f"{host}: {error.strerror or error}", fix)
    return Line(label, "ok", f"{host} is reached from {ours}; rtctl probe tells whether it answers")


def can_bus(root: Path, label: str, bus: Mapping[str, Any], ask: Run) -> Iterator[Line]:
    """A CAN bus: a kernel interface with its bit rate and state, or the serial port of an adapter."""
    channel, interface = str(bus.get("channel", "")), bus.get("interface")
    if interface != "socketcan":
        if channel.startswith("/"):
            yield from serial_port(root, label, channel)
        else:
            yield Line(label, "ok", f"{interface} {channel}: rtctl probe tells whether it answers")
        return
    folder = root / "sys/class/net" / channel
    set_up = _set_up(channel, bus)
    if not folder.exists():
        fix = f"plug the adapter in, or load its driver; then {set_up}"
        yield Line(label, "fail", f"no CAN interface {channel}", fix)
        return
    if text(folder / "type") != _ARPHRD_CAN:
        yield Line(label, "fail", f"{channel} is no CAN interface", "correct bus.channel in the rig file")
        return
    flags = int(text(folder / "flags") or "0", 0)
    if not flags & 1:
        yield Line(label, "fail", f"{channel} is down", set_up)
        return
    yield _can_details(label, channel, bus, ask, set_up)


def _set_up(channel: str, bus: Mapping[str, Any]) -> str:
    fd = f" dbitrate {bus.get('data_bitrate')} fd on" if bus.get("fd") else ""
    return (
        f"sudo ip link set {channel} down; sudo ip link set {channel} type can bitrate {bus.get('bitrate')}{fd} "
        f"restart-ms 100; sudo ip link set {channel} up"
    )


def _can_details(label: str, channel: str, bus: Mapping[str, Any], ask: Run, set_up: str) -> Line:
    try:
        (link,) = json.loads(ask(["ip", "-details", "-json", "link", "show", channel]))
        info = link.get("linkinfo", {})
        data = info.get("info_data", {})
    except (ValueError, AttributeError):
        return Line(
            label, "warn", f"{channel} is up; its bit rate is unknown", "sudo apt-get install iproute2"
        )
    if info.get("info_kind") in ("vcan", "vxcan"):
        return Line(label, "ok", f"{channel} is up (virtual: no bit rate)")
    state, rate = data.get("state", "unknown"), data.get("bittiming", {}).get("bitrate")
    if rate is not None and rate != bus.get("bitrate"):
        return Line(
            label, "fail", f"{channel} runs at {rate} bit/s, the rig file says {bus.get('bitrate')}", set_up
        )
    data_rate = data.get("data_bittiming", {}).get("bitrate")
    if bus.get("fd") and data_rate != bus.get("data_bitrate"):
        shown = "no CAN FD" if data_rate is None else f"a data phase of {data_rate} bit/s"
        return Line(
            label, "fail", f"{channel} has {shown}, the rig file says {bus.get('data_bitrate')}", set_up
        )
    found = f"{channel} is up at {rate} bit/s, {state}"
    if state in ("BUS-OFF", "STOPPED", "SLEEPING"):
        return Line(
            label, "fail", found, f"check wiring and termination (60 ohm between the lines); then {set_up}"
        )
    if state != "ERROR-ACTIVE":
        return Line(label, "warn", found, "check wiring and termination: 60 ohm between the lines, unpowered")
    return Line(label, "ok", found)
