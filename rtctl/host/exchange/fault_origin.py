"""Which axis, which channel and what in a tick a fault is about.

The law says only that a fault is there. A person needs to know where: this looks at the tick that raised it
with the law's own limits. Where the tick does not show it beyond doubt, nothing is named; a rig of one axis
has no doubt."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rtctl.control.arming import CURRENT_SHARE
from rtctl.control.detectors import LAG_SHARE
from rtctl.control.force_doubt import EDGE
from rtctl.control.sample import JUMP_FACTOR
from rtctl.control.vocabulary import Fault, GateFlag


@dataclass(frozen=True)
class Where:
    """Number of the axis and channel of `hw.interface.CHANNEL_FIELDS` (None: not known, or none), what was
    seen, and what to say in place of the fault's own text."""

    axis: int | None = None
    channel: str | None = None
    detail: str = ""
    text: str = ""


@dataclass(frozen=True)
class Scene:
    """What there is to judge a fault by.

    Attributes
    ----------
    row
        The tick that raised it.
    before
        The tick before it, None where there is none.
    good
        The newest tick before it with a fresh and valid sample, None where there is none.
    arming
        Ticks of the test pulse so far, oldest first; may be empty.
    params
        Row of the law's parameters."""

    row: np.void
    before: np.void | None
    good: np.void | None
    arming: np.ndarray
    params: Any


NOWHERE = Where()

PAST_TRAVEL = (
    "the joint was moved past its travel (position_min_rad, position_max_rad of its axis): move it back, "
    "then reset; if it may go further, correct them"
)
"""What BAD_SAMPLE means where the sensor is sound."""


def locate(fault: Fault, scene: Scene) -> Where:
    """Where `fault` comes from, as far as the tick shows it."""
    judge = _JUDGES.get(fault)
    if judge is None:
        return NOWHERE
    found = judge(scene)
    alone = len(scene.row["position_rad"]) == 1
    if alone and found.axis is None and found.channel not in ("force", "moment"):
        return Where(0, found.channel, found.detail)
    return found


def _worst(scores: np.ndarray, channel: str | None, detail: Callable[[int], str]) -> Where:
    """The axis with the largest score, if that is above 1 and so beyond its limit; not finite is beyond
    all."""
    # a NaN passes every comparison by failing it
    scores = np.where(np.isfinite(scores), scores, math.inf)
    axis = int(np.argmax(scores))
    if not scores[axis] >= 1.0:
        return Where(None, channel)
    return Where(axis, channel, detail(axis))


def _slid(scene: Scene, axis: int) -> bool:
    """Whether the joint can have moved from its last valid position to where this tick shows it."""
    if scene.good is None:
        return False
    ticks = max(int(scene.row["tick"]) - int(scene.good["tick"]), 1)
    reach = JUMP_FACTOR * scene.params["velocity_limit_rad_s"][axis] * scene.params["period_s"] * ticks
    return bool(abs(scene.row["position_rad"][axis] - scene.good["position_rad"][axis]) <= reach)


def _bad_sample(scene: Scene) -> Where:
    row, p = scene.row, scene.params
    for axis, value in enumerate(row["position_rad"]):
        low, high = float(p["position_min_rad"][axis]), float(p["position_max_rad"][axis])
        if not low <= value <= high:
            seen = f"position {value:.6g} rad, range {low:g} to {high:g}"
            return Where(axis, "position", seen, PAST_TRAVEL if _slid(scene, axis) else "")
    for axis, value in enumerate(row["current_a"]):
        if not abs(value) <= p["current_limit_a"][axis]:
            return Where(axis, "current", f"current {value:.6g} A, range +-{p['current_limit_a'][axis]:g}")
    limit = float(np.min(p["force_limit_n"]))
    for name, value in zip("xyz", row["force_n"], strict=True):
        if not abs(value) <= limit:
            return Where(None, "force", f"force {name} {value:.6g} N, range +-{limit:g}")
    for name, value in zip("xyz", row["moment_nm"], strict=True):
        if p["moment_used"] and not abs(value) <= p["moment_limit_nm"]:
            return Where(None, "moment", f"moment {name} {value:.6g} N m, range +-{p['moment_limit_nm']:g}")
    return NOWHERE


def _jump(scene: Scene) -> Where:
    if scene.good is None:
        return Where(None, "position")
    moved = np.abs(scene.row["position_rad"] - scene.good["position_rad"])
    ticks = max(int(scene.row["tick"]) - int(scene.good["tick"]), 1)
    reach = scene.params["velocity_limit_rad_s"] * scene.params["period_s"] * ticks
    return _worst(moved / reach, "position", lambda a: f"by {moved[a]:.4g} rad in {ticks} ticks")


