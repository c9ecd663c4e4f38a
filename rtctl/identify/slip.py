"""Break-away: from rest, the torque ramped open loop until the joint slips."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rtctl.control.vocabulary import Program, ProgramFlag
from rtctl.errors import DataError
from rtctl.friction.presliding import ramp_of
from rtctl.identify.collected import Collected
from rtctl.identify.late_ticks import begun_late, left_out, ran_late
from rtctl.identify.measurement_order import Task
from rtctl.identify.motion import LOOK_S, Motion, Order, Steps
from rtctl.identify.places import Spot, go_on
from rtctl.identify.tick_readings import break_away
from rtctl.tick import joined

FAST_SHARE = 0.6
"""The ramp is quick up to this share of the smallest break-away torque seen."""
SLOW_EVERY = 5
"""One ramp in so many is slow from the beginning: its presliding is looked at. A quick one bends against
damping too."""
# r N m/s moves the inertia of a light joint by r sqrt(2 J v/r), 5 to 10 % of it (docs/theory.md 9.1)
RISE_S = 4.0
"""A ramp takes at least this long to a usual break-away torque: the quicker it is, the more it adds while the
joint gets under way."""
SLOWEST_SHARE = 1.0 / 64.0
"""No ramp is slower than this share of the one of the settings: from a crest of cogging a joint rolls by
itself, and asks for nothing."""
SLIP_MAX_RAD = 0.2


def slip(motion: Motion, task: Task, got: Collected, spot: Spot, bias_nm: float) -> Steps[None]:
    """One break-away: move on in the direction of the ramp, rest, ramp until the joint slips."""
    rig, settings, direction = motion.rig, motion.settings, task.direction
    jog = motion.jog_speed_rad_s()
    # room to be braked in behind the slip, and half of the margin beyond that
    travel, stop = motion.high_rad - motion.low_rad, motion.stopping_rad(jog) + 0.5 * settings.margin_rad
    yield from go_on(motion, direction, spot, min(stop, 0.5 * travel), 0.0)
    yield from motion.rest()
    # the first is slow, too: nothing is known yet of where it may be quick
    slow = len(got.measurements) % SLOW_EVERY == 0
    seen_nm = [abs(m.torque_nm) for m in got.measurements]
    slope_nm_s = ramp_slope(settings.ramp_nm_s, seen_nm)
    limit_s = 2.0 * rig.torque_limit_nm / slope_nm_s  # twice as long as it can take
    fields = motion.order(
        Program.RAMP,
        limit_s,
        ramp_nm_s=direction * slope_nm_s,
        # the least seen: no ramp may be quick where it slips
        fast_nm=0.0 if slow else FAST_SHARE * min(seen_nm, default=math.inf),
        slip_rad=got.slip_rad,
    )
    parts = [(yield from motion.see(Order(fields, 4 * LOOK_S)))]
    while not int(parts[-1]["program_flags"][-1, rig.axis]):
        parts.append((yield from motion.see(Order(look_s=4 * LOOK_S))))
    rows = joined(parts)
    flags = ProgramFlag(int(rows["program_flags"][-1, rig.axis]))
    if ProgramFlag.LIMIT in flags:
        raise DataError(
            f"{task.name}: the joint did not move at {rig.servo_max_nm:g} N m, 90 % of "
            "torque_limit_nm; free the joint, or correct the torque constant or the limit in the rig file"
        )
    ended = int(np.argmax(rows["program_flags"][:, rig.axis] != 0))  # from there on the joint is braked
    rows = rows[:ended]
    found = break_away(rows, rig.axis, rig.period_s, rig.count_rad, bias_nm, rig.inertia_kgm2, rig.radian)
    # one is enough: it may have been where the joint slipped
    late = left_out(rows) + begun_late(rows, rig.period_s) > 0
    if (
        found is None and not late and ProgramFlag.SLIPPED in flags
    ):  # it only bent so far: bristles as soft as that
        got.slip_rad = min(2.0 * got.slip_rad, SLIP_MAX_RAD * rig.radian)
    if found is None or ProgramFlag.SLIPPED not in flags or found.torque_nm * direction <= 0:
        got.discard(late=late)
        return
    got.add(motion.cogging.noted(found))
    # on a flank bristles are bent already
    if slow and not motion.cogging.matters and not ran_late(rows, rig.period_s):
        torque = rows["motor_torque_nm"][:, rig.axis] - bias_nm
        position = rows["position_rad"][:, rig.axis]
        ramp = ramp_of(position, torque, found.torque_nm, rig.count_rad, rig.period_s)
        got.ramps += [ramp] if ramp else []


def ramp_slope(asked_nm_s: float, seen_nm: Sequence[float]) -> float:
    """Slope of the next ramp, N m/s, at most `asked_nm_s`; `seen_nm` are the break-away torques so far, each
    above 0."""
    # the median: one ramp on a crest of cogging must not slow down all that follow
    usual_nm = float(np.median(seen_nm)) if seen_nm else math.inf
    return min(asked_nm_s, max(usual_nm / RISE_S, SLOWEST_SHARE * asked_nm_s))
