"""Seeded bugs of the judge of hands that hold still."""

from __future__ import annotations

from seed import Seed

JUDGE = ("tests/unit/test_campaign_still.py",)

SEEDS = (
    Seed(
        "hands that share a gear have a force sensor each",
        "rtctl/simulation/campaign_still_cases.py",
        ".joint_hz, **_sensor(seed, first)}",
        ".joint_hz}",
        (f"{JUDGE[0]}::test_hands_that_share_a_gear_and_a_sensor_are_otherwise_their_own",),
    ),
    Seed(
        "the judge takes another angle than the hand's",
        "rtctl/simulation/campaign_still.py",
        'simulation.truth["position_rad"][:, 0])',
        'simulation.truth["position_rad"][:, 0] - simulation.truth["joint_twist_rad"][:, 0])',
        (f"{JUDGE[0]}::test_of_an_elastic_joint_the_hand_holds_the_link",),
    ),
    Seed(
        "a joint that goes farther without help excuses what rings with it",
        "rtctl/simulation/campaign_still.py",
        "if farther > 1.0 and not alone.swing_rad <= found.swing_rad:",
        "if False:",
        JUDGE,
    ),
    Seed(
        "the ring of a motion is looked for in one phase only",
        "rtctl/simulation/campaign_still.py",
        "for later_s in LATER_S:",
        "for later_s in LATER_S[:1]:",
        JUDGE,
    ),
    Seed(
        "a ring that does not die away is the joint's own",
        "rtctl/simulation/campaign_still.py",
        "alone.speed_rad_s and as_long:",
        "alone.speed_rad_s:",
        JUDGE,
    ),
)
