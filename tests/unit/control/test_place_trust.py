"""Compensation by place: trusted as far as the force sensor sees it, and a spring that no account pays
for.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from law_rig import LawRig, T, of_rows

from rtctl.check.law_plan import build
from rtctl.check.place_plan import fill_place
from rtctl.control.feedforward import compensated_magnitude
from rtctl.control.jit import records
from rtctl.control.place_trust import judge_place, place_trust
from rtctl.control.records import HELD, MODEL, new_records
from rtctl.control.vocabulary import PlaceUse, Policy
from rtctl.friction import artefact
from rtctl.friction.kind_harmonics import Harmonics
from rtctl.rig_file.config import load
from rtctl.tick import new_ticks

JUDGE = of_rows(judge_place)
COGGING = Harmonics(0.5, np.array([1.0, 3.0]), np.array([0.02, 0.0]), np.array([0.0, 0.01]))
SWING = 0.05
CONFIGS = Path("configs")


def model_of(wave_nm=SWING, part=None):
    """.3 N m at every speed, more by a cos of the angle over a turn."""
    made = np.zeros(1, MODEL)
    row = made[0]
    row["n_segments"], row["knot_rad_s"][:, 1:], row["speed_max_rad_s"] = 1, 2.0, 2.0
    row["coefficient"][:, 0, 0], row["speed_fade_rad_s"], row["lookup_scale"] = 0.3, 0.2, 512
    row["place_orders"], row["place_turns_per_rad"] = 1, 1 / (2 * math.pi)
    row["place_coefficient"][:, 0, 0, 0] = wave_nm
    if part is not None:
        row["conservative_per_rad"], row["conservative"] = 1 / part.period_rad, part.table()
    return records(made)


class Judged:
    """An axis that slides to and fro over 3 rad, and what its force sensor sees."""

    def __init__(self, use, shift=0.0, noise=0.002, drift=0.0, part=COGGING):
        params, state, _, _ = new_records(1)
        self.rows = records(new_ticks(1, 1)), records(state), records(params), model_of(part=part)
        self.t, self.s, self.p, self.model = (array[0] for array in self.rows)
        self.p["place_kind"][0], self.p["place_length_rad"][0], self.p["place_speed_rad_s"][0] = (
            int(use),
            math.pi,
            1.0,
        )
        self.p["observer_alpha"][0], self.p["conservative_judged"][0] = 0.1, 1
        self.shift, self.noise, self.drift, self.part = shift, noise, drift, part
        self.seen, self.alphas = np.zeros(2), (0.4, 0.1)  # the observer's low-passes
        self.random = np.random.default_rng(5)

    def slide(self, strokes, rows=400, reach=3.0):
        for stroke in range(strokes):
            d = 1.0 if stroke % 2 == 0 else -1.0
            for row in range(rows):
                share = row / rows
                x = reach * (share if d > 0 else 1 - share)
                at = x - self.shift
                friction = 0.3 * (1 + self.drift) + SWING * math.cos(at)
                pushed = 0.0 if self.part is None else float(self.part(np.array(at)))
                seen = d * friction - pushed
                for k, alpha in enumerate(self.alphas):
                    self.seen[k] += alpha * (seen - self.seen[k])
                    seen = self.seen[k]
                self.s["position_rad"][0], self.t["velocity_rad_s"][0] = x, 0.3 * d
                seen += self.noise * self.random.normal()
                self.s["bristle_share"][0], self.s["friction_observed_nm"][0] = d, seen
                JUDGE(*self.rows, 0, d * reach / rows)
        return place_trust(self.s, self.p, 0)


def test_a_place_is_not_trusted_before_it_was_seen_and_then_it_is():
    axis = Judged(PlaceUse.SEEN)
    assert axis.slide(1, reach=2.0) == 0.0  # not half a turn yet
    assert axis.slide(8) > 0.95


def test_a_ripple_is_known_as_late_as_it_is_seen():
    """Turned once to and fro, as quick as its ripple passes the observer at its bandwidth: compared with what
    the model says of the present, the places were not there."""
    ripple = Harmonics(0.2, np.array([1.0]), np.array([0.06]), np.array([0.0]))
    rows = round(3.0 / 0.2 * 2 * math.pi / 0.1)
    assert Judged(PlaceUse.SEEN, part=ripple).slide(5, rows) > 0.95
    assert Judged(PlaceUse.SEEN, shift=0.1, part=ripple).slide(5, rows) < 0.05


def test_drift_of_friction_says_nothing_of_its_place():
    assert Judged(PlaceUse.SEEN, drift=0.2).slide(9) > 0.95


@pytest.mark.parametrize("shift", [math.pi, 1.7])
def test_an_index_that_moved_is_not_compensated(shift):
    assert Judged(PlaceUse.SEEN, shift).slide(9) < 0.05


def test_a_given_place_is_trusted_at_once_and_no_more_where_the_sensor_contradicts():
    right, wrong = Judged(PlaceUse.GIVEN), Judged(PlaceUse.GIVEN, math.pi)
    assert right.slide(0) == wrong.slide(0) == 1.0
    assert right.slide(9) > 0.95
    assert wrong.slide(9) < 0.05
    assert Judged(PlaceUse.OFF).slide(3) == 0.0


def test_noise_and_numbers_that_are_none_give_no_trust():
    noisy = Judged(PlaceUse.SEEN, noise=0.3)
    assert noisy.slide(9) < 0.3
    noisy.s["friction_observed_nm"][0] = math.nan
    judge_place(noisy.t, noisy.s, noisy.p, noisy.model, 0, 0.01)
    assert np.isfinite(noisy.s["place_square_nm2"]).all()


def test_until_its_place_is_known_the_feedforward_goes_by_the_weakest():
    params, _, _, _ = new_records(1)
    p = records(params)[0]
    p["friction_policy"][0], p["friction_gain"][0], p["friction_cap_nm"][0] = int(Policy.HYBRID), 1.0, 1.0
    p["place_trough_nm"][0] = SWING
    model = model_of()[0]
    places = np.linspace(0, 2 * math.pi, 9)
    for trust in (0.0, 0.4, 1.0):
        found = [compensated_magnitude(p, model, 0, 0, 0.5, x, trust)[0] for x in places]
        truth = 0.3 + SWING * np.cos(places)
        assert (np.array(found) <= truth + 1e-12).all()  # never more than there is
        assert found[0] == pytest.approx(0.25 + trust * 2 * SWING)


def test_a_ripple_that_passes_too_quick_to_be_seen_keeps_no_place_from_being_judged():
    axis = Judged(PlaceUse.SEEN)
    axis.p["conservative_judged"][0] = 0
    axis.model["conservative"] *= -1.0  # as wrong as it can be
    assert axis.slide(9) > 0.95
    loaded = load(CONFIGS / "mock-places.toml")
    model = artefact.load(CONFIGS / "friction" / "mock-places.json")
    quick = replace(model, conservative=replace(model.conservative, orders=49.0 * model.conservative.orders))
    slow = replace(
        model, conservative=replace(model.conservative, orders=16.0 * model.conservative.orders)
    )  # seen below .1 rad/s only
    bandwidth_rad_s = build(loaded).params["observer_bandwidth_rad_s"]
    for found, place, judged, gain in (
        (model, "seen", 1, 0.95),
        (slow, "seen", 0, 0.0),
        (quick, "seen", 0, 0.0),
        (quick, "given", 0, 0.95),
    ):
        axis = loaded.config.axis[0]
        axis = axis.model_copy(update={"friction": axis.friction.model_copy(update={"place": place})})
        p = new_records(1)[0][0]
        p["observer_bandwidth_rad_s"] = bandwidth_rad_s
        fill_place(p, 0, axis, found)
        assert p["place_speed_rad_s"][0] > 0.3
        assert (p["conservative_judged"][0], p["conservative_gain"][0]) == (judged, gain)


def test_a_motion_at_one_place_says_little_of_all_of_them():
    steep = 1.5
    axis, stays = (Judged(PlaceUse.SEEN, steep, part=None) for _ in range(2))
    for one in (axis, stays):
        one.p["place_trough_nm"][0], one.p["place_shift_rad"][0] = SWING, steep
    assert stays.slide(20, reach=0.3) < 0.3
    assert axis.slide(14) > 0.8
    # drowns what the place does there, and not what it does over a turn
    axis.noise = 0.02
    before = axis.slide(0)
    assert axis.slide(20, reach=0.3) > 0.99 * before
    axis.noise = 0.1
    assert axis.slide(20, reach=1.0) < 0.5 * before
    wrong = Judged(PlaceUse.SEEN, math.pi)
    wrong.p["place_trough_nm"][0], wrong.s["place_evidence"][0] = SWING, 1.0
    assert wrong.slide(9) < 0.05


@pytest.mark.parametrize(("use", "trust"), [(PlaceUse.OFF, 0.0), (PlaceUse.SEEN, 0.3), (PlaceUse.GIVEN, 0.7)])
def test_the_tick_tells_what_is_trusted(use, trust):
    rig = LawRig(friction_policy=int(Policy.HYBRID), place_kind=int(use))
    rig.state["place_evidence"] = 0.3  # that it is there, or against what was given
    rig.tick(0.0)
    assert rig["place_trust"] == pytest.approx(trust)


def test_the_conservative_part_is_compensated_beside_the_account_of_friction():
    rig = LawRig(friction_policy=int(Policy.HYBRID), place_kind=int(PlaceUse.GIVEN), conservative_gain=0.9)
    rig.friction()
    rig.model["conservative_per_rad"], rig.model["conservative"] = 1 / COGGING.period_rad, COGGING.table()
    rig.arm()
    for k in range(60):
        rig.tick(0.1 * T * (k + 1))
    x = 0.1 * T * 60
    assert rig["feedforward_torque_nm"] == pytest.approx(-0.9 * float(COGGING(np.array(x))), abs=1e-6)
    held = rig.state["compensation_nm"][0, 0]
    assert len(held) == HELD
    assert np.abs(held).max() < 1e-9  # no hand: nothing but the spring, which no account pays for
