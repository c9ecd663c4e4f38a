"""Runs the real loop over a recorded log, as fast as it goes, with an operator who arms the rig.

The loop, the law and the backend are those of `rtctl run`; only the clock is virtual and the rows come
back as one array. Nothing moves: the motion and the hand stay the recorded ones."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from hw.interface import Backend, BackendError, Rig
from hw.motion import effort_units
from hw.plain_words import explain
from hw.playback.backend import PlaybackBackend
from hw.playback.reader import TORQUE_UNITS, Recording
from hw.playback.reader import load as load_recording
from rtctl.check.law_plan import build
from rtctl.control.vocabulary import Fault, State
from rtctl.errors import ConfigError, DataError
from rtctl.rig_file.config import Config, LoadedConfig
from rtctl.rt.clock import VirtualClock
from rtctl.rt.loop import Stop, run_loop
from rtctl.rt.shared_memory import CommandWriter, Memory, RingReader

ARM_EVERY_TICKS = 50
"""How often the operator tries to arm while the rig is IDLE."""

SPARE_ROWS = 1000
"""Rows of the ring beyond the log: the ramp after its end, and the rows no reader may touch."""


def load_log(options: Mapping[str, Any], rig: Rig) -> Recording:
    """Read the log of validated options. Raises DataError for what the reader refuses."""
    try:
        return load_recording(options, rig)
    except BackendError as error:
        raise DataError(str(error)) from error


def with_bias(options: Mapping[str, Any], rig: Rig, bias_nm: float) -> dict[str, Any]:
    """Options of a one-axis log whose hand torque is lowered by `bias_nm`, N m.

    The offset of a column counts in the column's own unit, before its scale."""
    # a copy: the options are those of the log as it was read
    axis = dict(options["axis"][0])
    column = axis.get("hand_torque")
    if column is None:
        raise ConfigError("a bias can be removed from a hand_torque column only, not from force columns")
    # from the column's own number to N m: the bias goes the other way
    factor = column["scale"] * effort_units(TORQUE_UNITS, *rig.moves(0))[column["unit"]]
    axis["hand_torque"] = {**column, "offset": column["offset"] + bias_nm / factor}
    return {**options, "axis": [axis, *options["axis"][1:]]}


def changed(
    loaded: LoadedConfig, options: Mapping[str, Any], axis: Mapping[str, Mapping[str, Any]]
) -> LoadedConfig:
    """The rig file with other device options and a virtual clock; `axis` changes tables of its first axis."""
    # through the tables of a rig file: what none may hold is refused
    data = loaded.config.model_dump(mode="json", by_alias=True)
    for table, keys in axis.items():
        data["axis"][0][table].update(keys)
    data["loop"]["clock"] = "virtual"  # as fast as it goes, and no tick is late
    config = Config.model_validate(data)
    return LoadedConfig(path=loaded.path, sha256=loaded.sha256, config=config, options=dict(options))


def config_for_log(options: Mapping[str, Any], rate_hz: float, axis: Mapping[str, Any]) -> LoadedConfig:
    """A rig made up for a log without a rig file: free environment, no coupling.

    Raises
    ------
    ConfigError
        A value of `axis` that no rig file may hold."""
    data = {
        "schema": 1,
        "rig": {"name": "playback"},
        "loop": {"rate_hz": rate_hz, "clock": "virtual", "realtime": "off"},
        "axis": [{"name": "lever", **axis}],
        # nothing moves: a recorded motion owes this law no energy
        "passivity": {"budget_j": 100.0, "bank_j": 0.0},
        "device": [{"kind": "playback", "options": dict(options)}],
    }
    try:
        config = Config.model_validate(data)
    except ValidationError as error:
        faults = tuple(f"{told.where}: {told.text}" for told in explain(error, Config, data))
        raise ConfigError("the rig given by options is not a valid one", faults) from error
    # of what was made up: there is no file whose checksum could tell two such rigs apart
    digest = hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
    return LoadedConfig(path=Path(options["file"]), sha256=digest, config=config, options=dict(options))


class Operator:
    """A backend with someone beside it who arms the rig whenever it is ready to be."""

    def __init__(self, backend: Backend, memory: Memory, command: np.ndarray) -> None:
        self.provides, self.consumes = backend.provides, backend.consumes
        self.open, self.write, self.stop, self.close = (
            backend.open,
            backend.write,
            backend.stop,
            backend.close,
        )
        self._read = backend.read
        self._writer = CommandWriter(memory)
        self._writer.command[:] = command
        self._reads = 0
        self._writer.send()

    def read(self, tick: np.ndarray) -> None:
        """Read the device; every now and then, arm."""
        self._read(tick)
        self._reads += 1
        # again and again: a request before it is ready is refused, and used up
        if self._reads % ARM_EVERY_TICKS == 0 and int(tick["state"][0]) == State.IDLE:
            command = self._writer.command
            command["arm_count"] += 1
            # the present one: a fault in the log raises it
            command["epoch"] = tick["epoch"]
            self._writer.send()


def fault_names(bits: int) -> str:
    """Names of `Fault` bits, comma-separated; `none` for none."""
    return ", ".join(str(fault.name) for fault in Fault if bits & fault) or "none"


def require_playback(loaded: LoadedConfig) -> None:
    """Refuse a rig that is no recording (ConfigError)."""
    # the backend of a recording alone is run below: any other device would be missing, unsaid
    if [device.kind for device in loaded.config.device] != ["playback"]:
        raise ConfigError(
            f"{loaded.path}: device[0].kind must be playback, not {loaded.config.device[0].kind}, and the "
            "only device"
        )


def run_log(loaded: LoadedConfig) -> np.ndarray:
    """Run the loop over the log of a playback rig until its end.

    Returns
    -------
    numpy.ndarray
        Every tick, in order.

    Raises
    ------
    ConfigError
        The rig is not a playback rig, or repeats its log for ever.
    DataError
        The log cannot be used; the rig never became ACTIVE, with the first fault's name where there was
        one."""
    require_playback(loaded)
    if loaded.options.get("loop"):
        raise ConfigError(
            f"{loaded.path}: device[0].options.loop: a log that is repeated for ever has no report"
        )
    # before the log is opened: a model that is missing costs no reading
    plan = build(loaded)
    backend = PlaybackBackend(loaded.options, loaded.config.hardware())  # that of `rtctl run`, too
    try:
        backend.open()
    except BackendError as error:
        raise DataError(str(error)) from error
    # all of the log at once: nobody reads the ring while the loop runs in this very process
    memory = Memory.create(plan.n_axes, len(backend.recording or ()) + SPARE_ROWS, plan.period_ns)
    try:
        memory.params[:], memory.model[:] = plan.params, plan.model
        run_loop(Operator(backend, memory, plan.command), memory, VirtualClock(), Stop())
        # before `close`, which gives the ring back
        rows = RingReader(memory, from_start=True).read()
    except BackendError as error:
        raise DataError(f"{loaded.options['file']}: {error}") from error
    finally:
        backend.close()
        memory.close()
    # else all figures would be of a rig without torque
    if not (rows["state"] == State.ACTIVE).any():
        seen = int(np.bitwise_or.reduce(rows["faults"]))
        raise DataError(
            f"{loaded.options['file']}: the rig never became ACTIVE over this log "
            f"(faults: {fault_names(seen)}); arming needs {plan.params[0]['ready_ticks']} good ticks: "
            "use a longer log, or correct its limits"
        )
    return rows
