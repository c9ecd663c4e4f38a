"""Tables of a rig file: what the host does beside the loop: recording, page, telemetry, clients."""

from __future__ import annotations

import contextlib
import ipaddress

from pydantic import Field, model_validator

from rtctl.rig_file.fields import Table, number


class RecordTable(Table):
    """[record]: every tick of every run into MCAP files; `record = true` for the defaults"""

    folder: str = Field(
        "",
        max_length=500,
        description="relative to the rig file; empty: `recordings` in the rig's state folder",
    )
    file_mb: float = number(1, 1e6, "a new file begins at this size", default=1000.0)
    file_minutes: float = number(0.01, 1e5, "and at this age", default=60.0)
    # the event log needs room as well, and a full disk takes more than recordings with it
    free_mb: float = number(0, 1e7, "room left on the disk: below it recording pauses", default=200.0)


class ViewTable(Table):
    """[view]: the daemon shows its own page on 127.0.0.1; `view = true` for the defaults"""

    # below 1024 only root may listen
    port: int = number(
        1024, 65_535, "TCP port of the page; each rig of a machine needs its own", default=8650
    )


class TelemetryTable(Table):
    """[telemetry]"""

    state_hz: float | None = number(
        1,
        1000,
        "rate of the decimated state samples; left out: 100, or one a message if that is more",
        default=None,
    )
    batch_ms: float | None = number(
        1,
        1000,
        "ticks per message, as time; left out: 8 ticks, at least 2 ms and at most 20 ms",
        default=None,
    )
    # off: it has no keys
    plotjuggler: bool = Field(
        False, description="also publish the state samples on 127.0.0.1 without keys, read-only, for viewers"
    )
    plotjuggler_port: int = number(1024, 65_000, "TCP port of that publication", default=9872)


class GatewayTable(Table):
    """[gateway]: clients on other machines, and of other users. The daemon's own user always reaches it by
    ipc."""

    # empty: nobody is let in over a network whom no rig file named
    bind: str = Field(
        "", max_length=15, description="IPv4 address to listen on, 127.0.0.1 for tunnels; empty: no TCP"
    )
    # two more follow it, and 65,535 is the last
    port: int = number(
        1024, 65_000, "TCP port of requests; targets and telemetry take the next two", default=9860
    )
    curve_dir: str = Field(
        "", max_length=500, description="folder of keys, relative to the rig file; made by `rtctl keys new`"
    )
    group: str = Field(
        "",
        pattern=r"^([A-Za-z_][A-Za-z0-9_.-]{0,31})?$",
        description="unix group whose members reach the daemon by ipc, as operators; empty: its own user "
        "and root only",
    )

    @model_validator(mode="after")
    def _keys_for_tcp(self) -> GatewayTable:
        if self.bind:
            _check_address(self.bind)
        # without keys whoever reaches the port could move the rig
        if self.bind and not self.curve_dir:
            raise ValueError(
                f"bind {self.bind}: TCP needs keys; make them with `rtctl keys new` and name their folder "
                "as curve_dir"
            )
        # refused: who made keys believes that the rig can be reached by them
        if self.curve_dir and not self.bind:
            msg = f"curve_dir {self.curve_dir!r} has no effect without bind; give an address or remove it"
            raise ValueError(msg)
        return self


def _check_address(text: str) -> None:
    address = None
    with contextlib.suppress(ValueError):
        address = ipaddress.IPv4Address(text)
    # 0.0.0.0 is every network of the machine, also those that nobody had in mind, and no address for a client
    if address is None or address.is_unspecified:
        msg = f"bind {text!r}: an IPv4 address of this machine, such as 127.0.0.1, not a name or a wildcard"
        raise ValueError(msg)
    # else libzmq says at the start only that it cannot be assigned
    if address.is_multicast or address.is_reserved:
        raise ValueError(f"bind {text}: no address a machine can have")
