"""Seeded bugs that a fifth reading found: bad samples, a lease kept too long, options that nobody read."""

from __future__ import annotations

from seed import Seed

WORLD = ("tests/unit/test_world.py",)

SEEDS = (
    Seed(
        "a ball keeps the NaN of one bad sample for ever",
        "rtctl/client/view_world.py",
        "BALL_STIFFNESS_NM_RAD * deep_rad if 0.0 < deep_rad < math.inf else 0.0",
        "BALL_STIFFNESS_NM_RAD * max(deep_rad, 0.0)",
        WORLD,
    ),
    Seed(
        "a ball keeps the lease of the drag before it",
        "rtctl/client/view_world.py",
        'if kind != "drag" and self._lease is not None:',
        'if kind not in {"drag", "ball"} and self._lease is not None:',
        WORLD,
    ),
    Seed(
        "campaign --rig passes over how many rigs were asked for",
        "rtctl/cli/campaign.py",
        '{"rigs", "jobs", "first"}, "means',
        '{"jobs", "first"}, "means',
        ("tests/unit/cli/test_unread_options.py",),
    ),
    Seed(
        "nothing is looked for beyond the last doubled step",
        "rtctl/simulation/campaign_margins.py",
        "if high >= FARTHEST:",
        "if high >= 0.7 * FARTHEST:",
        ("tests/unit/test_campaign_distance.py",),
    ),
)
