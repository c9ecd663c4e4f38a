"""Seeded bugs of what `rtctl check` proves: the sampled loop behind delay and lag, who says how late,
verdicts.
"""

from __future__ import annotations

from seed import Seed

LOOP = ("tests/unit/control/test_sampled_loop.py",)
CHECK = ("tests/unit/cli/test_check.py", "tests/unit/cli/test_check_plausibility.py")
OBSERVER = ("tests/unit/control/test_observer_margin.py",)
FRICTION = ("tests/unit/cli/test_check_friction.py",)
ADMITTANCE = ("tests/unit/control/test_admittance_margin.py", "tests/unit/control/test_admittance_proof.py")
DISPLAY = ("tests/unit/cli/test_check_admittance.py",)
DECLARED = ("tests/unit/hw/test_declared.py",)

SEEDS = (
    Seed(
        "a fraction of a tick of delay is left out",
        "rtctl/control/proofs/sampled_loop.py",
        "    inner = 1 - (f + tau) * (1 - back)\n",
        "    inner = 1 - tau * (1 - back)\n",
        LOOP,
    ),
    Seed(
        "the lag turns the phase but does not weaken",
        "rtctl/control/proofs/sampled_loop.py",
        "    return np.asarray(1 - 2 * tau * sine2",
        "    return np.asarray(1 - 0 * tau * sine2",
        LOOP,
    ),
    Seed(
        "a delay that may be shorter is proved at its longest only",
        "rtctl/control/proofs/stability.py",
        "    delays = [float(k) for k in range(math.ceil(between.delay))] + [between.delay]",
        "    delays = [between.delay]",
        LOOP,
    ),
    Seed(
        "a delay that changes is taken at its longest",
        "rtctl/control/proofs/stability.py",
        "        low = max(between.delay - between.jitter, 0.0)",
        "        low = between.delay",
        LOOP,
    ),
    Seed(
        "held samples cost no more than their longer period",
        "rtctl/control/proofs/held_samples.py",
        "rows[:, i, i] += b_c / (n * T if i == 0 else T)",
        "rows[:, i, i] += b_c / (n * T if i == 0 else 1e9)",
        LOOP,
    ),
    Seed(
        "old samples are proved behind a delay that does not change",
        "rtctl/control/proofs/stability.py",
        "held_samples.damping_needed(k_c, b_c, T, n, d, lag, min(between.jitter, d), over)",
        "held_samples.damping_needed(k_c, b_c, T, n, d, lag, 0.0, over)",
        LOOP,
    ),
    Seed(
        "a delay that changes is proved with the slowest current loop only",
        "rtctl/control/proofs/stability.py",
        "        lags = {(lag_ticks(hz, T), over) for _, hz, over in cases}\n",
        "        lags = {(lag_ticks(between.lag_hz, T), between.overshoot)}\n",
        LOOP,
    ),
    Seed(
        "old samples are proved with the slowest current loop only",
        "rtctl/control/proofs/stability.py",
        "    return {(0.0, 0.0), (lag, 0.0), *some}\n",
        "    return {(lag, over), *()}\n",
        LOOP,
    ),
    Seed(
        "behind a lag a delay that changes is one of whole ticks",
        "rtctl/control/proofs/sampled_loop.py",
        "- beyond(m - 1 + jitter) + beyond(m + jitter)",
        "- beyond(m - 1 + math.ceil(jitter)) + beyond(m + math.ceil(jitter))",
        LOOP,
    ),
    Seed(
        "what a device declares does not count",
        "rtctl/check/lateness.py",
        "    return [claim] if names else [], undeclared",
        "    return [], undeclared",
        (*CHECK, *DECLARED),
    ),
    Seed(
        "what was measured does not count",
        "rtctl/check/lateness.py",
        "    late = max(claims, key=lambda claim: claim.between.delay)",
        "    late = max(claims[:-1], key=lambda claim: claim.between.delay)",
        CHECK,
    ),
    Seed(
        "all the damping of an elastic joint counts",
        "rtctl/check/devices_of_axis.py",
        "    return joint.motor_share * b_nms_rad + (",
        "    return b_nms_rad + (",
        CHECK,
    ),
    Seed(
        "dry friction damps small motions",
        "rtctl/check/stability_report.py",
        "    return found, min(secant, axis.viscous_nms_rad), found.dry_left_nm,",
        "    return found, secant, found.dry_left_nm,",
        CHECK,
    ),
    Seed(
        "a bound of the intent that is rounded to 0 divides",
        "rtctl/check/verdicts_of_friction.py",
        "lowpass_hz / later_hz if later_hz > 0 else math.inf",
        "lowpass_hz / later_hz",
        (
            "tests/unit/cli/test_check_friction.py"
            "::test_an_intent_that_only_a_low_pass_below_a_tenth_of_a_hertz_would_settle_is_told",
        ),
    ),
    Seed(
        "a shake by the encoder's steps is never refused",
        "rtctl/check/verdicts_of_loop.py",
        "Outcome.FAIL if shake > _felt_rad_s(s) else outcome",
        "outcome",
        CHECK,
    ),
    Seed(
        "a figure that is no number is told only",
        "rtctl/check/verdicts_of_units.py",
        "return Outcome.WARN if self.least <= value <= self.most else Outcome.FAIL",
        "return Outcome.FAIL if value < self.least or value > self.most else Outcome.WARN",
        CHECK,
    ),
    Seed(
        "ends of a travel in mm are believed",
        "rtctl/check/verdicts.py",
        "    verdicts_of_motion.travel,\n",
        "",
        CHECK,
    ),
    Seed(
        "the worst row stands first",
        "rtctl/check/verdict.py",
        "key=lambda row: (row.outcome,",
        "key=lambda row: (-row.outcome,",
        CHECK,
    ),
    Seed(
        "a failing test is only printed",
        "rtctl/check/stability_report.py",
        "return all(row.outcome != Outcome.FAIL for row in self.verdicts)",
        "return all(row.name for row in self.verdicts)",
        CHECK,
    ),
    Seed(
        "the observer's loop forgets the fraction of a delay",
        "rtctl/control/proofs/drive_in_hand.py",
        "    rest = max(late - whole, 0.0)\n",
        "    rest = 0.0\n",
        OBSERVER,
    ),
    Seed(
        "the first hand's motion stands for that of all hands",
        "rtctl/control/proofs/drive_in_hand.py",
        "    differs[1:] = (A[1:] != A[:-1]).any(axis=(1, 2))\n",
        "    differs[1:] = False\n",
        OBSERVER,
    ),
    Seed(
        "the observer's loop knows a hand without its mass",
        "rtctl/control/proofs/drive_in_hand.py",
        "    hand = -points.m_h[:, None] * A[np.arange(n), moving]\n",
        "    hand = 0 * A[np.arange(n), moving]\n",
        OBSERVER,
    ),
    Seed(
        "the hand's torque is taken a period before the acceleration",
        "rtctl/control/disturbance_observer.py",
        "    hand = s.hand_torque_before_nm[axis]\n",
        "    hand = t.hand_torque_nm[axis]\n",
        OBSERVER,
    ),
    Seed(
        "a vibration that is hardly damped any more passes",
        "rtctl/control/proofs/observer_margin.py",
        "return self.radius <= 1 + TOLERANCE and self.kept >= KEPT_LEAST",
        "return not self.radius > 1 + TOLERANCE",
        OBSERVER,
    ),
    Seed(
        "a policy that shakes a resting hand is only told of on a real rig",
        "rtctl/check/verdicts_of_friction.py",
        "    beyond = Outcome.WARN if s.simulated else Outcome.FAIL\n",
        "    beyond = Outcome.WARN\n",
        FRICTION,
    ),
    Seed(
        "help is proved of hands that move the joint",
        "rtctl/check/verdicts_of_motion.py",
        "            Outcome.NOT_PROVED,\n",
        "            Outcome.PASS,\n",
        FRICTION,
    ),
    Seed(
        "a presliding length that nobody measured proves the account",
        "rtctl/check/verdicts_of_friction.py",
        "            Outcome.PASS if sure.measured else Outcome.NOT_PROVED,\n            text,",
        "            Outcome.PASS,\n            text,",
        FRICTION,
    ),
    Seed(
        "the intent's loop has no delay",
        "rtctl/check/verdicts_of_friction.py",
        "        low, high = (alpha, high) if np.abs(roots).max() < 1 else (low, alpha)\n",
        "        low, high = (alpha, high) if alpha * (1 + lead) < 2 else (low, alpha)\n",
        FRICTION,
    ),
    Seed(
        "a coarse encoder is only told of",
        "rtctl/check/verdicts_of_observer.py",
        "Outcome.WARN if share <= NOISE_MOST else Outcome.FAIL",
        "Outcome.WARN",
        FRICTION,
    ),
    Seed(
        "a count may be as long as it likes",
        "rtctl/check/verdicts_of_friction.py",
        "    seen = share <= most\n",
        "    seen = True\n",
        ("tests/unit/cli/test_check_friction.py",),
    ),
    Seed(
        "a virtual mass whose world does not hold it",
        "rtctl/control/proofs/admittance_loop.py",
        "(loop.mass_kgm2 * v_r + T * (felt - k_e * x_r + calms * calm)) / weight",
        "(loop.mass_kgm2 * v_r + T * (felt + calms * calm)) / weight",
        ADMITTANCE,
    ),
    Seed(
        "a proof for which any directions will do",
        "rtctl/control/proofs/admittance_proof.py",
        "(off - angle).min(axis=axes) < math.pi - _INWARD",
        "(off - angle).min(axis=axes) < 9.0",
        ADMITTANCE,
    ),
    Seed(
        "the aliases are forgotten",
        "rtctl/control/proofs/admittance_spectrum.py",
        " - C_x * R_x - C_f * R_t\n",
        "\n",
        ADMITTANCE,
    ),
    Seed(
        "an admittance that grows is only told of",
        "rtctl/check/verdicts_of_admittance.py",
        "Outcome.FAIL if not one.stable else Outcome.PASS if one.proved else Outcome.NOT_PROVED",
        "Outcome.PASS if one.proved else Outcome.NOT_PROVED",
        DISPLAY,
    ),
    Seed(
        "what is not proved between the points passes",
        "rtctl/check/verdicts_of_admittance.py",
        "Outcome.PASS if one.proved else Outcome.NOT_PROVED",
        "Outcome.PASS",
        DISPLAY,
    ),
    Seed(
        "what a device cuts off is not told",
        "rtctl/check/verdicts_of_device.py",
        "Outcome.PASS if fits else Outcome.WARN",
        "Outcome.PASS",
        ("tests/unit/cli/test_check_plausibility.py::test_a_current_that_the_device_cuts_off_is_told",),
    ),
)
