"""What the simulated rig says of its own delays and joint, for `rtctl check`. Plain numbers; imports no
plant."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hw.interface import ForceSensor, Joint, Options, Rig, Shown, Timing


def _of_axis(options: Options, axis: int) -> Mapping[str, Any]:
    """The table of an axis; one table is for all of them."""
    tables: Sequence[Mapping[str, Any]] = options.get("axis") or ({},)
    return tables[axis if len(tables) > 1 else 0]


def _bandwidth_hz(loop: Mapping[str, Any]) -> float:
    """Bandwidth of the current loop, given as such or as a time constant."""
    time_constant_s = float(loop.get("time_constant_s") or 0.0)
    if time_constant_s > 0:
        return 1 / (2 * math.pi * time_constant_s)
    return float(loop.get("bandwidth_hz") or 0.0)


def timing(options: Options, rig: Rig) -> list[Timing]:
    """Delay in whole periods and in any part of one, slow samples, and the lag of the current loop of each
    axis."""
    # or: where a rig file leaves a table out, dumped options have None
    slow = options.get("timing") or {}
    transport = float(slow.get("transport_delay_ticks") or 0.0)
    every = int(slow.get("sample_every_ticks") or 1)
    return [
        Timing(
            delay_s=(int(_of_axis(options, axis).get("torque_delay_ticks") or 0) + transport) * rig.period_s,
            # 0: fresh at every reading (`Timing`), whatever the rate of the loop
            sample_period_s=every * rig.period_s if every > 1 else 0.0,
            current_loop_hz=_bandwidth_hz(_of_axis(options, axis).get("current_loop") or {}),
        )
        for axis in range(rig.n_axes)
    ]


def force(options: Options, rig: Rig) -> ForceSensor:
    """Low-pass and delay of the simulated sensor."""
    sensor = options.get("force") or {}
    delay_s = int(sensor.get("delay_ticks") or 0) * rig.period_s
    return ForceSensor(float(sensor.get("lowpass_hz") or 0.0), delay_s)


def shown(options: Options, rig: Rig) -> Shown:
    """Steps of the simulated currents; those of position and force are the rig file's."""
    steps = (_of_axis(options, axis).get("current_resolution_a") for axis in range(rig.n_axes))
    return Shown(current_step_a=tuple(float(step or 0.0) for step in steps))


def joint(options: Options, rig: Rig) -> list[Joint]:
    """Where the damping of an elastic joint is, and what turns with the encoder."""
    return [_joint(_of_axis(options, axis).get("elastic")) for axis in range(rig.n_axes)]


def _joint(elastic: Mapping[str, Any] | None) -> Joint:
    if not elastic:
        return Joint()
    return Joint(
        motor_share=1.0 - float(elastic.get("link_viscous_share") or 0.0),
        dry_share=1.0 - float(elastic.get("link_dry_share") or 0.0),
        damping_nms_rad=float(elastic.get("damping_nms_rad") or 0.0),
        encoder=str(elastic.get("encoder") or "motor"),
        stiffness_nm_rad=float(elastic.get("stiffness_nm_rad") or 0.0),
        link_inertia_share=float(elastic.get("link_inertia_share") or 0.5),
    )