def _overspeed(scene: Scene) -> Where:
    speed, limit = np.abs(scene.row["velocity_rad_s"]), scene.params["velocity_limit_rad_s"]
    return _worst(speed / limit, None, lambda a: f"{speed[a]:.4g} rad/s, limit {limit[a]:g}")


def _velocity(scene: Scene) -> Where:
    own, measured = scene.row["velocity_rad_s"], scene.row["device_velocity_rad_s"]
    watched = scene.params["device_velocity_kind"] > 0
    # an axis whose velocity is only recorded has none
    tolerance = np.maximum(scene.params["device_tolerance_rad_s"], 1e-9)
    gap = np.where(watched, np.abs(measured - own) / tolerance, 0.0)
    return _worst(gap, "velocity", lambda a: f"device {measured[a]:.4g} rad/s, encoder {own[a]:.4g}")


def _temperature(scene: Scene) -> Where:
    p, found = scene.params, scene.row["temperature_c"]
    heat = np.where(p["temperature_kind"] > 0, found / p["temperature_trip_c"], 0.0)
    return _worst(heat, "temperature", lambda a: f"{found[a]:.4g} degC, trip {p['temperature_trip_c'][a]:g}")


def _follow(scene: Scene) -> Where:
    p, measured = scene.params, scene.row["motor_torque_nm"]
    # the current of a tick answers the torque of the one before
    sent = np.zeros_like(measured) if scene.before is None else scene.before["torque_applied_nm"]
    gap = np.where(p["follow_kind"] > 0, np.abs(measured - sent) / (LAG_SHARE * p["torque_limit_nm"]), 0.0)
    return _worst(gap, "current", lambda a: f"sent {sent[a]:.4g} N m, measured {measured[a]:.4g}")


def _energy(scene: Scene) -> Where:
    energy = scene.row["energy_port_j"]
    spent = -energy / max(float(scene.params["energy_budget_j"]), 1e-12)
    return _worst(spent, None, lambda a: f"port at {energy[a]:.4g} J")


def _continuous(scene: Scene) -> Where:
    mean = np.abs(scene.row["torque_applied_nm"]) / scene.params["torque_continuous_nm"]
    return _worst(mean, None, lambda a: f"{scene.row['torque_applied_nm'][a]:.4g} N m")


def _flagged(flag: GateFlag) -> Callable[[Scene], Where]:
    def judge(scene: Scene) -> Where:
        spoilt = (scene.row["gate_flags"].astype(np.int64) & int(flag)) != 0
        spoilt |= ~np.isfinite(scene.row["torque_wanted_nm"])
        return Where(int(np.argmax(spoilt))) if spoilt.any() else NOWHERE

    return judge


def _moved(scene: Scene) -> Where:
    if not len(scene.arming):
        return Where(None, "position")
    start = scene.arming["position_rad"][0]
    moved = np.abs(scene.row["position_rad"] - start)
    return _worst(
        moved / scene.params["arming_travel_rad"], "position", lambda a: f"moved by {moved[a]:.4g} rad"
    )


def _wiring(scene: Scene) -> Where:
    """An axis whose current does not answer the pulses; else, of one axis, its direction."""
    if len(scene.arming) < 2:
        return NOWHERE
    sent, got = scene.arming["torque_applied_nm"], scene.arming["motor_torque_nm"]
    delay = scene.params["follow_delay_ticks"]
    for axis in np.flatnonzero(scene.params["follow_kind"] > 0):
        # the middle of what it may be late by: pulses of 20 ms overlap all the same
        shift = 1 + int(delay[axis]) // 2
        pulse, answer = sent[:-shift, axis], got[shift:, axis]
        # 1e-12: no pulse was sent yet
        share = float(pulse @ answer) / max(float(pulse @ pulse), 1e-12)
        if share < CURRENT_SHARE:
            return Where(int(axis), "current", f"{share:.2f} of the test pulse in the current")
    return Where(None, "position", "the joint moved against the test pulse")


