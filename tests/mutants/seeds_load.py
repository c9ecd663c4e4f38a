"""Seeded bugs of friction by load in the law, in `rtctl check` and in the drift watch, and of the window that the watch forgets by."""

from __future__ import annotations

from seed import Seed

LOADED = ("tests/unit/friction/test_load.py",)
LOAD_LAW = ("tests/unit/control/test_load_friction.py",)
DRIFT = ("tests/unit/friction/test_drift_window.py",)
BY_PLACE = ("tests/unit/friction/test_drift_by_place.py",)
PLACES = ("tests/unit/friction/test_learn_places.py",)
TWO_SPEEDS = ("tests/unit/friction/test_load_two_speeds.py",)

SEEDS = (
    Seed(
        "the help by load does not see what it does to the load itself", "rtctl/control/load_friction.py",
        "asked + s.compensation_nm[axis, (s.ticks - 1) % HELD]", "asked", LOAD_LAW,
    ),
    Seed(
        "load is helped with at rest", "rtctl/control/load_friction.py",
        "gain * (1.0 - math.exp(-((speed / p.friction_blend_rad_s[axis]) ** 2)))", "gain", LOAD_LAW,
    ),
    Seed(
        "load is extrapolated", "rtctl/control/load_friction.py",
        "e, m = min(max(outside, -most), most), min(max(motor, -most), most)", "e, m = outside, motor", LOAD_LAW,
    ),
    Seed(
        "hand and motor add up in the gear", "rtctl/control/load_friction.py",
        "abs(model.load_outside * e - model.load_motor * m)", "abs(model.load_outside * e + model.load_motor * m)", LOAD_LAW,
    ),
    Seed(
        "a virtual mass goes by load", "rtctl/control/load_friction.py",
        " or is_admittance(s, axis)", "", LOAD_LAW,
    ),
    Seed(
        "the load passes the cap", "rtctl/control/compensation_limit.py",
        "np.maximum(np.minimum(wanted, cap_nm), 0.0)", "np.maximum(np.minimum(wanted, cap_nm) + load_nm, 0.0)", LOAD_LAW,
    ),
    Seed(
        "an uneven load is an offset of the force sensor", "rtctl/control/force_doubt.py",
        "s.friction_seen_nm[axis, side] - s.friction_load_nm[axis], s.slid", "s.friction_seen_nm[axis, side], s.slid", LOAD_LAW,
    ),
    Seed(
        "any share of load may come back", "rtctl/check/verdicts_of_load.py",
        "share <= LOOP_MOST, LOOP_MOST", "True, LOOP_MOST", LOADED,
    ),
    Seed(
        "the coupling is judged as without load", "rtctl/friction/margins.py",
        "k_c, b_c = (1 + loop) * k_c + spring, (1 + loop) * b_c", "k_c, b_c = k_c + spring, b_c", LOADED,
    ),
    Seed(
        "a doubtful load counts as friction", "rtctl/friction/margins.py",
        "F_hat + sure * load_nm - doubt_nm", "F_hat + load_nm - doubt_nm", LOADED,
    ),
    Seed(
        "the curve keeps the load", "rtctl/friction/learn/unloaded.py",
        "(points.friction_nm - off)[chosen]", "points.friction_nm[chosen]", LOADED,
    ),
    Seed(
        "a window of sliding reaches back as far as it likes", "rtctl/friction/drift_strokes.py",
        "self._moved - self._ended < MOTION_FACTOR * self._most_rows", "self._moved - self._ended < 1e9", DRIFT,
    ),
    Seed(
        "a load that the model knows is a drift", "rtctl/friction/drift_watch.py",
        "axis.by.unloaded_nm(velocity[:, a], hand[:, a], motor[:, a])", "hand[:, a] + motor[:, a]", DRIFT,
    ),
    Seed(
        "soft bristles are measured while they bend", "rtctl/friction/points/mock.py",
        "rig.settle_rad = max(rig.settle_rad, SETTLE_LENGTHS * (points[-1].presliding_rad or 0.0))", "pass",
        ("tests/unit/hw/test_mock_points.py::test_so_many_presliding_lengths_pass_before_a_measurement",),
    ),
    Seed(
        "a swing that dies away is a break-away", "rtctl/friction/points/mock.py",
        "if max(seen) - min(seen) <= REST_COUNTS * rig.count_rad:", "if True:",
        ("tests/unit/hw/test_mock_points.py::test_a_joint_that_swings_on_is_waited_for",),
    ),
    Seed(
        "a factor is told of motion that is long forgotten", "rtctl/friction/drift_watch.py",
        "found = self.found = estimate(self.strokes, self.rate_hz)",
        "found = estimate(self.strokes, self.rate_hz)\n        self.found = found or self.found", DRIFT,
    ),
    Seed(
        "the watch by place takes the encoder's 0 for the model's", "rtctl/friction/drift_deployed.py",
        "x = position - self.place_shift_rad", "x = position", BY_PLACE,
    ),
    Seed(
        "a place is watched by whether it is trusted or not", "rtctl/friction/drift_strokes.py",
        "by.dry_nm(v, rows.position, rows.trust)", "by.dry_nm(v, rows.position)", BY_PLACE,
    ),
    Seed(
        "a ripple is taken off whether its place is trusted or not", "rtctl/friction/drift_deployed.py",
        "trust * of_conservative", "of_conservative", BY_PLACE,
    ),
    Seed(
        "a ripple that no one can see keeps the places from being trusted", "rtctl/check/place_plan.py",
        "(max(of_friction, of_part) if judged else of_friction)", "max(of_friction, of_part)",
        ("tests/unit/control/test_place_trust.py",),
    ),
    Seed(
        "a ripple that no one has seen is compensated", "rtctl/check/place_plan.py",
        "if known and model", "if model", ("tests/unit/control/test_place_trust.py",),
    ),
    Seed(
        "a place is doubted by what motion at another one cannot tell", "rtctl/control/place_trust.py",
        "way * _telling(s, p, axis) *", "way *", ("tests/unit/control/test_place_trust.py",),
    ),
    Seed(
        "the watch by place doubts as the one by speed does", "rtctl/friction/drift_deployed.py",
        "self.sliding_doubt_nm + trust * (self.place_doubt_nm - self.sliding_doubt_nm)", "self.sliding_doubt_nm", BY_PLACE,
    ),
    Seed(
        "trust of the newest stroke counts for all of them", "rtctl/friction/drift_estimate.py",
        "float(table[:, 2].sum() / n.sum())", "float(table[-1, 2] / n[-1])", BY_PLACE,
    ),
    Seed(
        "an old recording of a given place is watched by speed", "rtctl/friction/drift_recorded.py",
        'if "place_trust" in missing:', "if False:", BY_PLACE,
    ),
    Seed(
        "the tick tells what is seen against a given place as trust", "rtctl/control/law.py",
        "t.place_trust[axis] = place_trust(s, p, axis)", "t.place_trust[axis] = s.place_evidence[axis]",
        ("tests/unit/control/test_place_trust.py",),
    ),
    Seed(
        "the ripple pushes the other way", "rtctl/friction/drift_watch.py",
        "torque[:, a] += axis.by.pushed_nm", "torque[:, a] -= axis.by.pushed_nm", BY_PLACE,
    ),
    Seed(
        "strokes of another index are gone on from", "rtctl/friction/drift_deployed.py",
        "if self.place_shift_rad is not None:\n            facts", "if False:\n            facts", BY_PLACE,
    ),
    Seed(
        "what places differ by hides a drift at each of them", "rtctl/friction/guarantee.py",
        "if model is not None and model.place is not None:", "if False:", BY_PLACE,
    ),
    Seed(
        "a curve by place is trusted by the curve of speed's errors", "rtctl/friction/learn/places.py",
        'if before[0].band is not None and before[0].band.way == "log":', "if True:", PLACES,
    ),
    Seed(
        "means over uneven places speak against a model by place", "rtctl/friction/report/judge.py",
        "if model.place is not None:", "if False:", PLACES,
    ),
    Seed(
        "a peak that falls at two speeds is taken for one of one", "rtctl/friction/load.py",
        "(1 - share) * np.exp(-((v / first) ** power)) + share", "np.exp(-((v / first) ** power)) + 0 * share", TWO_SPEEDS,
    ),
    Seed(
        "the law's load is that of the direction that rubs more", "rtctl/friction/learn/unloaded.py",
        "weaker = min(1.0,", "weaker = max(1.0,", TWO_SPEEDS,
    ),
    Seed(
        "both directions of a loaded gear are one", "rtctl/friction/learn/load_terms.py",
        "np.where(rows.backward, backward, 1.0)", "1.0", TWO_SPEEDS,
    ),
)  # fmt: skip
