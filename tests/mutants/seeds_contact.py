"""Seeded bugs of the help in contact with a world."""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/control"
PACE = (f"{UNIT}/test_pace.py",)
RESTING = (f"{UNIT}/test_resting.py",)
LAW = (f"{UNIT}/test_contact.py",)

SEEDS = (
    Seed(
        "who leans on a world is helped into it", "rtctl/control/feedforward.py",
        "s.calm_hand_nm[axis] + s.calm_world_nm[axis]", "s.calm_hand_nm[axis]", PACE,
    ),
    Seed(
        "the world pushes the wrong way", "rtctl/control/feedforward.py",
        "s.calm_hand_nm[axis] + s.calm_world_nm[axis]", "s.calm_hand_nm[axis] - s.calm_world_nm[axis]", PACE,
    ),
    Seed(
        "the world's torque is followed at once at rest", "rtctl/control/resting.py",
        "share * (world - s.calm_world_nm[axis])", "(world - s.calm_world_nm[axis])",
        RESTING,
    ),
    Seed(
        "a torque of the world that is no number stays", "rtctl/control/resting.py",
        "        s.calm_world_nm[axis] = 0.0\n", "        pass\n", RESTING,
    ),
    Seed(
        "the law forgets the world as it asks where the joint is pushed", "rtctl/control/law.py",
        "s.authority * t.coupling_torque_nm[axis])", "0.0)", LAW,
    ),
)  # fmt: skip
