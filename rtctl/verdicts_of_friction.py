"""Tests of friction model and feed-forward."""

from __future__ import annotations

from rtctl.verdict import Outcome, Subject, Verdict


def two_lines(s: Subject) -> list[Verdict]:
    """The feed-forward below the friction whatever its sign: not proved where a gate is what keeps the sign right."""
    found = s.axis.friction
    if found is None or found.feedforward_max_nm == 0:
        return []
    passed = found.two_line_margin_nm >= 0
    return [
        s.row(
            "feed-forward of any sign (two-line)",
            f"{found.two_line_margin_nm:+.4g} N m",
            ">= 0",
            Outcome.PASS if passed else Outcome.NOT_PROVED,
            "passive whatever sign or delay the feed-forward errs by"
            if passed
            else "a feed-forward of the wrong sign would exceed the friction: that it has the right one rests on the force "
            "gate and on the account of energy while the rig runs",
            1.0 - found.two_line_margin_nm / max(found.friction_floor_nm, 1e-9),
        )
    ]


def damping_and_model(s: Subject) -> list[Verdict]:
    """`viscous_nms_rad` alone may not be more than all the friction that the model was taught."""
    found = s.axis.friction
    if found is None:
        return []
    b, most = s.table.viscous_nms_rad, found.drag_nms_rad
    passed = b <= most
    return [
        s.row(
            "viscous_nms_rad against the model",
            f"{b:.4g} N m s/rad",
            f"<= {most:.4g}",
            Outcome.PASS if passed else Outcome.FAIL,
            "all the friction that was measured, over speed, where that is least",
            b / most if most > 0 else 2.0,
            ""
            if passed
            else f"{s.where}.viscous_nms_rad: axis {s.axis.name}: {b:g} alone would be more than all the friction that the "
            f"model was taught at {found.drag_speed_rad_s:.3g} rad/s, the bound is {most:.4g} N m s/rad: measure it again "
            "(rtctl identify), or look for a wrong unit",
        )
    ]
