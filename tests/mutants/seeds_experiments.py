"""Seeded bugs of the experiments: what a policy is judged by, and what the page says of it."""

from __future__ import annotations

from seed import Seed

POLICIES = ("tests/unit/experiments/test_policies.py",)

SEEDS = (
    Seed(
        "a speed that is not a number is quiet",
        "rtctl/experiments/still_hand.py",
        "not self.speed_rad_s <= most_rad_s",
        "self.speed_rad_s > most_rad_s",
        POLICIES,
    ),
    Seed(
        "a rig that stopped has a quiet policy",
        "rtctl/experiments/policies.py",
        '"stopped by a fault": not np.isfinite(energy).all(),',
        '"stopped by a fault": False,',
        POLICIES,
    ),
    Seed(
        "a plant on which the rig stopped counts as won",
        "rtctl/experiments/policies_on_family.py",
        "not left[HYBRID][motion.name] <= left[ALONE][motion.name]",
        "left[HYBRID][motion.name] > left[ALONE][motion.name]",
        POLICIES,
    ),
    Seed(
        "the baselines get the observer, too",
        "rtctl/experiments/policies.py",
        "return virtual.both(virtual.with_policy(policy), virtual.with_observer(0.0))",
        "return virtual.with_policy(policy)",
        POLICIES,
    ),
    Seed(
        "an observer is switched on and off by nobody",
        "rtctl/experiments/virtual.py",
        'simulation.params["observer_gain"] = gain',
        'simulation.params["observer_gain"] *= 1.0',
        POLICIES,
    ),
)
