"""The devices of the rig file: are they there, may this user open them, are their links set up."""

from __future__ import annotations

import json
import re
import socket
import subprocess
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rtctl.host.machine_line import Line, text
from rtctl.host.machine_ports import serial_port, usb_adapters, usb_device

Run = Callable[[Sequence[str]], str]
"""Runs a command and returns what it printed, empty when it failed."""

_ARPHRD_CAN = "280"  # ARPHRD_CAN (linux/if_arp.h)
_CAN_KEYS = ("channel", "interface", "can", "can_interface", "can_channel")
_CAN_NAME = re.compile(r"(?:v|vx|sl)?can[0-9]{1,3}")
_USB_ID = re.compile(r"[0-9A-Fa-f]{4}:[0-9A-Fa-f]{4}(?::.+)?")
_USB_NUMBER = re.compile(r"(?:0x)?[0-9A-Fa-f]{1,4}")


def run(command: Sequence[str]) -> str:
    """Run a command that changes nothing; its output, empty when it is missing or fails."""
    try:
        # 5 s: `ip` answers at once, and a machine that is being looked at may be in trouble
        done = subprocess.run(command, capture_output=True, text=True, timeout=5, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout if done.returncode == 0 else ""


def check(
    root: Path, devices: Sequence[tuple[str, Mapping[str, Any]]], ask: Run = run, real: Collection[str] = ()
) -> list[Line]:
    """Presence, permission and set-up of each device: (label, validated options) each; `real` ones have a
    label here.

    What a device needs is read off its options, wherever in them it stands: a path below `/dev`, a `port`
    with a path, a `host`, a table of `interface` and `channel`, the name of a CAN interface, a USB id as
    `usb = "0403:6014"` or as `vendor_id` and `product_id`. Any backend is looked at, third parties' too
    (docs/devices.md)."""
    out: list[Line] = []
    for label, options in devices:
        before = len(out)
        seen: set[str] = set()
        out += _wires(root, label, options, ask, seen)
        if len(out) == before and label in real:
            fix = "name in its options what it is wired to: port, host, bus or usb (docs/devices.md)"
            out.append(
                Line(label, "warn", "its options name no port, address, bus or USB device to look for", fix)
            )
        elif len(out) == before:
            out.append(Line(label, "ok", "nothing to be wired"))
    return out or usb_adapters(root)


def _wires(root: Path, label: str, table: Mapping[str, Any], ask: Run, seen: set[str]) -> Iterator[Line]:
    """Lines of all wires that a table of options, or a table inside it, names; each once."""
    if isinstance(table.get("channel"), str) and "interface" in table:
        if _is_new(f"{table['interface']} {table['channel']}", seen):
            yield from can_bus(root, label, table, ask)
        # `channel` beside `interface` is a bus, whatever else its table holds: to look on would name it twice
        return
    vendor, product = (_usb_number(table, *names) for names in (("vendor_id", "vid"), ("product_id", "pid")))
    if vendor and product and _is_new(f"{vendor}:{product}", seen):
        yield usb_device(root, label, f"{vendor}:{product}")
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _wires(root, label, value, ask, seen)
        for part in value if isinstance(value, list | tuple) else [value]:
            # a table itself was looked into by the line above; these are lists of tables
            if isinstance(part, Mapping) and part is not value:
                yield from _wires(root, label, part, ask, seen)
            elif isinstance(part, str) and part:
                yield from _wire(root, label, key, part, seen)


def _wire(root: Path, label: str, key: str, value: str, seen: set[str]) -> Iterator[Line]:
    """Lines of the wire that one text names, if it names one."""
    if value.startswith("/dev/") or (key == "port" and value.startswith("/")):
        if _is_new(value, seen):
            yield from serial_port(root, label, value)
    elif key == "host":
        if _is_new(value, seen):
            yield address(label, value)
    elif "usb" in key and _USB_ID.fullmatch(value):
        if _is_new(value, seen):
            yield usb_device(root, label, value)
    elif key in _CAN_KEYS and _CAN_NAME.fullmatch(value) and _is_new(value, seen):
        yield _can_there(root, label, value)


def _is_new(wire: str, seen: set[str]) -> bool:
    """Whether this wire has not been looked at for this device; notes that it has."""
    new = wire not in seen
    seen.add(wire)
    return new


def _usb_number(table: Mapping[str, Any], *names: str) -> str:
    """A vendor or product number, four hexadecimal digits; empty without one."""
    for name in names:
        value = table.get(name)
        # True is an int, and no product number
        if isinstance(value, int) and not isinstance(value, bool) and 0 < value < 1 << 16:
            return f"{value:04x}"
        if isinstance(value, str) and _USB_NUMBER.fullmatch(value):
            return value.lower().removeprefix("0x").zfill(4)
    return ""


def _can_there(root: Path, label: str, name: str) -> Line:
    """A CAN interface of which the options say no more than its name."""
    folder = root / "sys/class/net" / name
    if not folder.exists():
        fix = (
            f"plug the adapter in, or load its driver; then sudo ip link set {name} up type can bitrate "
            "1000000"
        )
        return Line(label, "fail", f"no CAN interface {name}{_others(root)}", fix)
    if not int(text(folder / "flags") or "0", 0) & 1:  # IFF_UP (linux/if.h)
        return Line(label, "fail", f"{name} is down", f"sudo ip link set {name} up type can bitrate 1000000")
    return Line(label, "ok", f"CAN interface {name} is up")


def _others(root: Path) -> str:
    """The CAN interfaces there are, for a message about one that is not."""
    folders = sorted((root / "sys/class/net").glob("*"))
    there = [folder.name for folder in folders if text(folder / "type") == _ARPHRD_CAN]
    return f"; there are {', '.join(there)}" if there else ""


def address(label: str, host: str) -> Line:
    """Whether an address can be reached at all: name, route. Nothing is sent."""
    try:
        # 9: the port `discard`; a datagram socket needs one to be connected
        family, _, _, _, where = socket.getaddrinfo(host, 9, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, socket.SOCK_DGRAM) as made:
            made.connect(where)  # of a datagram socket: looks up the route, and sends nothing
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
        yield Line(label, "fail", f"no CAN interface {channel}{_others(root)}", fix)
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
        f"sudo ip link set {channel} down; sudo ip link set {channel} type can bitrate "
        # restart-ms: without it a bus-off lasts until a person sets the interface up again
        f"{bus.get('bitrate')}{fd} restart-ms 100; sudo ip link set {channel} up"
    )


def _can_details(label: str, channel: str, bus: Mapping[str, Any], ask: Run, set_up: str) -> Line:
    try:
        # a list, also of one interface
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
    # None: a virtual interface, or an `ip` that does not tell
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
        # a node that is error-passive still talks: it runs, less well
        return Line(label, "warn", found, "check wiring and termination: 60 ohm between the lines, unpowered")
    return Line(label, "ok", found)
