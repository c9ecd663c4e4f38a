"""Options of the CAN backends, as they stand in a rig file. Host side only.

The validation context may carry `rate_hz`, `n_axes` and `folder`: with them a config whose frames cannot fit
on the bus, or that has not one table per axis, is refused here."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from hw.can import cia402, load, moteus_codec, odrive_codec
from hw.can.load import Load, Traffic
from hw.option_tables import Table, number, short_life
from hw.outside import whole

Argument = Annotated[str, Field(max_length=200)] | bool | int | float


class BusOptions(Table):
    """[device.options.bus]"""

    interface: str = Field(
        "socketcan", pattern=r"^[a-z][a-z0-9_]{0,31}$", description="as python-can names it"
    )
    channel: str = Field(min_length=1, max_length=200, description="can0, /dev/ttyACM0, ...")
    bitrate: int = number(10_000, 1_000_000, "bit/s; socketcan: as `ip link` set it", 1_000_000)
    fd: bool = Field(False, description="CAN FD frames")
    data_bitrate: int = number(10_000, 8_000_000, "FD: bit/s of the data phase", 5_000_000)
    raw: bool = Field(True, description="socketcan, slcan: our own code in place of python-can's")
    # a tenth is left: frames that are sent again after an error need room, too
    load_limit: float = number(
        0.05, 1.0, "greatest worst-case share of the bus' time a config may ask for", 0.9
    )
    arguments: dict[Annotated[str, Field(max_length=40)], Argument] = Field(
        default_factory=dict, max_length=20, description="handed to python-can's Bus as they are"
    )


class BusUser(Table):
    """What all CAN devices have: a bus, and frames that must fit on it."""

    bus: BusOptions

    @property
    def wire(self) -> tuple[str, str]:
        """Interface and channel: devices with the same ones are on one wire."""
        return self.bus.interface, self.bus.channel

    def frames(self, rate_hz: float) -> list[Traffic]:
        """All frames of the device on the bus, both ways."""
        raise NotImplementedError

    def identifiers(self) -> frozenset[int]:
        """Identifiers (with the flag of extended ones) that are the device's alone on its wire."""
        raise NotImplementedError

    def load(self, rate_hz: float) -> Load:
        """Load of the bus at a loop rate."""
        return load.bus_load(self.frames(rate_hz), self.bus.bitrate, self.bus.data_bitrate, 1.0 / rate_hz)

    def report(self, rate_hz: float) -> list[tuple[str, str, str]]:
        """Label, figure and note for `rtctl check`."""
        found = self.load(rate_hz)
        head = (
            "bus load at worst",
            f"{100 * found.share:.0f} %",
            f"of {self.bus.channel}; limit {100 * self.bus.load_limit:.0f} %",
        )
        cycle = ("frames of one period", f"{1e6 * found.cycle_s:.0f} us", f"of {1e6 / rate_hz:.0f} us")
        return [
            head,
            cycle,
            *(("  " + name, "", note) for name, _, note in (line.partition(": ") for line in found.lines)),
        ]

    @model_validator(mode="after")
    def _fits(self, info: ValidationInfo) -> Self:
        rate_hz = (info.context or {}).get("rate_hz")
        if rate_hz:
            found = self.load(rate_hz)
            text = load.fault(found, self.bus.bitrate, 1.0 / rate_hz, self.bus.load_limit)
            if text:
                raise ValueError(text)
        return self


class AxisOptions(Table):
    """[[device.options.axis]] of a drive: one per axis, in order."""

    direction: Annotated[Literal[-1, 1], BeforeValidator(whole)] = Field(
        1, description="-1 turns the sign of angle, current and torque"
    )
    shaft: Literal["motor", "link"] = Field(
        "motor", description="where the drive's angle and torque are meant"
    )
    offset_rad: float = number(-1e3, 1e3, "joint angle where the drive shows 0", 0.0)
    current_max_a: float = number(1e-3, 1e3, "larger commands are cut to it before they are encoded", 20.0)


class DriveOptions(BusUser):
    """Common part of the drives."""

    @model_validator(mode="after")
    def _axes(self, info: ValidationInfo) -> Self:
        axes: tuple[Any, ...] = self.axis  # type: ignore[attr-defined]
        n_axes = (info.context or {}).get("n_axes")
        if n_axes and len(axes) != n_axes:
            msg = f"{len(axes)} [[device.options.axis]] tables for {n_axes} axes; give one per axis, in order"
            raise ValueError(msg)
        nodes = [axis.node for axis in axes]
        if len(set(nodes)) != len(nodes):
            raise ValueError(f"axes must have different nodes, not {nodes}")
        return self


class OdriveAxisOptions(AxisOptions):
    """[[device.options.axis]] of kind odrive."""

    # 63 is nobody's: every node hears it (ODrive's CAN protocol)
    node: int = number(0, 62, "can.config.node_id")


