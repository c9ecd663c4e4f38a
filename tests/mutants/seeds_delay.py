"""Seeded bugs of the delay of a torque whose current is sampled rarely (`rtctl.control.running_delay`)."""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/control/test_running_delay.py"

SEEDS = (
    Seed(
        "a current that is held is compared with what was sent since",
        "rtctl/control/running_delay.py",
        "held_torque(s, axis, 1 + age)",
        "held_torque(s, axis, 1)",
        (f"{UNIT}::test_a_held_current_is_compared_with_what_was_sent_when_it_was_sampled",),
    ),
    Seed(
        "a delay hides behind the age of samples that the proof includes",
        "rtctl/control/running_delay.py",
        "leaves_proof(p, axis, delay + p.proof_age_ticks[axis] - ERRORS * error)",
        "leaves_proof(p, axis, delay - ERRORS * error)",
        (f"{UNIT}::test_a_delay_counts_beside_the_age_of_samples_that_the_proof_includes",),
    ),
)
