"""The whole report."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hw import registry
from hw.interface import BackendError
from hw.member import Member
from rtctl.host import machine_kernel as machine
from rtctl.host import (
    machine_network,
    machine_ports,
    machine_rights,
    machine_software,
    machine_wakeup,
    machine_wiring,
)
from rtctl.host.machine_line import Line
from rtctl.rig_file.rig_tables import LoopTable
from rtctl.rt.core import choose


@dataclass(frozen=True)
class Report:
    """All lines, and the wake-ups where they were measured."""

    lines: tuple[Line, ...]
    wakeups: machine_wakeup.Wakeups | None = None

    @property
    def ok(self) -> bool:
        """True when no line fails."""
        return all(line.status != "fail" for line in self.lines)


def _own_findings(member: Member, options: Mapping[str, Any]) -> list[Line]:
    """What the kind of a device has to say of this machine itself."""
    try:
        return [Line(member.label, *one) for one in registry.examine(member.kind, options)]
    except BackendError as error:
        return [Line(member.label, "warn", str(error), f"tell whoever made the backend {member.kind}")]


def examine(
    config: str | None,
    seconds: float,
    *,
    root: Path = Path("/"),
    ask: machine_wiring.Run = machine_wiring.run,
    say: Callable[[Line], None] = lambda _line: None,
    measuring: Callable[[float], None] = lambda _seconds: None,
    install: str = machine_rights.INSTALL,
) -> Report:
    """Look at everything; nothing is changed, opened or armed.

    Parameters
    ----------
    config
        Rig file, or None for the machine alone.
    seconds
        Length of the wake-up measurement; 0 leaves it out.
    root
        Where the system's files are.
    ask
        Runs commands that only tell (`ip`).
    say, measuring
        Called with each line as it comes, and before the measurement.
    install
        The command that makes the rig a service on this machine."""
    lines: list[Line] = []

    def _add(more: list[Line]) -> None:
        lines.extend(more)
        for line in more:
            say(line)

    _add(machine_software.installed())
    loaded = None
    if config is not None:
        loaded, more = machine_software.rig_file(config)
        _add(more)
    # without a rig file, or with a wrong one, the machine is judged for the defaults
    loop = loaded.config.loop if loaded else LoopTable()
    if loaded is not None:
        _add(machine_software.model(loaded))
        members = loaded.members()
        kinds = [registry.lookup(member.kind) for member in members]
        wired = {
            member.label
            for member, info in zip(members, kinds, strict=True)
            # a kind that looks for itself, or has no wire, is not told that it names none
            if not (info.simulated or info.doctor)
        }
        # validated options, not those of the file: defaults name wires, too
        devices = list(zip(members, (loaded.options, *loaded.more_options), strict=True))
        _add(machine_wiring.check(root, [(member.label, options) for member, options in devices], ask, wired))
        for member, options in devices:
            _add(_own_findings(member, options))
        _add(list(machine_network.gateway(root, loaded.config.gateway.bind, loaded.config.gateway.port)))
    elif config is None:
        _add(machine_ports.usb_adapters(root))
    chosen = choose(loop.cpu, os.sched_getaffinity(0), root)
    _add(machine.check(root, chosen))
    _add([machine.early_look(root, loop.early_us, loop.rate_hz, len(os.sched_getaffinity(0)))])
    # by the rig's name: its unit may have drop-ins of its own
    _add(machine_rights.check(root, loaded.config.rig.name if loaded else "", loop.priority, install))
    found = None
    if seconds:
        measuring(seconds)
        found = machine_wakeup.measure(seconds, round(1e9 / loop.rate_hz), loop.priority, chosen.core)
        if found is None:
            again = "python -m rtctl.host.machine_wakeup 1 1000000 80 -1 shows why"
            _add([Line("wake-up", "warn", "could not be measured", again)])
        else:
            real = loaded is not None and not loaded.config.simulated
            _add(machine_wakeup.judge(found, chosen.core, real=real, required=loop.realtime == "require"))
    return Report(tuple(lines), found)