def _answer(scene: Scene) -> Where:
    """By the test pulse, or once the rig is ACTIVE by what it was sent there."""
    row, most_gain = scene.row, scene.params["current_gain_error"]
    pulse = np.isfinite(row["arming_gain"]) & ~np.isfinite(row["running_gain"])
    gain = np.where(pulse, row["arming_gain"], row["running_gain"])
    offset = np.where(pulse, row["arming_offset_nm"], row["running_offset_nm"])
    most_offset = scene.params["current_offset_nm"]
    off = np.maximum(np.abs(gain - 1.0) / most_gain, np.abs(offset) / most_offset)
    (seen,) = np.nonzero(np.isfinite(gain))
    if len(seen) and np.all(pulse[seen] & (off[seen] <= 1.0)):  # of several the tick does not tell of which
        axis = int(seen[0]) if len(seen) == 1 else None
        return Where(axis, "current", "the test pulse's steps are exceeded (drive.current_overshoot)")
    return _worst(
        np.where(np.isfinite(gain), off, 0.0),
        "current",
        lambda a: (
            f"{gain[a]:.3g} of what was sent ({1 - most_gain[a]:.3g} to {1 + most_gain[a]:.3g} is allowed), "
            f"{offset[a]:+.3g} N m off (+-{most_offset[a]:.3g})"
        ),
    )


def _clipped(scene: Scene) -> Where:
    row, p = scene.row, scene.params
    limit = float(np.min(p["force_limit_n"]))
    for name, value in zip("xyz", row["force_n"], strict=True):
        if abs(value) >= (1.0 - EDGE) * limit:
            return Where(None, "force", f"force {name} {value:.6g} N, limit {limit:g}")
    for name, value in zip("xyz", row["moment_nm"], strict=True):
        if p["moment_used"] and abs(value) >= (1.0 - EDGE) * p["moment_limit_nm"]:
            return Where(None, "moment", f"moment {name} {value:.6g} N m, limit {p['moment_limit_nm']:g}")
    return Where(None, "force")


def _frozen(scene: Scene) -> Where:
    x, y, z = scene.row["force_n"]
    return Where(None, "force", f"stays at {x:.6g}, {y:.6g}, {z:.6g} N")


def _force_offset(scene: Scene) -> Where:
    offset, limit = scene.row["force_offset_nm"], scene.params["force_offset_limit_nm"]
    found = _worst(
        np.where(np.isfinite(offset), np.abs(offset) / limit, 0.0),
        "force",
        lambda a: f"{offset[a]:+.3g} N m at the joint, +-{limit[a]:.3g} is allowed",
    )
    return Where(0, "force", found.detail) if len(offset) == 1 else found


def _off_axis(scene: Scene) -> Where:
    x, y, z = scene.row["force_tared_n"]
    u, v, w = scene.row["moment_tared_nm"]
    return Where(None, "force", f"tared {x:.3g}, {y:.3g}, {z:.3g} N; {u:.3g}, {v:.3g}, {w:.3g} N m")


def _delay(scene: Scene) -> Where:
    ms, p = 1e3 * float(scene.params["period_s"]), scene.params
    proof, declared, age = 1e3 * p["proof_delay_s"], 1e3 * p["declared_delay_s"], ms * p["proof_age_ticks"]
    pulse = ms * scene.row["arming_delay_ticks"]
    # fmax, not maximum: NaN of the one that was not measured must not hide the other
    late = np.fmax(pulse, ms * scene.row["running_delay_ticks"] + age)
    over = np.where((proof > 0.0) & np.isfinite(late), late / np.maximum(proof, 1e-6), 0.0)

    def told(a: int) -> str:
        by = "the test pulse" if late[a] == pulse[a] else f"motion, {age[a]:.3g} of them the samples' age"
        return f"{late[a]:.3g} ms by {by}; declared {declared[a]:.3g}, proven {proof[a]:.3g}"

    return _worst(over, "current", told)


def _estop(_scene: Scene) -> Where:
    return Where(None, "estop")


_JUDGES: dict[Fault, Callable[[Scene], Where]] = {
    Fault.BAD_SAMPLE: _bad_sample,
    Fault.JUMP: _jump,
    Fault.OVERSPEED: _overspeed,
    Fault.VELOCITY: _velocity,
    Fault.OVERTEMPERATURE: _temperature,
    Fault.ACTUATOR_LAG: _follow,
    Fault.ACTUATOR_WRONG: _follow,
    Fault.PASSIVITY: _energy,
    Fault.PASSIVITY_GROSS: _energy,
    Fault.OVERTORQUE: _continuous,
    Fault.GATE: _flagged(GateFlag.VIOLATION),
    Fault.LAW_NOT_FINITE: _flagged(GateFlag.NOT_FINITE),
    Fault.ARMING_MOVED: _moved,
    Fault.WIRING: _wiring,
    Fault.CURRENT: _answer,
    Fault.DELAY: _delay,
    Fault.FORCE_FROZEN: _frozen,
    Fault.FORCE_CLIPPED: _clipped,
    Fault.FORCE_OFFSET: _force_offset,
    Fault.OFF_AXIS: _off_axis,
    Fault.ESTOP: _estop,
}
