"""Seeded bugs in what tells another joint, or a smoothed column, from honest noise (decision 0150)."""

from __future__ import annotations

from seed import Seed

COGGING = "tests/unit/friction/test_cogging.py"

SEEDS = (
    Seed(
        "the cogging of another joint fits by some shift",
        "rtctl/friction/learn/cogging.py",
        "(self.chance <= CHANCE_MOST or self.off <= OFF_MOST)",
        "self.chance <= 1.0",
        (f"{COGGING}::test_waves_of_the_same_orders_and_other_phases_are_another_joint",),
    ),
    Seed(
        "a single wave is never found again",
        "rtctl/friction/learn/cogging.py",
        "(self.chance <= CHANCE_MOST or self.off <= OFF_MOST)",
        "self.chance <= CHANCE_MOST",
        (f"{COGGING}::test_a_single_wave_fits_wherever_it_is_and_not_if_it_is_of_another_size",),
    ),
    Seed(
        "the chance is that of a worse match",
        "rtctl/friction/learn/in_step.py",
        "most[1:] >= most[0]",
        "most[1:] < most[0]",
        (f"{COGGING}::test_the_same_joint_fits_with_friction_and_waves_that_have_drifted",),
    ),
)
