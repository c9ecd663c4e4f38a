"""Seeded bugs that a fourth reading found: units and commands in what is told, and what was left behind after
something had failed.
"""

from __future__ import annotations

from seed import Seed

STILL = ("tests/unit/test_campaign_still.py",)

SEEDS = (
    Seed(
        "monitor tells the offset of a carriage in mN m",
        "rtctl/cli/monitor_text.py",
        'motions.get(one["axis"], "rotary")) for',
        '"rotary") for',
        ("tests/unit/test_monitor.py",),
    ),
    Seed(
        "drift gives the motion of the first axis to the first one that can be watched",
        "rtctl/cli/drift.py",
        'motions[one["axis"]]} for one in found]',
        "motion} for one, motion in zip(found, reader.motions)]",
        ("tests/unit/cli/test_rig_of_both_motions.py",),
    ),
    Seed(
        "the command of a loud case leaves out the policies it was drawn among",
        "rtctl/simulation/campaign_still.py",
        "--rig {index}{named}{held}",
        "--rig {index}{held}",
        STILL,
    ),
    Seed(
        "the command of a loud case leaves out how long its hand held",
        "rtctl/simulation/campaign_still.py",
        "--rig {index}{named}{held}",
        "--rig {index}{named}",
        STILL,
    ),
    Seed(
        "a ball of a world that the daemon refused moves a wall",
        "rtctl/client/view_world.py",
        'if kind == "ball":\n                values',
        'if kind == "ball":\n                self._ball = Ball(values[CENTER.name])\n                values',
        ("tests/unit/test_world.py",),
    ),
    Seed(
        "a door that is cut still reads away a message of the connections before",
        "rtctl/wire/long_messages.py",
        "self._openings, self._read_away = self.door.openings, 0",
        "self._openings = self.door.openings",
        ("tests/unit/host/test_frames.py",),
    ),
)
