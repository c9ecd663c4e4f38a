"""Damping behind the spring of an elastic joint that is credited though a hand takes it away (0158)."""

from __future__ import annotations

from seed import Seed

SURE = ("tests/unit/control/test_sure_damping.py",)

SEEDS = (
    Seed(
        "the account credits all the damping of an elastic joint",
        "rtctl/control/passivity.py",
        "max(p.sure_viscous_nms_rad[axis], 0.0)",
        "max(p.viscous_nms_rad[axis], 0.0)",
        SURE,
    ),
    Seed(
        "the plan calls all the damping of an elastic joint sure",
        "rtctl/check/axis_plan.py",
        "sure_damping(axis.viscous_nms_rad, joint)",
        "axis.viscous_nms_rad",
        SURE,
    ),
    Seed(
        "help in free motion lives on damping that a hand takes away",
        "rtctl/control/force_feedback.py",
        "        damping = p.sure_viscous_nms_rad[axis]",
        "        damping = p.viscous_nms_rad[axis]",
        SURE,
    ),
    Seed(
        "the joint's own damper is counted beside the link's, not in a row with it",
        "rtctl/check/devices_of_axis.py",
        "link * own / (link + own) if",
        "link + own if",
        SURE,
    ),
    Seed(
        "help takes its share of the damping behind the spring, too",
        "rtctl/check/stability_report.py",
        "guaranteed_nms_rad - taken_damping(axis.viscous_nms_rad, joint)",
        "guaranteed_nms_rad - taken_damping(guaranteed_nms_rad, joint)",
        SURE,
    ),
)
