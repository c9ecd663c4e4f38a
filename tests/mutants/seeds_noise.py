"""Seeded bugs in what tells another joint, or a smoothed column, from honest noise (decision 0150)."""

from __future__ import annotations

from seed import Seed

PROCESSED = "tests/unit/friction/test_processed_logs.py"
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
    Seed(
        "noise of the rows looks like a smoothed column",
        "rtctl/friction/logs/smoothed.py",
        "if _of_noise(balance, logs, best, of, mean_s):",
        "if False:",
        (f"{PROCESSED}::test_noise_and_coarse_steps_look_smoothed_to_nobody",),
    ),
    Seed(
        "every smoothed column is noise",
        "rtctl/friction/logs/smoothed.py",
        "if _of_noise(balance, logs, best, of, mean_s):",
        "if True:",
        (f"{PROCESSED}::test_a_column_that_was_smoothed_both_ways_is_told",),
    ),
    Seed(
        "noise of the position is no noise",
        "rtctl/friction/logs/smoothed.py",
        "np.sqrt(smaller) * noise.motion",
        "0.0 * noise.motion",
        (f"{PROCESSED}::test_noise_and_coarse_steps_look_smoothed_to_nobody",),
    ),
    Seed(
        "noise is taken for as large as the whole column",
        "rtctl/friction/logs/row_noise.py",
        "smooth(both, log.rate_hz, 2 * cutoff_hz) - smooth(both, log.rate_hz, cutoff_hz)",
        "both",
        (f"{PROCESSED}::test_noise_of_rows_is_as_large_as_it_was_made_and_none_of_a_smoothed_column",),
    ),
)
