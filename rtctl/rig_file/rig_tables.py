"""The tables of a rig file that are of the whole rig: `[rig]`, `[loop]`, `[passivity]`, and those of its
devices."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from rtctl.rig_file.fields import Name, Table, number


class RigTable(Table):
    """[rig]"""

    name: Name = Field(
        description="rig name: lock file, telemetry, model files and service instance carry it"
    )
    description: str = Field("", max_length=200, description="what the rig is, in words")
    # said, not guessed: a sensor that was forgotten would read 0 for ever
    absent: tuple[Literal["current", "force"], ...] = Field(
        (),
        strict=False,
        description="sensors this rig does not have; their channels read 0 and what needs them does nothing",
    )


class LoopTable(Table):
    """[loop]"""

    rate_hz: float = number(100, 20_000, "control rate", default=1000.0)
    clock: Literal["wall", "virtual"] = Field(
        "wall", description="virtual: as fast as it can, simulated rigs only"
    )
    realtime: Literal["require", "prefer", "waive", "off"] = Field(
        "prefer",
        description="require: refuse to start without real-time rights; prefer: start, but a real rig does "
        "not arm without them; waive: a real rig arms with a quarter of its torque; off: do not even "
        "ask, else as waive",
    )
    # 99 is the kernel's own (migration, watchdog)
    priority: int = number(1, 98, "SCHED_FIFO priority", default=80)
    cpu: int = number(
        -1,
        1023,
        "core of the loop; -1: the last one that it may use, or one that devices interrupt four times less "
        "often; isolated ones first; none that another real-time process keeps to, while there is another",
        default=-1,
    )
    early_us: Literal["auto"] | Annotated[float, Field(ge=0, le=4000)] = Field(
        "auto",
        description="time before each deadline that the loop is awake and looks at the clock: a sleeper is "
        "woken some tens of us late. auto: as long as wake-ups take, 80 on average and 200 at most; at most "
        "40 % of the period; 0: never",
    )
    # so long the host may stand still, for a disk or a debugger, before a tick is lost
    ring_s: float = number(8, 120, "seconds of ticks kept in shared memory", default=8.0)


class PassivityTable(Table):
    """[passivity]"""

    # these four bound what a hand is given: .13 J + 1 W t by default (docs/safety.md)
    budget_j: float = number(1e-6, 100, "deficit of a port before damping is injected", default=0.02)
    bank_j: float = number(0, 100, "most energy a port may save up", default=0.02)
    renderer_store_j: float = number(
        0, 10, "most energy a renderer or a change of environment may put in at once", default=0.1
    )
    renderer_power_w: float = number(
        0, 20, "most power a renderer or changes of environment may put in", default=1.0
    )


class DeviceTable(Table):
    """[[device]]: together the devices provide every channel once and take the command of every axis once."""

    kind: Name = Field(description="backend: mock, playback, or an installed one")
    name: Name | None = Field(None, description="names the device in errors; default: its kind")
    axes: tuple[Name, ...] = Field(
        (), strict=False, description="axes it serves, in its own order; empty: all"
    )
    channels: tuple[str, ...] = Field(
        (), strict=False, description="channels the rig uses of those it has; empty: all"
    )
    rate_hz: float | None = number(
        1, 100_000, "rate of a free-running sensor; default: a sample in every cycle", None
    )
    max_age_ticks: int | None = number(
        0,
        10_000,
        "oldest sample that counts as fresh; default: 0, or loop rate over rate_hz, rounded up",
        None,
    )
    budget_us: float | None = number(
        5, 5000, "time its reading may take; default: its share of 40 % of the period", None
    )
    options: dict[str, Any] = Field(default_factory=dict, description="the backend's own options")
