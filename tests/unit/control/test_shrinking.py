"""A hand whose strokes shrink is left some of the friction; one that keeps them is helped whole."""

import math

import pytest
from law_rig import LEVER, LawRig, T, of_rows

from rtctl.control.resting import BENT_S
from rtctl.control.shrinking import (
    EASE_S,
    LEFT_MOST,
    LONG_S,
    SHRUNK,
    STEADY,
    steady_share,
)
from rtctl.control.vocabulary import Display, Policy, State

SHARE = of_rows(steady_share)
EASED = 10 * round(EASE_S / T)
STROKE_S = 0.5


class Strokes:
    """A joint whose speed and bristles are told, and the share of the help it is left."""

    def __init__(self):
        self.rig = LawRig()
        self.rig.state["state"] = int(State.ACTIVE)
        self.share = 1.0

    def tick(self, speed_rad_s, bent=None):
        """One tick; bristles at the end of the motion unless told."""
        self.rig.now["velocity_rad_s"] = speed_rad_s
        self.rig.state["bristle_share"] = math.copysign(1.0, speed_rad_s) if bent is None else bent
        self.share = SHARE(self.rig.now, self.rig.state, self.rig.params, 0)
        return self.share

    def stroke(self, peak_rad_s, seconds=STROKE_S):
        """Half a sine; the least share left in it."""
        ticks = round(seconds / T)
        return min(self.tick(peak_rad_s * math.sin(math.pi * (k + 0.5) / ticks)) for k in range(ticks))

    def strokes(self, *peaks_rad_s, seconds=STROKE_S):
        """Strokes to and fro; the share left at the end of the last."""
        for k, peak in enumerate(peaks_rad_s):
            self.stroke(peak if k % 2 == 0 else -peak, seconds)
        return self.share


@pytest.mark.parametrize("seconds", [0.025, 0.5, 2.0])
@pytest.mark.parametrize("growth", [1.0, 1.2])
def test_strokes_that_stay_or_grow_are_helped_whole(seconds, growth):
    joint = Strokes()
    least = [joint.stroke((-1) ** k * 0.1 * growth**k, seconds) for k in range(8)]
    assert least == [1.0] * 8


