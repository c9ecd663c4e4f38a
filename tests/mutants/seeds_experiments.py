"""Seeded bugs of the experiments: what a policy is judged by, and what the page says of it."""

from __future__ import annotations

from seed import Seed

POLICIES = ("tests/unit/experiments/test_policies.py",)
SIZES = ("tests/unit/experiments/test_sizes_of_an_axis.py",)

SEEDS = (
    Seed(
        "a comparison goes on without the model that it is of",
        "rtctl/experiments/models.py",
        "if not any(one.name in SVR for one in models):",
        "if len(models) == 1:",
        (
            "tests/unit/experiments/test_positioning.py"
            "::test_a_comparison_without_a_support_vector_model_is_refused_before_anything_moves",
        ),
    ),
    Seed(
        "formulas may be asked for alone",
        "rtctl/cli/experiment.py",
        "if not set(models) & set(SVR):",
        "if False:",
        (
            "tests/unit/experiments/test_positioning.py"
            "::test_a_comparison_without_a_support_vector_model_is_refused_before_anything_moves",
        ),
    ),
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
    Seed(
        "bars of a carriage are labelled in mrad",
        "rtctl/experiments/comparison.py",
        "order.motion, scale)",
        '"rotary", scale)',
        SIZES,
    ),
    Seed(
        "a motion leaves the travel on its shorter side",
        "rtctl/experiments/sizes.py",
        "left = [USED_SHARE * min(up, down) / reach_rad]",
        "left = [USED_SHARE * max(up, down) / reach_rad]",
        SIZES,
    ),
    Seed(
        "a carriage is wished as far away as a joint is turned",
        "rtctl/experiments/sizes.py",
        'factor = own_size("reach_rad", 1.0, axis.motion)',
        "factor = 1.0",
        SIZES,
    ),
    Seed(
        "a hand holds a carriage as loosely as a joint",
        "rtctl/experiments/virtual.py",
        'motion = "rotary" if told else',
        'motion = "rotary" if not told else',
        SIZES,
    ),
    Seed(
        "a page of a carriage tells N m",
        "rtctl/experiments/report.py",
        "return reworded(own, lambda text: words(text, motion))",
        "return own",
        SIZES,
    ),
    Seed(
        "a rig that stopped is told without its first fault",
        "rtctl/control/vocabulary.py",
        "if first >= 0:\n        return f",
        "if first > 99:\n        return f",
        SIZES,
    ),
)
