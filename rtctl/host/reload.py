"""SIGHUP: what of a changed rig file takes effect without a restart, and what does not.

Only what a client could change too is taken over (environments are commands, not parameters); limits, plant,
coupling, models and devices are proved and opened at the start, and stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from rtctl.check import law_plan as planning
from rtctl.control.vocabulary import State
from rtctl.errors import RtctlError
from rtctl.rig_file.config import Config, LoadedConfig, load

if TYPE_CHECKING:
    from rtctl.host.supervisor import Host

AT_REST = (State.INIT, State.IDLE, State.FAULT, State.ESTOP)


@dataclass
class Changes:
    """Keys of the rig file that differ from what runs."""

    taken: list[str] = field(default_factory=list)
    restart: list[str] = field(default_factory=list)

    def lines(self) -> list[str]:
        """For the journal."""
        if not self.taken and not self.restart:
            return ["reload: nothing has changed"]
        out = [f"reload: {key} is in force" for key in self.taken]
        return out + [f"reload: {key} needs a restart; the old value stays" for key in self.restart]


def compare(running: Config, last: Config, read: Config) -> Changes:
    """Sort the keys that differ into those that may be taken over and those that need a restart.

    The first have been those of `last`, the file as it was read last, since then; the others are those that
    the daemon was started with. Where the axes are others, an environment may be meant for another joint, and
    none is taken over."""
    changes = Changes()
    started, before, after = (_flat(one.model_dump()) for one in (running, last, read))
    same_axes = _axes(running) == _axes(read)
    for key in sorted({*started, *before, *after}):
        reloadable = same_axes and ".environment." in key
        if (before if reloadable else started).get(key) != after.get(key):
            (changes.taken if reloadable else changes.restart).append(key)
    return changes


def refused(state: int) -> str:
    """Why nothing is taken over now; empty when it may be."""
    present = State(state)
    return "" if present in AT_REST else f"state {present.name}: stop the rig first, then reload"


def reload(host: Host) -> None:
    """Read the rig file again, take over what may be, and tell the journal about the rest.

    A rig file that is wrong changes nothing: the running one stays in force, and the journal names the keys.
    """
    host.notifier.reloading()
    row = host.reader.latest()
    why = refused(int(row["state"][0])) if row is not None else ""
    if why:
        host.announce(f"reload: refused: {why}")
    else:
        _take_over(host)
    host.notifier.ready()  # also after a refusal: the manager waits for it (sd_notify(3))


def _take_over(host: Host) -> None:
    try:
        read = load(host.loaded.path, host.loaded.script)
        fresh = planning.build(read)  # proved and planned whole before anything is taken over
    except RtctlError as error:
        for line in (f"reload: refused: {error}", *getattr(error, "faults", ())):
            host.announce(line)
        return
    changes = compare(host.loaded.config, host.read_last, read.config)
    changes.restart += models_replaced(host.plan.model_files, fresh.model_files, changes.restart)
    changes.restart += files_changed(host.loaded, read, changes.restart)
    if changes.taken:
        environment_fields(host.writer.command, fresh.command, axes_of(changes.taken))
        host.writer.send()
        # else the next reload would compare with a file of long ago, and find nothing new in one put back
        host.read_last = read.config
    for line in changes.lines():
        host.announce(line)


def models_replaced(running: Sequence[bytes], read: Sequence[bytes], told: Sequence[str]) -> list[str]:
    """Keys of the friction models whose files have another content than what runs, but for those `told`
    already: a model is learned anew under the name that it had."""
    pairs = zip(running, read, strict=False)  # axes that came or went are told by their keys
    keys = [f"axis[{a}].friction.model" for a, (old, new) in enumerate(pairs) if old != new]
    return [key for key in keys if key not in told]


def files_changed(running: LoadedConfig, read: LoadedConfig, told: Sequence[str]) -> list[str]:
    """Keys of the devices' options, but for those `told` already, that name a file of another content than
    what runs: a schedule of faults, a DBC file."""
    keys = set()
    before, after = ((one.options, *one.more_options) for one in (running, read))
    devices = zip(running.config.device, before, after, strict=False)
    for d, (device, old, new) in enumerate(devices):
        for option in (name for name in {*old, *new} if old.get(name) != new.get(name)):
            # what a DBC file says stands under other keys once it is read
            named = option if option == "faults" else "dbc" if "dbc" in device.options else ""
            own = {f"device[{d}].options.{name}" for name in (option, named)}
            # what changed in the rig file itself is told, a table of it as `faults[0].value`
            if named and not any(one.startswith(tuple(own)) for one in told):
                keys.add(f"device[{d}].options.{named}")
    return sorted(keys)


def environment_fields(command: np.ndarray, fresh: np.ndarray, axes: list[int]) -> None:
    """Copy the environments of these axes of a freshly planned command into the one in force.

    An axis whose table is as it was keeps what a client has set since."""
    for name in command.dtype.names or ():
        if name.startswith("environment_"):
            command[name][0, axes] = fresh[name][0, axes]


def axes_of(keys: list[str]) -> list[int]:
    """Numbers of the axes whose keys these are (`axis[0].environment.kind`), each once."""
    return sorted({int(key.partition("[")[2].partition("]")[0]) for key in keys})


def _axes(config: Config) -> list[tuple[str, str]]:
    return [(axis.name, axis.motion) for axis in config.axis]


def _flat(value: object, prefix: str = "") -> dict[str, Any]:
    if isinstance(value, dict):
        items = [(f"{prefix}.{key}" if prefix else str(key), item) for key, item in value.items()]
    elif isinstance(value, list | tuple) and any(isinstance(item, dict) for item in value):
        items = [(f"{prefix}[{i}]", item) for i, item in enumerate(value)]
    else:
        return {prefix: value}
    out: dict[str, Any] = {}
    for key, item in items:
        out.update(_flat(item, key))
    return out