class OdriveOptions(DriveOptions):
    """[device.options] of kind odrive."""

    feedback: Literal["cyclic", "request"] = Field(
        "cyclic",
        description="cyclic: the drive sends by itself; request: asked in every cycle by remote frames",
    )
    feedback_ms: float = number(1, 100, "cyclic: encoder_msg_rate_ms and iq_msg_rate_ms of the drive", 1.0)
    heartbeat_ms: float = number(
        1, 1000, "heartbeat_msg_rate_ms of the drive; at most 20 periods are allowed", 10.0
    )
    temperature_ms: float = number(0, 10_000, "temperature_msg_rate_ms of the drive; 0: none", 0.0)
    axis: tuple[OdriveAxisOptions, ...] = Field(min_length=1, max_length=8, strict=False)

    def frames(self, rate_hz: float) -> list[Traffic]:
        """See BusUser."""
        return odrive_codec.traffic(self.model_dump(), rate_hz)

    def identifiers(self) -> frozenset[int]:
        """See BusUser."""
        return frozenset(
            odrive_codec.can_id(axis.node, command) for axis in self.axis for command in range(32)
        )

    @model_validator(mode="after")
    def _classic(self) -> Self:
        if self.bus.fd and self.feedback == "request":
            raise ValueError("CAN FD has no remote frames: feedback = 'cyclic', or fd = false")
        return self

    @model_validator(mode="after")
    def _tells_soon(self, info: ValidationInfo) -> Self:
        """The heartbeat alone tells that the drive has let go; a lag of 20 cycles is a fault by itself."""
        rate_hz = (info.context or {}).get("rate_hz")
        if rate_hz and self.heartbeat_ms > max(20.0, 2e4 / rate_hz):
            raise ValueError(
                f"heartbeat_ms {self.heartbeat_ms:g} must be at most {max(20.0, 2e4 / rate_hz):g} (20 "
                "periods): a drive that lets go says so in its heartbeat only; set heartbeat_msg_rate_ms "
                "on the drive and this"
            )
        return self


class MoteusAxisOptions(AxisOptions):
    """[[device.options.axis]] of kind moteus."""

    node: int = number(1, 127, "id.id")


class MoteusOptions(DriveOptions):
    """[device.options] of kind moteus."""

    source: int = number(0, 126, "id of this host", 0)
    time_to_live_ms: float = number(
        1, 100, "a command is obeyed this long without a new one; at most 10 periods are allowed", 10.0
    )
    axis: tuple[MoteusAxisOptions, ...] = Field(min_length=1, max_length=8, strict=False)

    def frames(self, rate_hz: float) -> list[Traffic]:
        """See BusUser."""
        return moteus_codec.traffic(self.model_dump(), rate_hz)

    def identifiers(self) -> frozenset[int]:
        """See BusUser."""
        nodes = [axis.node for axis in self.axis]
        replies = {one for node in nodes for one in moteus_codec.reply_ids(node, self.source)}
        return frozenset(replies | {moteus_codec.command_id(node, self.source) for node in nodes})

    @model_validator(mode="after")
    def _consistent(self, info: ValidationInfo) -> Self:
        if not self.bus.fd:
            raise ValueError("bus.fd must be true: moteus speaks CAN FD only")
        short_life(self.time_to_live_ms, info)
        return self


class Cia402AxisOptions(AxisOptions):
    """[[device.options.axis]] of kind cia402."""

    node: int = number(1, 127, "CANopen node id")
    counts_per_turn: float = number(1, 1e9, "position units (6064) per turn of the shaft", 65536.0)
    velocity_units: float = number(
        0,
        1e12,
        "velocity units (606C) of one turn of the shaft per second, for channel velocity; 0: none",
        0.0,
    )
    rated_torque_nm: float | None = number(1e-6, 1e5, "in place of object 6076", None)
    rated_current_a: float | None = number(1e-6, 1e5, "in place of object 6075", None)


class Cia402Options(DriveOptions):
    """[device.options] of kind cia402."""

    source: int = number(1, 127, "node id of this host, for its heartbeat", 126)
    heartbeat_ms: int = number(1, 1000, "heartbeats of the host and of the drives", 5)
    time_to_live_ms: int = number(
        2, 1000, "the drives stop this long after the host's last heartbeat (object 1016)", 10
    )
    sdo_timeout_s: float = number(0.05, 10, "longest wait for an answer during set-up", 0.5)
    axis: tuple[Cia402AxisOptions, ...] = Field(min_length=1, max_length=8, strict=False)

    def frames(self, rate_hz: float) -> list[Traffic]:
        """See BusUser."""
        return cia402.traffic(self.model_dump(), rate_hz)

    def identifiers(self) -> frozenset[int]:
        """See BusUser. The SYNC is among them: a second one in a period would be a second sample."""
        own = {cia402.SYNC, cia402.HEARTBEAT + self.source}
        own |= {cia402.TPDO2 + axis.node for axis in self.axis if axis.velocity_units}
        return frozenset(own | {base + axis.node for axis in self.axis for base in cia402.PER_NODE})

    @model_validator(mode="after")
    def _heartbeats(self, info: ValidationInfo) -> Self:
        if self.time_to_live_ms < 2 * self.heartbeat_ms:
            raise ValueError(
                f"time_to_live_ms {self.time_to_live_ms} must be at least twice heartbeat_ms "
                f"{self.heartbeat_ms}: one late heartbeat must not stop the drives"
            )
        if len({axis.velocity_units > 0 for axis in self.axis}) > 1:
            raise ValueError("axis.velocity_units: give it for every axis, or leave it 0 for all")
        if self.source in [axis.node for axis in self.axis]:
            raise ValueError(f"source {self.source} is also the node of a drive")
        short_life(self.time_to_live_ms, info)
        return self
