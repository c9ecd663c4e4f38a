"""Seeded bugs of a reading of proofs and of `rtctl check` by first principles: what a sweep steps over, what a
frame of several ticks is, what a remedy leaves out.
"""

from __future__ import annotations

from seed import Seed

COUNTS = "tests/unit/control/test_admittance_counts.py::test_"
PROOF = "rtctl/control/proofs/admittance_counts.py"

SEEDS = (
    Seed(
        "a loop of two ticks is asked for the creep of one",
        PROOF,
        "np.exp(1j * turns * loop.sample_ticks * loop.period_s)",
        "np.exp(1j * turns * loop.period_s)",
        (f"{COUNTS}a_reading_that_errs_by_a_sawtooth_moves_the_joint_as_fast_as_is_told",),
    ),
    Seed(
        "a ring between two speeds of creep is stepped over",
        PROOF,
        "np.nan_to_num(own, posinf=quickest)",
        "np.nan_to_num(0 * own, nan=slowest)",
        (f"{COUNTS}a_ring_between_two_of_the_speeds_that_are_tried_is_found",),
    ),
)
