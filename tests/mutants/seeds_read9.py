"""Bugs that a reading of the proofs' numbers found, or would have."""

from __future__ import annotations

from seed import Seed

QUIET = ("tests/unit/identify/test_quiet_servo.py",)
GUARD = ("tests/unit/identify/test_travel_guard.py",)
REPLUG = ("tests/unit/rt/test_replug.py",)
LOOP = ("tests/unit/control/test_overshooting_loop.py",)

SEEDS = (
    Seed(
        "the servo of identification knows of no current that overshoots",
        "rtctl/check/speed_servo.py",
        "            overshoot=overshoot,\n",
        "",
        QUIET,
    ),
    Seed(
        "the servo of identification does not hear of a resonance that is named",
        "rtctl/check/speed_servo.py",
        "    named = joint",
        "    named = False and joint",
        QUIET,
    ),
    Seed(
        "a drive's current that overshoots is later than its lag",
        "rtctl/control/proofs/drive_in_hand.py",
        "    omega = 2 * zeta * lag_1_s\n",
        "    omega = zeta * lag_1_s\n",
        LOOP,
    ),
    Seed(
        "the brake at the end of a travel is there at once",
        "rtctl/identify/travel_guard.py",
        "    late_s = rig.late_s + 0.5 * d * slow / rig.torque_rate_nm_s\n",
        "    late_s = 0.5 * d * slow / rig.torque_rate_nm_s\n",
        GUARD,
    ),
    Seed(
        "the gate lets the brake come at once",
        "rtctl/identify/travel_guard.py",
        "    late_s = rig.late_s + 0.5 * d * slow / rig.torque_rate_nm_s\n",
        "    late_s = rig.late_s\n",
        GUARD,
    ),
    Seed(
        "a device whose code fails as it is opened again is left as it was",
        "rtctl/rt/replug.py",
        "            raised_by(self._backend.stop)  # a mistake",
        "            pass  # a mistake",
        REPLUG,
    ),
    Seed(
        "a quicker loop that overshoots is tried in the steps of one that does not",
        "rtctl/control/proofs/stability.py",
        "for d in delays for share in _FASTER_RINGING]",
        "for d in delays for share in _FASTER]",
        LOOP,
    ),
    Seed(
        "the way of an answer does not begin at the next fresh sample",
        "rtctl/check/lateness.py",
        "        return self.declared_s(T) + self.between.sample_ticks * T\n",
        "        return self.declared_s(T)\n",
        GUARD,
    ),
)