def test_strokes_that_differ_by_a_quarter_are_the_same():
    assert Strokes().strokes(1.0, STEADY, 1.0, STEADY, 1.0) == pytest.approx(1.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_friction_comes_back_in_proportion_to_what_a_stroke_is_short_of_those_before(sign):
    half = 0.5 * (STEADY + SHRUNK)
    assert Strokes().strokes(sign, sign, sign * half) == pytest.approx(1 - 0.5 * LEFT_MOST, abs=0.01)
    assert Strokes().strokes(sign, sign, sign * 0.3) == pytest.approx(1 - LEFT_MOST, abs=0.01)


def test_it_is_known_soon_after_the_slower_peak_and_not_while_the_joint_gets_faster():
    joint = Strokes()
    joint.strokes(1.0, 1.0)
    ticks = round(STROKE_S / T)
    shares = [joint.tick(0.4 * math.sin(math.pi * (k + 0.5) / ticks)) for k in range(ticks)]
    assert shares[ticks // 2] == 1.0
    assert shares[round(0.75 * ticks)] < 1 - 0.5 * LEFT_MOST


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("hand_nm", "least"), [(0.05, 1.0), (-0.05, 1 - LEFT_MOST), (0.0, 1 - LEFT_MOST)])
@pytest.mark.parametrize("dip", [0.0, 0.5])
def test_a_joint_stopped_early_by_its_bristles_is_helped_whole_and_by_its_hand_is_not(
    dip, hand_nm, least, sign
):
    joint = Strokes()
    joint.strokes(-sign, sign, -sign, seconds=1.0)
    joint.rig.now["hand_torque_nm"] = sign * hand_nm
    thrown = [joint.tick(sign * speed, sign) for speed in (0.3, 0.3 * dip) for _ in range(200)]
    assert min(thrown) == pytest.approx(least, abs=0.03)
    for _ in range(EASED):
        joint.tick(sign)
    assert joint.share == pytest.approx(1.0, abs=1e-3)


def test_one_that_comes_to_rest_early_in_a_stroke_is_not_helped_to_slip():
    joint = Strokes()
    joint.strokes(1.0, 1.0, seconds=1.0)
    joint.rig.now["hand_torque_nm"] = 0.05
    for _ in range(50):
        joint.tick(0.3)
    joint.rig.state["bent_ticks"] = round(2 * BENT_S / T)
    for _ in range(EASED):
        joint.tick(0.0)
    assert joint.share == pytest.approx(1 - LEFT_MOST, abs=1e-3)


def test_who_gets_faster_again_is_helped_before_the_stroke_is_over():
    joint = Strokes()
    joint.strokes(1.0, 1.0, 0.3)
    assert joint.share < 0.8
    for _ in range(EASED):
        joint.tick(-1.0)
    assert joint.share == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("stroke_s", [0.02, 0.1, 0.8])
def test_the_viscous_damping_alone_looks_like_shrinking(stroke_s):
    # 1.28 s: a hand of .02 kg m^2 on a joint of .012 with .05 N m s/rad, no dry friction at all
    joint, time_s, k = Strokes(), 0.0, 0
    while time_s < 2.0:
        joint.stroke((-1) ** k * math.exp(-time_s / 1.28), stroke_s)
        time_s, k = time_s + stroke_s, k + 1
    assert joint.share < 1 - 0.15 * LEFT_MOST


def test_slow_motion_after_fast_is_helped_whole_after_some_seconds_of_it():
    joint = Strokes()
    joint.strokes(1.0, 1.0)
    joint.stroke(0.3)
    for _ in range(round((LONG_S + 4.0) / T)):
        joint.tick(-0.3)
    assert joint.share == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(("speed_rad_s", "bent"), [(0.0, 1.0), (0.005, 1.0), (0.1, 0.5)])
def test_a_hand_that_holds_still_is_not_helped_again_by_waiting(speed_rad_s, bent):
    joint = Strokes()
    joint.strokes(1.0, 1.0, 0.3)
    for _ in range(round(8.0 / T)):
        joint.tick(speed_rad_s, bent)
    assert joint.share == pytest.approx(1 - LEFT_MOST, abs=0.01)


def test_strokes_of_creep_are_none():
    assert Strokes().strokes(0.009, 0.009, 0.001) == 1.0


def test_a_joint_without_power_forgets_all_and_a_virtual_mass_is_followed_with_all_help():
    for field, value in (("state", int(State.IDLE)), ("display_kind", int(Display.ADMITTANCE))):
        joint = Strokes()
        joint.strokes(1.0, 1.0, 0.3)
        joint.rig.state[field] = value
        assert joint.tick(-0.1) == 1.0
        assert float(joint.rig.state["stroke_reference_rad_s"][0, 0]) == 0.0
        assert float(joint.rig.state["stroke_left"][0, 0]) == 0.0


def test_a_velocity_that_is_no_number_changes_nothing_and_does_not_stay():
    joint = Strokes()
    joint.strokes(1.0, 1.0, 0.3)
    before = joint.share
    assert joint.tick(math.nan, -1.0) == pytest.approx(before, abs=0.01)
    assert math.isfinite(joint.stroke(-1.0))
    joint.stroke(1.0)
    assert joint.share == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("policy", [Policy.HYBRID, Policy.TANH])
def test_the_law_sends_the_rest_only(policy):
    helped = []
    for before_rad_s in (0.5, 1.5):
        rig = LawRig(friction_policy=int(policy)).friction().arm()
        for speed_rad_s, hand_nm, ticks in ((before_rad_s, 0.1, 200), (-0.5, -0.1, 200), (-0.3, -0.1, 200)):
            rig.force_n[1] = hand_nm / LEVER
            for _ in range(ticks):
                rig.tick(rig.position + speed_rad_s * T)
        helped.append(float(rig["feedforward_torque_nm"]))
    assert helped[1] == pytest.approx((1 - LEFT_MOST) * helped[0], rel=0.02)
