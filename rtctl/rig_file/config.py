"""The rig file: TOML, validated strictly, every fault reported at once.

The loop process does not import it, and gets plain arrays (`rtctl.check.law_plan`). Tables and their bounds
stand in `rtctl.rig_file.axis_tables` and beside it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from operator import is_
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field, ValidationError, field_validator, model_validator

from hw import registry
from hw.interface import Rig
from hw.member import Member
from hw.outside import real, whole
from rtctl.errors import ConfigError
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.device_options import device_options, put_script
from rtctl.rig_file.devices import Composition
from rtctl.rig_file.fields import Table
from rtctl.rig_file.host_tables import GatewayTable, RecordTable, TelemetryTable, ViewTable
from rtctl.rig_file.linear_keys import LinearKeys
from rtctl.rig_file.mistakes import fault_lines, tiny_lines
from rtctl.rig_file.rig_tables import DeviceTable, LoopTable, PassivityTable, RigTable
from rtctl.rig_file.sensor_tables import ForceSensorTable
from rtctl.rig_file.toml_lines import read_toml
from rtctl.tick import MOST_AXES


def _or_switch(schema: dict[str, Any]) -> None:
    """In the JSON Schema: `true` and `false` besides the table."""
    schema["anyOf"].insert(0, {"type": "boolean"})


class Config(Table):
    """A whole rig file."""

    schema_version: Annotated[Literal[1], BeforeValidator(whole)] = Field(
        1, alias="schema", description="version of the keys of this file"
    )
    rig: RigTable = Field(
        description="a table [rig] with the rig's name; `rtctl init` copies a whole rig file"
    )
    loop: LoopTable = LoopTable()
    axis: tuple[AxisTable, ...] = Field(
        min_length=1, max_length=MOST_AXES, strict=False, description="a table [[axis]] for each axis"
    )
    force_sensor: ForceSensorTable = ForceSensorTable()
    passivity: PassivityTable = PassivityTable()
    device: tuple[DeviceTable, ...] = Field(
        min_length=1, max_length=8, strict=False, description="a table [[device]] for each device"
    )
    telemetry: TelemetryTable = TelemetryTable()
    gateway: GatewayTable = GatewayTable()
    record: RecordTable | None = Field(None, json_schema_extra=_or_switch)
    view: ViewTable | None = Field(None, json_schema_extra=_or_switch)

    # before: pydantic would refuse a truth value where it wants a table
    @field_validator("record", "view", mode="before")
    @classmethod
    def _switch(cls, value: object) -> object:
        """`true` stands for a table of defaults, `false` for none."""
        return {True: {}, False: None}[value] if isinstance(value, bool) else value

    @model_validator(mode="after")
    def _unique_axes(self) -> Config:
        names = [axis.name for axis in self.axis]
        if len(set(names)) != len(names):
            raise ValueError(f"axis names must differ, not {names}")
        return self

    @model_validator(mode="after")
    def _needs_force(self) -> Config:
        for axis in self.axis:
            if axis.force_feedback.gain > 0 and "force" in self.rig.absent:
                gain = f"axis {axis.name}: force_feedback.gain {axis.force_feedback.gain}"
                raise ValueError(f"{gain} needs the force sensor that rig.absent rules out; set gain = 0")
            if axis.may_show("admittance") and "force" in self.rig.absent:
                raise ValueError(
                    f'axis {axis.name}: display = "admittance" needs the force sensor that rig.absent rules '
                    'out; set display = "impedance", without display_change, or give the rig its sensor'
                )
        return self

    @model_validator(mode="after")
    def _sensor_fits(self) -> Config:
        sensor, names = self.force_sensor, [axis.name for axis in self.axis]
        for name in sensor.carried_by:
            if name not in names:
                msg = f"force_sensor.carried_by: no axis is called {name!r}; there are {', '.join(names)}"
                raise ValueError(msg)
        for axis in self.axis:
            if (sensor.moments or axis.name in sensor.carried_by) and not any(axis.axis_direction):
                raise ValueError(
                    f"axis {axis.name}: force_sensor needs its axis_direction, the unit vector of the "
                    "joint's axis in sensor axes"
                )
            if not sensor.moments and not any(axis.lever_m):
                raise ValueError(
                    f"axis {axis.name}: lever_m {axis.lever_m}: without force_sensor.moments it needs a "
                    "component other than 0"
                )
        return self

    @model_validator(mode="after")
    def _ports_differ(self) -> Config:
        first = self.gateway.port
        taken = (
            # requests, targets, telemetry
            dict.fromkeys(range(first, first + 3), "gateway.port and the two after it")
            if self.gateway.bind
            else {}
        )
        for key, port in self._ports_for_viewers().items():
            if port in taken:
                raise ValueError(f"{key} {port} is taken by {taken[port]}; give another")
            taken[port] = key
        return self

    def _ports_for_viewers(self) -> dict[str, int]:
        """Ports on 127.0.0.1 that are in use, by key."""
        ports = (
            {"telemetry.plotjuggler_port": self.telemetry.plotjuggler_port}
            if self.telemetry.plotjuggler
            else {}
        )
        return ports | ({} if self.view is None else {"view.port": self.view.port})

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return len(self.axis)

    @property
    def period_s(self) -> float:
        """Loop period T, s."""
        return 1.0 / self.loop.rate_hz

    @property
    def simulated(self) -> bool:
        """True when no device of the rig has a real actuator."""
        return all(registry.lookup(device.kind).simulated for device in self.device)

    @property
    def may_be_late(self) -> bool:
        """True for a simulated rig without real-time rights: nobody holds it, and late ticks are counted."""
        return self.simulated and self.loop.realtime != "require"

    def hardware(self) -> Rig:
        """The facts a backend needs."""
        return Rig(
            n_axes=self.n_axes,
            period_s=self.period_s,
            gear_ratio=np.array([axis.motor_ratio for axis in self.axis]),
            gear_efficiency=np.array([axis.gear_efficiency for axis in self.axis]),
            torque_constant_nm_a=np.array([axis.torque_constant_nm_a for axis in self.axis]),
            encoder_counts_per_rev=np.array([axis.counts_of_turn for axis in self.axis]),
            lever_m=np.array([axis.lever_m for axis in self.axis], dtype=float),
            axis_direction=np.array([axis.axis_direction for axis in self.axis], dtype=float),
            # 0 is a linear motor
            lead_m=np.array([axis.lead_m if axis.motion == "linear" else -1.0 for axis in self.axis]),
        )

    def composition(self, options: Sequence[Mapping[str, Any]]) -> Composition:
        """The devices with their validated options, one of each."""
        return Composition(
            tables=self.device,
            options=options,
            axis_names=[axis.name for axis in self.axis],
            absent=self.rig.absent,
            hardware=self.hardware(),
            clock=self.loop.clock,
            velocity_axes=[i for i, axis in enumerate(self.axis) if axis.velocity.device != "record"],
            moments=self.force_sensor.moments,
        )


class LoadedConfig(Table):
    """A validated rig file with where it came from."""

    model_config = ConfigDict(arbitrary_types_allowed=True, frozen=True)

    path: Path
    sha256: str
    config: Config
    options: dict[str, Any] = Field(
        description="validated options of the first device, plain values, absolute paths"
    )
    more_options: tuple[dict[str, Any], ...] = Field((), description="those of the other devices, in order")
    script: Path | None = Field(None, description="schedule of faults given in place of the rig file's own")
    _made: tuple[tuple[object, ...], tuple[Member, ...]] | None = None

    @property
    def scripted_faults(self) -> int:
        """How many faults are scripted into its simulated devices (docs/faults.md)."""
        return sum(len(options.get("faults", ())) for options in (self.options, *self.more_options))

    def members(self) -> tuple[Member, ...]:
        """The devices as the loop process gets them.

        Made once: who plans a rig asks ten times, and a device is made to ask it for its channels."""
        options = (self.options, *self.more_options)
        made_of = (self.config, *options)
        # a copy with other tables (`model_copy`) takes along what its origin has made
        if self._made is None or not all(map(is_, self._made[0], made_of)):
            self._made = made_of, self.config.composition(options).members()
        return self._made[1]

    def device_report(self) -> list[tuple[str, list[tuple[str, str, str]]]]:
        """Per device that has something to tell (as its bus's load): label, figure, note of each line."""
        told = []
        for device, options in zip(self.config.device, (self.options, *self.more_options), strict=True):
            model = registry.options_model(device.kind)
            if hasattr(model, "report"):
                valid = model.model_validate(options, context={"folder": self.path.parent})
                told.append((device.kind, valid.report(self.config.loop.rate_hz)))
        for wire in self.config.composition((self.options, *self.more_options)).shared_wires():
            on = f"{' and '.join(wire.labels)} on {wire.interface} {wire.channel}"
            told.append((on, wire.report(self.config.loop.rate_hz)))
        return told

    def keys_folder(self) -> Path | None:
        """Absolute path of the folder of keys, or None where the rig is not reached by TCP."""
        folder = self.config.gateway.curve_dir
        return real(self.path.parent / folder) if folder else None

    def model_path(self, axis: AxisTable) -> Path | None:
        """Absolute path of an axis' friction model, or None."""
        return real(self.path.parent / axis.friction.model) if axis.friction.model else None

    def model_in_use(self, axis: AxisTable) -> Path | None:
        """As `model_path`; None where the policy is off, too: the law has no model then."""
        return None if axis.friction.policy == "off" else self.model_path(axis)


def load(path: str | Path, script: str | Path | None = None) -> LoadedConfig:
    """Read and validate a rig file.

    Parameters
    ----------
    path
        TOML file.
    script
        Schedule of faults (docs/faults.md) for its simulated device, in place of the rig file's own.

    Raises
    ------
    ConfigError
        File and, one line each, every key at fault, its value and bound; or a `script` that nothing takes."""
    path = real(path)  # absolute: the daemon's folder may be another one
    if any("\ud800" <= letter <= "\udfff" for letter in str(path)):  # no text: cannot be told, nor recorded
        raise ConfigError(f"{path}: its name is not UTF-8; rename it")
    raw, data, told = read_toml(path)
    turned = LinearKeys(data, told)
    data, where = turned.data, turned.where
    faults = tiny_lines(where, data)
    config: Config | None = None
    try:
        config = Config.model_validate(data)
    except ValidationError as error:
        faults += fault_lines(where, (), error, Config, data)
    if script is not None and config is not None:
        faults += put_script(path, config.device, data, real(script))
    options, more = device_options(path, data, where)
    faults += more
    if config is not None and not faults:  # devices are asked only where their options are valid
        faults += [f"{path}: {line}" for line in config.composition(options).faults()]
    if config is None or faults or turned.faults:
        raise ConfigError(
            f"{path}: {len(faults) + len(turned.faults)} fault(s) in the rig file",
            (*turned.faults, *turned.spoken(faults)),
        )
    # of the bytes: a comment makes another file, and a data set says so
    digest = hashlib.sha256(raw).hexdigest()
    return LoadedConfig(
        path=path,
        sha256=digest,
        config=config,
        options=options[0],
        more_options=tuple(options[1:]),
        script=None if script is None else real(script),
    )
