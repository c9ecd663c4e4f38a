"""Damping of an elastic joint that is shared out twice, or not where it has to be, and what is not proved and
not said (0175)."""

from __future__ import annotations

from seed import Seed

TOLD = ("tests/unit/test_damping_is_told_whole.py",)
ROLL_OFF = ("tests/unit/friction/test_roll_off.py",)
CHECK = ("tests/unit/cli/test_check.py::test_a_passing_file_prints_ok_and_exits_0",)

SEEDS = (
    Seed(
        "a shipped rig is told the motor's damping, of which its share is taken again",
        "configs/mock-elastic.toml",
        "viscous_nms_rad = 0.05              # b: of motor",
        "viscous_nms_rad = 0.04              # b: of motor",
        TOLD,
    ),
    Seed(
        "the family's elastic plants are told the motor's damping, of which its share is taken again",
        "rtctl/simulation/family.py",
        '_ELASTIC_TOLD: Change = {"coupling"',
        '_ELASTIC_TOLD: Change = {"viscous_nms_rad": 0.04, "coupling"',
        TOLD,
    ),
    Seed(
        "a map of one mass calls proved what a hand behind an elastic joint takes away",
        "rtctl/simulation/certificate.py",
        "return sure_damping(loaded.config.axis[0].viscous_nms_rad, joint_of_axis(loaded, 0))",
        "return loaded.config.axis[0].viscous_nms_rad",
        TOLD,
    ),
    Seed(
        "help ends as steeply as the damping of a declared gear's link allows",
        "rtctl/friction/roll_off.py",
        "(axis.viscous_nms_rad - taken_nms_rad) / against",
        "axis.viscous_nms_rad / against",
        ROLL_OFF,
    ),
    Seed(
        "the law ends its help as steeply as the damping of a link allows",
        "rtctl/check/law_plan.py",
        "axis, T, between, taken_damping(axis.viscous_nms_rad, joint))",
        "axis, T, between)",
        ROLL_OFF,
    ),
    Seed(
        "the check takes the damping of a link for the motor's",
        "rtctl/check/stability_report.py",
        "of_joint = joint.dry_share, taken_damping(axis.viscous_nms_rad, joint)",
        "of_joint = joint.dry_share, 0.0",
        ROLL_OFF,
    ),
    Seed(
        "a check calls the coupling passive with whatever a row of it does not prove",
        "rtctl/cli/check.py",
        '", but for what is not proved" if unproved',
        '", but for what is not proved" if odd',
        CHECK,
    ),
    Seed(
        "an arm does not say what is not proved",
        "rtctl/cli/operate.py",
        'told.get("not_proved", ())',
        'told.get("unproved", ())',
        ("tests/unit/host/test_requests.py",),
    ),
)
