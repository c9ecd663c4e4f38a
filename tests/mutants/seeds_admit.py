"""Help that acts at the motor of an elastic joint, and is counted as if it took of the link (0164)."""

from __future__ import annotations

from seed import Seed

SURE = ("tests/unit/control/test_sure_damping.py",)

BRAKE = "test_a_brake_that_has_stopped_a_joint_is_one_that_no_hand_makes_ring"
PROGRAM = (f"tests/unit/control/test_program.py::{BRAKE}",)

SEEDS = (
    Seed(
        "behind a virtual mass help takes its share of the link's damping, too",
        "rtctl/check/admittance_figures.py",
        "        viscous_nms_rad=figures.total_damping_nms_rad,\n",
        "        viscous_nms_rad=figures.total_damping_nms_rad,\n"
        "        link_viscous_nms_rad=(1 - joint.motor_share) * figures.total_damping_nms_rad,\n",
        SURE,
    ),
    Seed(
        "the motor of an elastic joint keeps the link's damping besides",
        "rtctl/control/proofs/drive_in_hand.py",
        "b_m, b_l = b - behind + ",
        "b_m, b_l = b + ",
        SURE,
    ),
    Seed(
        "between the points the motor keeps the link's damping besides",
        "rtctl/control/proofs/admittance_spectrum.py",
        "return self.loop.viscous_nms_rad - behind + own, behind",
        "return self.loop.viscous_nms_rad + own, behind",
        ("tests/unit/control/test_admittance_proof.py",),
    ),
    Seed(
        "a brake that has stopped a joint goes on with the servo's damping",
        "rtctl/control/program.py",
        "        damping = min(damping, p.hold_damping_nms_rad[axis])",
        "        damping = min(damping, math.inf)",
        PROGRAM,
    ),
    Seed(
        "a brake is weak from the first tick",
        "rtctl/control/program.py",
        "                s.program_speed_rad_s[axis] = s.program_velocity_rad_s[axis]\n",
        "                s.program_speed_rad_s[axis] = 0.0\n",
        PROGRAM,
    ),
    Seed(
        "a joint without friction on the motor's side divides by nothing",
        "rtctl/friction/guarantee.py",
        "    if dry_share == 0.0:",
        "    if dry_share < 0.0:",
        ("tests/unit/friction/test_guarantee.py",),
    ),
    Seed(
        "help takes its share of the link's dry friction",
        "rtctl/friction/margins.py",
        "(dry_share * c.F_lo - c.ff)",
        "(dry_share * (c.F_lo - c.ff))",
        SURE,
    ),
)
