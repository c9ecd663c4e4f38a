"""Options of the force sensors: `[device.options]`. Host side only."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from hw.force import axes, optoforce, rdt, rokubi
from hw.option_tables import Table, number
from hw.outside import whole

# cross-talk and signs, and the lever of a tool; a unit goes into counts_per_n
Entry = Annotated[float, Field(ge=-100, le=100)]
Row = Annotated[tuple[Entry, Entry, Entry], Field(strict=False)]
Matrix = Annotated[tuple[Row, Row, Row], Field(strict=False)]
Counts = Annotated[float, Field(ge=1e-3, le=1e9)]


class SensorOptions(Table):
    """What every force sensor may be told."""

    matrix: Matrix = Field(
        default=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        description="force of the hand on the tip = matrix . sensor's force: axes, signs, cross-talk",
    )
    moments: bool = Field(
        False, description="show its moments too (channel moment), for force_sensor.moments"
    )
    moment_matrix: Matrix | None = Field(
        default=None,
        description="moment about the sensor's origin = moment_matrix . sensor's moment; default: turned and "
        "mirrored as matrix does",
    )
    open_timeout_s: float = number(0, 10, "wait for the first sample when opening; 0: do not wait", 1.0)

    @model_validator(mode="after")
    def _senses(self) -> SensorOptions:
        # a hand that pushes such a rig would not be felt, and nothing would tell
        if not any(any(row) for row in self.matrix):
            raise ValueError("matrix is all zeros: every force would be 0")
        if self.moments and self.moment_matrix is None and not axes.only_turns(self.matrix):
            raise ValueError(axes.NOT_TOLD)
        if self.moments and self.moment_matrix is not None and not any(map(any, self.moment_matrix)):
            raise ValueError("moment_matrix is all zeros: every moment would be 0")
        return self


class SerialSensorOptions(SensorOptions):
    """A sensor on a serial port."""

    port: str = Field(
        min_length=1,
        max_length=500,
        description="device file; one below /dev/serial/by-id survives re-plugging",
    )


class RokubiOptions(SerialSensorOptions):
    """[device.options] of kind rokubi: Bota Systems' serial sensors."""

    baud: int = number(9600, 4_000_000, "bit rate of the port, bit/s", rokubi.BAUD)
    stop_at_close: bool = Field(
        default=False,
        description="leave the sensor silent in its configuration mode; the next start wakes it",
    )


class OptoForceOptions(SerialSensorOptions):
    """[device.options] of kind optoforce: the OptoForce / OnRobot DAQ."""

    baud: int = number(9600, 4_000_000, "bit rate of the port, bit/s", optoforce.BAUD)
    layout: Literal["3-axis", "6-axis", "4x3-axis"] = Field("3-axis", description="kind of sensor at the DAQ")
    sensor: int = number(1, 4, "which of the four, with layout 4x3-axis", 1)
    counts_per_n: tuple[Counts, Counts, Counts] = Field(
        strict=False, description="sensitivity of x, y, z from the sensor's own data sheet"
    )
    counts_per_nm: tuple[Counts, Counts, Counts] = Field(
        (1000.0, 1000.0, 1000.0), strict=False, description="the same for the moments of layout 6-axis"
    )
    # 30 and 10 Hz, which the DAQ has too, are left out: a sample of 33 ms is older than the law takes (10 ms)
    output_hz: Annotated[Literal[1000, 333, 100], BeforeValidator(whole)] = Field(
        1000, description="rate the DAQ is set to when opening"
    )
    filter_hz: Annotated[Literal[0, 500, 150, 50, 15], BeforeValidator(whole)] = Field(
        0, description="cut-off of the DAQ's filter; 0: none"
    )

    @model_validator(mode="after")
    def _one_sensor(self) -> OptoForceOptions:
        if self.sensor != 1 and self.layout != "4x3-axis":
            raise ValueError(f"sensor {self.sensor}: only layout '4x3-axis' has more than one")
        # the default of counts_per_nm is no sensor's: moments by it would be wrong by an unknown factor
        if self.moments and (self.layout != "6-axis" or "counts_per_nm" not in self.model_fields_set):
            msg = "moments: need layout = '6-axis' and counts_per_nm, from the sensor's own data sheet"
            raise ValueError(msg)
        return self


class RdtOptions(SensorOptions):
    """[device.options] of kind rdt: ATI Net F/T and Axia, OnRobot HEX, Schunk, over UDP."""

    host: str = Field(min_length=1, max_length=253, description="address of the sensor")
    port: int = number(1, 65535, "UDP port of the sensor", rdt.PORT)
    counts_per_n: Counts = Field(
        1e6, description="from the sensor's configuration page; ATI usually 1000000, OnRobot HEX 10000"
    )
    counts_per_nm: Counts = Field(1e6, description='likewise, "counts per torque" in N m')
    # at least 2 ms: at 1 kHz a record may miss a cycle by the network's own delay
    lost_after_s: float = number(0.002, 1.0, "silence after which the sensor counts as lost", 0.02)
