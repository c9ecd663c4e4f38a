"""Seeded bugs of the feed-forward that follows the friction: each of its bounds, the pace, what freezes it,
what it goes on from.
"""

from __future__ import annotations

from seed import Seed

PURE = ("tests/unit/friction/test_adaptation.py",)
WATCH = ("tests/unit/friction/test_followed_drift.py",)
LAW = ("tests/unit/control/test_friction_factor.py",)
CHECK = ("tests/unit/cli/test_check_followed_friction.py",)
HERE = ("tests/unit/friction/test_drift_here.py",)
HOST = ("tests/unit/host/test_friction_watch.py",)

SEEDS = (
    Seed(
        "a factor that is to be held goes on", "rtctl/friction/drift_watch.py",
        " or not self.following", "", ("tests/unit/host/test_friction_watch.py",),
    ),
    Seed(
        "an axis that was judged as learned is told to follow", "rtctl/host/exchange/requests.py",
        "if why and on:", "if False:", ("tests/unit/host/test_adapt_request.py",),
    ),
    Seed(
        "friction is followed at once", "rtctl/friction/adaptation.py",
        "min(max(wanted, factor - step), factor + step)", "wanted", PURE,
    ),
    Seed(
        "friction is followed below .7", "rtctl/friction/adaptation.py",
        "factor + step), bounds.least), bounds.most)", "factor + step), 0.0), bounds.most)", PURE,
    ),
    Seed(
        "friction is followed above what was judged", "rtctl/friction/adaptation.py",
        "bounds.least), bounds.most)", "bounds.least), 9.0)", PURE,
    ),
    Seed(
        "a doubtful estimate raises the feed-forward", "rtctl/friction/adaptation.py",
        "found.factor_error <= TIGHT and ", "", PURE,
    ),
    Seed(
        "an estimate of another session raises the feed-forward", "rtctl/friction/adaptation.py",
        " and found.session_seconds >= SESSION_S", "", PURE,
    ),
    Seed(
        "a doubtful estimate is followed to its middle", "rtctl/friction/adaptation.py",
        "min(factor, found.factor + SURE * found.factor_error)", "min(factor, found.factor)", PURE,
    ),
    Seed(
        "a frozen factor moves", "rtctl/friction/adaptation.py", " and not frozen", "", PURE,
    ),
    Seed(
        "an estimate that is no number is followed", "rtctl/friction/adaptation.py",
        " and math.isfinite(found.factor + found.factor_error)", "", PURE,
    ),
    Seed(
        "the two-line test does not bound the factor", "rtctl/friction/adaptation.py",
        "found.two_line_margin_nm >= 0 and _secant(found)", "_secant(found)", PURE,
    ),
    Seed(
        "the factor takes damping that the coupling is proved with", "rtctl/friction/adaptation.py",
        " and _secant(found) >= least_nms_rad", "", PURE,
    ),
    Seed(
        "the cap passes its own bound", "rtctl/friction/adaptation.py",
        "min(FACTOR_MOST, CAP_SHARE_MAX / max(axis.friction.cap_share, 1e-9))", "FACTOR_MOST", PURE,
    ),
    Seed(
        "the cap stays as learned", "rtctl/friction/adaptation.py",
        '("gain", "viscous_gain", "load_gain", "cap_share")', '("gain", "viscous_gain", "load_gain")', PURE,
    ),
    Seed(
        "standing still pays for motion", "rtctl/friction/drift_watch.py",
        "axis.adapt(len(found.velocity) / axis.rate_hz", "axis.adapt(len(rows) * 1e-3", WATCH,
    ),
    Seed(
        "a fault does not freeze the factor", "rtctl/friction/drift_watch.py",
        'bool((rows["faults"] != 0).any()) or not moving[-1]', "not moving[-1]", WATCH,
    ),
    Seed(
        "the factor moves with the motor off", "rtctl/friction/drift_watch.py",
        'bool((rows["faults"] != 0).any()) or not moving[-1]', 'bool((rows["faults"] != 0).any())', WATCH,
    ),
    Seed(
        "a STOP does not freeze the factor", "rtctl/friction/drift_watch.py",
        "frozen = faulty or bool(self.stopped)", "frozen = faulty", WATCH,
    ),
    Seed(
        "a feed-forward that has followed is stopped as if it had not", "rtctl/friction/drift_watch.py",
        "return compensation * factor / float(self._largest[a])",
        "return compensation / float(self._largest[a])",
        WATCH,
    ),
    Seed(
        "a restart goes on beyond the bounds of now", "rtctl/friction/drift_watch.py",
        "self.factor = min(max(factor, self.bounds.least), self.bounds.most)", "self.factor = factor", WATCH,
    ),
    Seed(
        "a restart begins as learned", "rtctl/friction/drift_state.py",
        'factor=_factor(kept.get("factor"))', "factor=1.0", WATCH,
    ),
    Seed(
        "a factor that is no number is taken up", "rtctl/friction/drift_state.py",
        " and math.isfinite(kept)", "", WATCH,
    ),
    Seed(
        "the law follows at once", "rtctl/control/friction_factor.py",
        "        if is_powered(s.state):\n", "        if False:\n", LAW,
    ),
    Seed(
        "the law follows above what was judged", "rtctl/control/friction_factor.py",
        "min(asked, p.friction_raise[axis])", "asked", LAW,
    ),
    Seed(
        "the law follows below .7", "rtctl/control/friction_factor.py",
        "max(min(asked, p.friction_raise[axis]), _LEAST)", "min(asked, p.friction_raise[axis])", LAW,
    ),
    Seed(
        "the law follows what is no number", "rtctl/control/friction_factor.py",
        " and asked == asked:", ":", LAW,
    ),
    Seed(
        "an axis that follows nothing does", "rtctl/control/friction_factor.py",
        "if step > 0.0 and asked", "if asked", LAW,
    ),
    Seed(
        "the feed-forward does not follow", "rtctl/control/feedforward.py",
        "t.compensation[axis] * followed_share(s, p, axis) * gate", "t.compensation[axis] * gate", LAW,
    ),
    Seed(
        "the largest factor counts as what was learned", "rtctl/control/friction_factor.py",
        " / (1.0 + p.friction_raise[axis])", "", LAW,
    ),
    Seed(
        "the law is asked for nothing", "rtctl/host/exchange/friction_watch.py",
        "        self._asked = asked\n        return asked\n", "        return None\n", HOST,
    ),
    Seed(
        "friction beyond the bounds is not told", "rtctl/host/exchange/friction_watch.py",
        "(adaptation.BOUND, bound)", '(adaptation.BOUND, "")', HOST,
    ),
    Seed(
        "the law is planned as learned where it may go higher", "rtctl/check/law_plan.py",
        "model[a] = _fill_friction(p, a, most, config, ending)",
        "model[a] = _fill_friction(p, a, axis, config, ending)", CHECK,
    ),
    Seed(
        "cogging follows the friction", "rtctl/check/law_plan.py",
        "fill_place(p, a, axis, learned)", "fill_place(p, a, most, learned)", CHECK,
    ),
    Seed(
        "the certificate is of the friction as learned", "rtctl/check/stability_report.py",
        "    axis, factor = largest_feedforward(axis, model, T)",
        "    factor = largest_feedforward(axis, model, T)[1]", CHECK,
    ),
    Seed(
        "a model's doubt of sticking hides a drift of sliding", "rtctl/friction/drift_verdict.py",
        "by.doubt_of_sliding_nm(found.place_trust) / found.dry_nm", "by.doubt_nm / found.dry_nm",
        ("tests/unit/friction/test_drift.py"
         "::test_a_model_that_is_in_doubt_where_the_joint_may_stick_hides_no_drift_of_its_sliding",),
    ),
    Seed(
        "what places differ by is told as drift", "rtctl/friction/drift_verdict.py",
        "if _changed(found.factor, found.factor_error, most, warned=warned):",
        "if _changed(found.factor, found.factor_error, TOLD_SHARE * warn_share, warned=warned):", HERE,
    ),
    Seed(
        "a place is remembered as it is now", "rtctl/friction/drift_here.py",
        "alike[0].found if alike else None, as_quick", "None, as_quick", HERE,
    ),
    Seed(
        "a hand that goes elsewhere ends the warning", "rtctl/friction/drift_watch.py",
        "if known or not warned or not", "if True or not", HERE,
    ),
    Seed(
        "viscous friction that changes in view is what the model errs by", "rtctl/friction/drift_here.py",
        "if not abs(found.viscous - before.viscous) > SURE * error:", "if True:",
        ("tests/unit/friction/test_drift_beside.py"
         "::test_viscous_friction_that_changes_in_view_is_no_dry_friction",),
    ),
    Seed(
        "strokes before and after a change of viscous friction tell together what of it is dry",
        "rtctl/friction/drift_here.py", "if found.viscous_error > MIXED * before.viscous_error:", "if False:",
        ("tests/unit/friction/test_drift_beside.py"
         "::test_strokes_that_tell_viscous_friction_worse_than_before_know_the_factor_no_better_than_beside_it",),
    ),
    Seed(
        "a warning of one place goes while the hand goes to another", "rtctl/friction/drift_watch.py",
        "known = before is not None and stayed(found, self.strokes)", "known = before is not None",
        ("tests/unit/friction/test_drift_here.py::test_a_tenth_is_told_at_a_place_that_was_seen_before",),
    ),
    Seed(
        "what was before a sudden change stays in the window", "rtctl/friction/drift_change.py",
        "if _changed(table, newest, rate_hz):", "if False:",
        ("tests/unit/friction/test_drift_change.py::test_a_factor_is_not_between_what_was_and_what_is",),
    ),
    Seed(
        "strokes are forgotten without a change", "rtctl/friction/drift_change.py",
        "return worth > LEAST and float", "return bool(worth) or float",
        ("tests/unit/friction/test_drift_change.py"
         "::test_nothing_is_forgotten_where_nothing_has_changed_or_a_zero_swings",),
    ),
    Seed(
        "points that may stick count as sliding", "rtctl/friction/learn/point_evidence.py",
        "slides = (speed >= SPEED_MIN_SHARE * branch.speed_max_rad_s)", "slides = (speed >= 0)",
        ("tests/unit/friction/test_point_evidence.py",),
    ),
    Seed(
        "a sensor's zero wanders no more than is usual", "rtctl/friction/drift_estimate.py",
        "_WANDER_ROUNDS = 3", "_WANDER_ROUNDS = 0", ("tests/unit/friction/test_drift_beside.py",),
    ),
    Seed(
        "what viscous friction hides of the factor is not doubted", "rtctl/friction/drift_estimate.py",
        "likely * abs(float(found[0] - calm[0]))", "0.0", ("tests/unit/friction/test_drift_beside.py",),
    ),
    Seed(
        "bristles that are late behind the curve are told as drift", "rtctl/friction/drift_strokes.py",
        "self._take(settled(rows, by), by)", "self._take(rows, by)",
        ("tests/unit/friction/test_drift_window.py",),
    ),
    Seed(
        "what slid minutes ago is told as the present friction", "rtctl/friction/drift_strokes.py",
        "self._moved - self._ended[-1] > MOTION_FACTOR", "False and MOTION_FACTOR",
        ("tests/unit/friction/test_drift_window.py",),
    ),
    Seed(
        "a factor whose strokes are forgotten is not kept", "rtctl/host/exchange/friction_watch.py",
        "if len(axis.strokes.table) or axis.factor != 1.0", "if len(axis.strokes.table)",
        ("tests/unit/host/test_friction_watch.py",),
    ),
    Seed(
        "friction backward is looked up forward", "rtctl/control/place_friction.py",
        "return _of_branch(model, BACKWARD, speed, position)",
        "return _of_branch(model, FORWARD, speed, position)",
        (
            "tests/unit/friction/test_learn_places.py"
            "::test_the_file_keeps_place_and_the_laws_record_evaluates_it",
        ),
    ),
    Seed(
        "a ripple is compared with the model of where the joint is by now", "rtctl/control/place_trust.py",
        "s.place_model_nm[axis, 1] += p.observer_alpha[axis] * (place - s.place_model_nm[axis, 1])",
        "s.place_model_nm[axis, 1] = place", ("tests/unit/control/test_place_trust.py",),
    ),
    Seed(
        "viscous friction that is told by less than one standard error hides nothing",
        "rtctl/friction/drift_estimate.py", "min(sure / VISCOUS_SURE, 1.0)",
        "min(max(sure - 1.0, 0.0), 1.0)", ("tests/unit/friction/test_drift_beside.py",),
    ),
    Seed(
        "noise at one place takes what a whole turn has shown", "rtctl/control/place_trust.py",
        "max(now, _believed(slope * both, left))", "_believed(slope * both, left)",
        ("tests/unit/control/test_place_trust.py",),
    ),
    Seed(
        "what was trusted stays so, however the place drowns in noise", "rtctl/control/place_trust.py",
        "return min(max(now, _believed(slope * both, left)), _believed(turned, left))",
        "return max(now, _believed(slope * both, left))", ("tests/unit/control/test_place_trust.py",),
    ),
)  # fmt: skip
