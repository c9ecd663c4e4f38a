"""Seeded bugs of what is held against sensors that lie, and of the six components of a force-torque
sensor.
"""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/control"
LIES = (f"{UNIT}/test_force_doubt.py",)
FORCE = (
    f"{UNIT}/test_force.py::test_the_weight_of_the_tip_is_not_in_the_tare",
    f"{UNIT}/test_force.py::test_a_moment_out_of_range_is_no_sample",
)
WRENCH = (f"{UNIT}/test_wrench.py",)
CURRENT = (f"{UNIT}/test_running_current.py",)
MOMENTS = ("tests/unit/hw/test_force_moments.py",)
DOUBT = "rtctl/control/force_doubt.py"

SEEDS = [
    Seed(
        "a value that repeats itself is frozen whatever the motion says", DOUBT,
        "    if not back or s.same_ticks * p.period_s < FROZEN_S:\n        return False\n",
        "    if s.same_ticks * p.period_s >= FROZEN_S:\n        return True\n", LIES,
    ),
    Seed(
        "what the motor gave counts as nobody's", DOUBT,
        "taken - motor - t.hand_torque_nm[axis] * dx", "taken - t.hand_torque_nm[axis] * dx", LIES,
    ),
    Seed(
        "friction takes nothing from a joint that is moved unseen", DOUBT,
        "taken = s.friction_credit_j[axis] + max(", "taken = 0.0 * max(", LIES,
    ),
    Seed("a value exactly at its limit is below it", DOUBT, ">= (1.0 - EDGE) * limit:", "> limit:", LIES),
    Seed("the third component has no limit", DOUBT, "    for i in range(6):\n        limit = p",
        "    for i in (0, 1, 3, 4, 5):\n        limit = p", LIES),
    Seed("one sample at the limit is enough", DOUBT, "s.clipped_ticks >= IN_A_ROW", "s.clipped_ticks >= 1",
        LIES),
    Seed(
        "a joint that rests slides", DOUBT, " and not is_resting(s, p, axis)\n", "\n", LIES,
    ),
    Seed(
        "friction seen under another load is held against a force that stays", DOUBT,
        "ticks = s.stayed_ticks[axis] if staying else s.slid_ticks[axis]", "ticks = s.slid_ticks[axis]", LIES,
    ),
    Seed(
        "friction that differs both ways is an offset of any size", DOUBT,
        "    if abs(offset) <= p.force_offset_limit_nm[axis]:", "    if abs(offset) <= 0.0:", LIES,
    ),
    Seed(
        "an offset has one sign", DOUBT,
        "    if abs(offset) <= p.force_offset_limit_nm[axis]:",
        "    if offset <= p.force_offset_limit_nm[axis]:", LIES,
    ),
    Seed(
        "the friction of each direction is that of the last moment", DOUBT,
        "mean + share * (seen - mean)", "seen", LIES,
    ),
    Seed(
        "the force across the joints is the whole of it", "rtctl/control/wrench.py",
        "    for k in range(found):\n        _remove(rest, s.beside_basis[k])\n", "", WRENCH,
    ),
    Seed(
        "a joint turns the ones behind it", "rtctl/control/wrench.py",
        "for before in range(k):", "for before in range(k + 1, p.chain_count):", WRENCH,
    ),
    Seed(
        "joints turn the sensor the other way", "rtctl/control/wrench.py",
        "turn(s.weight, 0, direction, -angle)", "turn(s.weight, 0, direction, angle)", WRENCH,
    ),
    Seed(
        "a turning joint does not shift what it carries", "rtctl/control/wrench.py",
        "    screw[0] += p_y * screw[5] - p_z * screw[4]\n", "", WRENCH,
    ),
    Seed(
        "the weight is in the tare", "rtctl/control/force.py",
        "s.tare_sum[axis, i] += s.wrench[i] - s.weight[i]", "s.tare_sum[axis, i] += s.wrench[i]", FORCE,
    ),
    Seed(
        "a moment that is no number is in range", "rtctl/control/sample.py",
        "not abs(t.moment_nm[i]) <= p.moment_limit_nm", "abs(t.moment_nm[i]) > p.moment_limit_nm", FORCE,
    ),
    Seed(
        "a running gain has no upper bound", "rtctl/control/running_current.py",
        "right = abs(gain - 1.0) <=", "right = 1.0 - gain <=", CURRENT,
    ),
    Seed(
        "a steady torque hides an offset", "rtctl/control/running_current.py",
        "    return not abs(e) <= most_gain * abs(u) + most_offset + ERRORS * error", "    return False",
        CURRENT,
    ),
    Seed(
        "one window that is off is enough", "rtctl/control/running_current.py",
        "return _F_CURRENT if s.running_gap_count[axis] >= BAD_WINDOWS else 0",
        "return _F_CURRENT if s.running_gap_count[axis] >= 1 else 0", CURRENT,
    ),
    Seed("moments are shown in the axes of the forces", "hw/force/sample.py",
        "_product(self._moment_rows, reading.moment)", "_product(self._rows, reading.moment)", MOMENTS),
    Seed(
        "a moment that is no number is vouched for", "hw/force/rokubi.py",
        "math.isfinite(fx + fy + fz + mx + my + mz)", "math.isfinite(fx + fy + fz)", MOMENTS,
    ),
]  # fmt: skip
