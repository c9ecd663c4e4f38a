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
    Seed(
        "a point of a carriage that is left out is told in rad/s and N m",
        "rtctl/cli/fit_points.py",
        """without_outliers(points)
    for note in notes:
        click.echo(words(f"warning: {note}", points.motion), err=True)""",
        """without_outliers(points)
    for note in notes:
        click.echo(f"warning: {note}", err=True)""",
        ("tests/unit/cli/test_words_of_a_linear_rig.py",),
    ),
    Seed(
        "a log of a carriage tells what it leaves out in N m",
        "rtctl/cli/fit_points.py",
        """require_enough(points)
    for note in notes:
        click.echo(words(f"warning: {note}", points.motion), err=True)""",
        """require_enough(points)
    for note in notes:
        click.echo(f"warning: {note}", err=True)""",
        ("tests/unit/cli/test_words_of_a_linear_rig.py",),
    ),
    Seed(
        "the demonstration of a carriage ends in N m",
        "rtctl/cli/demo.py",
        "*(words(line, motion) for line in torque)",
        "*torque",
        ("tests/unit/cli/test_init.py",),
    ),
    Seed(
        "the picture of the demonstration of a carriage is in N m",
        "rtctl/cli/demo_figure.py",
        'words("torque of the hand, N m", motion)',
        '"torque of the hand, N m"',
        ("tests/unit/test_demo_figure.py",),
    ),
    Seed(
        "an experiment on a carriage tells what went wrong in rad/s",
        "rtctl/cli/experiment.py",
        "errors_in_units_of(motion)",
        'errors_in_units_of("rotary")',
        ("tests/unit/cli/test_experiment_without_help.py",),
    ),
    Seed(
        "an experiment on a carriage announces in rad/s",
        "rtctl/cli/experiment.py",
        "quiet=as_json, motion=motion)",
        "quiet=as_json)",
        ("tests/unit/cli/test_experiment_without_help.py",),
    ),
    Seed(
        "a replay of carriages tells of torques",
        "rtctl/cli/replay.py",
        "words(same, _motion(reader))",
        "same",
        ("tests/unit/cli/test_words_of_a_linear_rig.py",),
    ),
)
