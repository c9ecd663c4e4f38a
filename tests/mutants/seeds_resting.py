"""Seeded bugs of what tells a joint that rests from one that slides."""

from __future__ import annotations

from seed import Seed

RESTING = ("tests/unit/control/test_resting.py",)
PACE = ("tests/unit/control/test_pace.py",)

SEEDS = (
    Seed(
        "on bent bristles the help follows the hand at once",
        "rtctl/control/resting.py",
        "return min(alpha, times * p.rest_alpha[axis]) if is_bent(s, p, axis) else alpha",
        "return alpha",
        RESTING,
    ),
    Seed(
        "a hand that turns back is taken for one that rests",
        "rtctl/control/resting.py",
        "p.period_s > BENT_S",
        "p.period_s > 0.1 * BENT_S",
        RESTING,
    ),
    Seed(
        "a joint that creeps is taken for one that slides",
        "rtctl/control/resting.py",
        "return slides(s, axis) and (abs(s.velocity_rad_s[axis]) > creep_rad_s or is_admittance(s, axis))",
        "return slides(s, axis)",
        RESTING,
    ),
    Seed(
        "a joint that follows a slow mass is taken for one that rests",
        "rtctl/control/resting.py",
        " > creep_rad_s or is_admittance(s, axis))",
        " > creep_rad_s)",
        RESTING,
    ),
    Seed(
        "help on bent bristles follows the curve of a speed that they have not",
        "rtctl/control/resting.py",
        "return is_resting(s, p, axis) or (is_bent(s, p, axis) and not is_admittance(s, axis))",
        "return is_resting(s, p, axis)",
        RESTING,
    ),
    Seed(
        "an edge that a creeping joint crosses turns its help",
        "rtctl/control/feedforward.py",
        "        if is_bent(s, p, axis) and not is_admittance(s, axis):\n",
        "        if False:\n",
        RESTING,
    ),
    Seed(
        "the observer does not mind bent bristles",
        "rtctl/control/resting.py",
        "quick = while_bent(s, p, axis, alpha, OBSERVER_TIMES)",
        "quick = alpha",
        RESTING,
    ),
    Seed(
        "the observer of a resting joint follows the hand at once",
        "rtctl/control/resting.py",
        "min(quick, p.rest_alpha[axis] * (1.0 + CALMING_S / rest_s))",
        "quick",
        RESTING,
    ),
    Seed(
        "a resting joint follows the hand through one low-pass",
        "rtctl/control/resting.py",
        "before + share * (hand - before)",
        "before + 1.0 * (hand - before)",
        RESTING,
    ),
    Seed(
        "a hand's torque that is not a number stays",
        "rtctl/control/resting.py",
        "    if not math.isfinite(before):\n        before = 0.0\n",
        "",
        RESTING,
    ),
    Seed(
        "only counts tell rest",
        "rtctl/control/resting.py",
        "REST_SHARE = 0.05",
        "REST_SHARE = 0.0",
        RESTING,
    ),
    Seed(
        "presliding is sliding",
        "rtctl/control/resting.py",
        "0 if _moves_on(s, p, axis) else s.bent",
        "0 if True else s.bent",
        RESTING,
    ),
    Seed(
        "flicker between two counts is motion",
        "rtctl/control/resting.py",
        "REST_COUNTS = 1.5",
        "REST_COUNTS = 0.5",
        RESTING,
    ),
    Seed(
        "a joint that has not moved on for long is helped ever more",
        "rtctl/control/disturbance_observer.py",
        "slow = SLOW_SHARE + HELD_SHARE * held_part(s, p, axis)",
        "slow = SLOW_SHARE",
        ("tests/unit/control/test_disturbance_observer.py",),
    ),
    Seed(
        "a joint is held as soon as it stands",
        "rtctl/control/resting.py",
        "p.period_s - HELD_AFTER_S, 0.0)",
        "p.period_s, 0.0)",
        RESTING,
    ),
    Seed(
        "a joint that follows a standing mass is held",
        "rtctl/control/resting.py",
        "    if is_admittance(s, axis):\n        return 0.0\n",
        "",
        RESTING,
    ),
    Seed(
        "on a joint that slides the help turns with the hand's torque",
        "rtctl/control/feedforward.py",
        "    if slides_on(s, p, axis):\n        return way\n",
        "",
        PACE,
    ),
    Seed(
        "in the turn of a slow hand the intent follows it at once",
        "rtctl/control/feedforward.py",
        "(1.0 if is_slow(s, p, axis) else TURN_TIMES)",
        "TURN_TIMES",
        PACE,
    ),
    Seed(
        "in the turn of a brisk hand the intent flips the help at once, and soft bristles kick the joint "
        "back",
        "rtctl/control/feedforward.py",
        "(1.0 if is_slow(s, p, axis) else TURN_TIMES)",
        "(1.0 if is_slow(s, p, axis) else 99.0)",
        PACE,
    ),
    Seed(
        "the gate opens at the peaks of a ring",
        "rtctl/control/feedforward.py",
        "        hand = mean\n",
        "        pass\n",
        PACE,
    ),
    Seed(
        "the ring of a hand takes help away and gives it back",
        "rtctl/control/braking.py",
        "= eased(p, axis",
        "= (lambda *given: given[-2])(p, axis",
        PACE,
    ),
    Seed(
        "a ring in which the joint turns takes help away and gives it back",
        "rtctl/control/braking.py",
        "min(p.friction_gate_alpha[axis], MEAN_TIMES * p.rest_alpha[axis])",
        "p.friction_gate_alpha[axis]",
        PACE,
    ),
    Seed(
        "a hand that pulls back a joint that sticks is taken for one that brakes",
        "rtctl/control/braking.py",
        "slides_on(s, p, axis) and",
        "abs(s.bristle_share[axis]) >= 1.0 and",
        (
            "tests/unit/control/test_braking.py"
            "::test_a_hand_that_pulls_back_a_joint_that_sticks_is_helped_before_it_gives_way",
        ),
    ),
    Seed(
        "help goes on in the way of a joint that sticks",
        "rtctl/control/feedforward.py",
        "    if slides_on(s, p, axis):",
        "    if slides(s, axis):",
        PACE,
    ),
    Seed(
        "a joint that sticks turns its help as quickly as one that slides",
        "rtctl/control/feedforward.py",
        "not slides_on(s, p, axis) and not is_admittance",
        "not slides(s, axis) and not is_admittance",
        PACE,
    ),
    Seed(
        "the gate sinks between the peaks of a hand's ring",
        "rtctl/control/feedforward.py",
        "(GATE_TIMES if moves_on else 1.0)",
        "1.0",
        PACE,
    ),
    Seed(
        "the gate of a hand stays open when the joint has come to rest",
        "rtctl/control/feedforward.py",
        "moves_on = slides(s, axis) and not is_bent(s, p, axis) and",
        "moves_on =",
        PACE,
    ),
    Seed(
        "the gate opens at each peak of a hand's ring",
        "rtctl/control/feedforward.py",
        "if moves_on or wanted < s.friction_gate[axis]:",
        "if wanted < s.friction_gate[axis]:",
        (
            "tests/unit/control/test_feedforward.py"
            "::test_on_a_joint_that_slides_half_the_torque_opens_the_gate",
        ),
    ),
    Seed(
        "the ring of a hand leads the help in a quick turn",
        "rtctl/control/feedforward.py",
        "return blend(s.velocity_rad_s[axis], way, push, p.friction_blend_rad_s[axis])",
        "return push",
        PACE,
    ),
    Seed(
        "every hand is slow",
        "rtctl/control/pace.py",
        "s.pace_rad_s[axis] <= SLOW_BLENDS * p.friction_blend_rad_s[axis] and",
        "True and",
        PACE,
    ),
    Seed(
        "the hand of a virtual mass is slow",
        "rtctl/control/pace.py",
        " and not is_admittance(s, axis)",
        "",
        PACE,
    ),
    Seed(
        "the pace is the speed of this tick",
        "rtctl/control/pace.py",
        "min(p.period_s / PACE_S, 1.0) *",
        "1.0 *",
        PACE,
    ),
)
