"""The torque of a hand that moves the joint slowly is not answered at once, and nothing of it turns the help
of a joint that slides.
"""

from __future__ import annotations

import math

import pytest
from law_rig import NOMINAL, LawRig, T, of_rows

from rtctl.control.braking import unbraked_share
from rtctl.control.feedforward import advance_gate, advance_intent, wished_push
from rtctl.control.jit import compiled
from rtctl.control.pace import GATE_TIMES, MEAN_TIMES, PACE_S, SLOW_BLENDS, TURN_TIMES, advance_pace, is_slow
from rtctl.control.records import Record
from rtctl.control.resting import BENT_S, REST_HZ, REST_S
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Display, Policy

PACE, BRAKE, GATE = of_rows(advance_pace), of_rows(unbraked_share), of_rows(advance_gate)
SLOW = lowpass_alpha(REST_HZ, T)
GATE_ALPHA = -math.expm1(-T / 0.01)
SLOW_PACE = SLOW_BLENDS * NOMINAL["friction_blend_rad_s"]
SECOND = range(round(1.0 / T))


def moved(pace_rad_s, bristle_share=1.0, **params):
    """A joint that slides forward, whose hand has this mean speed."""
    rig = LawRig(
        rest_alpha=SLOW,
        friction_gate_alpha=GATE_ALPHA,
        friction_intent_alpha=0.27,
        **{"friction_policy": int(Policy.HYBRID)} | params,
    )
    rig.state["pace_rad_s"], rig.state["bristle_share"], rig.state["friction_stop"] = (
        pace_rad_s,
        bristle_share,
        1.0,
    )
    return rig


def test_the_pace_is_the_mean_speed_of_the_last_tenths_of_a_second():
    rig = moved(0.0)
    rig.state["velocity_rad_s"] = -1.0
    for _ in range(round(PACE_S / T)):
        PACE(rig.state, rig.params, 0)
    assert rig.state["pace_rad_s"][0, 0] == pytest.approx(1 - math.exp(-1), rel=1e-2)


def test_a_speed_that_is_no_number_changes_no_pace():
    rig = moved(0.5)
    rig.state["velocity_rad_s"] = math.nan
    PACE(rig.state, rig.params, 0)
    assert rig.state["pace_rad_s"][0, 0] == 0.5


@pytest.mark.parametrize(("pace_rad_s", "slow"), [(0.0, True), (SLOW_PACE, True), (1.01 * SLOW_PACE, False)])
def test_a_hand_is_slow_up_to_a_mean_speed_and_the_joint_of_a_virtual_mass_never(pace_rad_s, slow):
    rig = moved(pace_rad_s)
    assert bool(is_slow(rig.state[0], rig.params[0], 0)) is slow
    rig.state["display_kind"] = int(Display.ADMITTANCE)
    assert not is_slow(rig.state[0], rig.params[0], 0)


def ring(tick, mean_nm=0.015, by_nm=0.04, hz=35.0):
    """A push that moves the joint on, with the ring of a stiff hand on it, N m."""
    return mean_nm + by_nm * math.sin(2 * math.pi * hz * tick * T)


def braked(pace_rad_s):
    rig, shares = moved(pace_rad_s), []
    for tick in SECOND:
        rig.now["hand_torque_nm"] = ring(tick)
        shares.append(BRAKE(rig.now, rig.state, rig.params, 0))
    return 1.0 - min(shares[len(shares) // 2 :])


@pytest.mark.parametrize("pace_rad_s", [0.0, 1.0])
def test_the_ring_of_a_hand_that_pushes_on_brakes_nothing(pace_rad_s):
    assert braked(pace_rad_s) == 0.0


def test_a_ring_that_turns_the_joint_to_and_fro_does_not_give_help_and_take_it_away_again():
    rig, shares = moved(1.0), []
    for tick in SECOND:
        rig.now["hand_torque_nm"] = 0.1
        rig.state["bristle_share"] = math.copysign(1.0, math.sin(2 * math.pi * 15.0 * tick * T))
        shares.append(BRAKE(rig.now, rig.state, rig.params, 0))
    swing = max(shares[len(shares) // 2 :]) - min(shares[len(shares) // 2 :])
    assert 0.1 < swing < 0.6, "by 5 Hz it is tanh(pi 5 Hz/(2 x 15 Hz)), .48; by the gate's 16 Hz .93"


def test_a_slow_hand_that_brakes_is_not_helped():
    rig = moved(0.0)
    rig.now["hand_torque_nm"] = -0.1
    for _ in SECOND:
        share = BRAKE(rig.now, rig.state, rig.params, 0)
    assert share == pytest.approx(0.0, abs=1e-9)


def test_a_push_that_is_no_number_is_forgotten():
    rig = moved(0.0)
    rig.now["hand_torque_nm"] = math.nan
    BRAKE(rig.now, rig.state, rig.params, 0)
    rig.now["hand_torque_nm"] = -0.1
    for _ in SECOND:
        share = BRAKE(rig.now, rig.state, rig.params, 0)
    assert share == pytest.approx(0.0, abs=1e-9)


def closed(pace_rad_s, ticks=10, **state):
    """What is left of an open gate after so many ticks without a push."""
    rig = moved(pace_rad_s)
    rig.state["friction_gate"] = 1.0
    for name, value in state.items():
        rig.state[name] = value
    for _ in range(ticks):
        gate = GATE(rig.state, rig.params, 0, 0.0)
    return gate


@pytest.mark.parametrize("pace_rad_s", [0.0, 1.0])
def test_the_gate_of_a_hand_hardly_sinks_between_the_peaks_of_its_ring(pace_rad_s):
    assert closed(pace_rad_s) == pytest.approx((1 - GATE_TIMES * SLOW) ** 10)
    assert closed(pace_rad_s, display_kind=int(Display.ADMITTANCE)) == pytest.approx((1 - SLOW) ** 10)


@pytest.mark.parametrize("state", [{"bristle_share": 0.9}, {"bent_ticks": round(BENT_S / T) + 1}])
def test_in_a_turn_and_at_rest_it_closes_as_ever(state):
    assert closed(0.0, **state) == pytest.approx((1 - SLOW) ** 10)


def test_at_rest_it_opens_at_once():
    rig = moved(0.0)
    rig.state["bristle_share"] = 0.9
    assert GATE(rig.state, rig.params, 0, 1.0) == pytest.approx(GATE_ALPHA)


@pytest.mark.parametrize("pace_rad_s", [0.0, 1.0])
@pytest.mark.parametrize("push_nm", [0.0, 0.3])
def test_a_ring_opens_it_on_a_joint_that_slides_as_far_as_its_mean_pushes(pace_rad_s, push_nm):
    """35 Hz about a push: of a ring that would open it by half at each peak hardly a tenth is left, and it
    saws at nothing.
    """
    rig, ring_nm = moved(pace_rad_s), 0.5 * float(moved(0.0).params["friction_gate_nm"][0, 0])
    rig.state["friction_mean_hand_nm"], rig.state["friction_gate"] = push_nm, float(push_nm > 0.0)
    for k in range(300):
        gate = GATE(rig.state, rig.params, 0, push_nm + ring_nm * math.sin(2 * math.pi * 35 * k * T))
    assert gate == pytest.approx(1.0, abs=1e-3) if push_nm else gate < MEAN_TIMES * 2.0 / 35


def direction(rig, ticks, hand_nm, bristle_share=None, stop=None, world_nm=0.0):
    """Where the intent leads after so many ticks of these torques of hand and coupling, -1 to 1."""
    rig.state["calm_hand_nm"], rig.state["calm_world_nm"] = hand_nm, world_nm
    if bristle_share is not None:
        rig.state["bristle_share"] = bristle_share
    if stop is not None:
        rig.state["friction_stop"] = stop
    for _ in range(ticks):
        INTENT(rig.state, rig.params, 0)
    return float(rig.state["friction_intent_nm"][0, 0]) / 0.05


@compiled
def _advance(s: Record, p: Record, axis: int) -> None:
    advance_intent(s, p, axis, wished_push(s, p, axis))


INTENT = of_rows(_advance)


@pytest.mark.parametrize("pace_rad_s", [0.0, 1.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_on_a_joint_that_slides_the_intent_is_its_motion_whatever_the_hand_does(pace_rad_s, way):
    rig = moved(pace_rad_s)
    assert direction(rig, 100, -way * 0.2, way, way, -way * 0.3) == pytest.approx(way)


@pytest.mark.parametrize("world_nm", [0.0, -0.15, -0.2, -0.35])
@pytest.mark.parametrize("ticks", [0, round(BENT_S / T) + 1])
def test_who_leans_on_a_world_is_helped_where_both_push_the_joint(world_nm, ticks):
    """Helped by the hand's torque alone it was pushed into a wall that had long thrown the hand back."""
    rig = moved(0.0, bristle_share=0.5)
    rig.state["bent_ticks"] = ticks
    assert direction(rig, 3000, 0.2, world_nm=world_nm) == pytest.approx((0.2 + world_nm) / 0.05, abs=1e-6)
    rig = moved(0.0, bristle_share=0.5, friction_policy=int(Policy.INTENT))
    assert direction(rig, 3000, 0.2, world_nm=world_nm) == pytest.approx(0.2 / 0.05)


def test_in_the_turn_of_a_slow_hand_it_goes_over_as_slowly_as_at_rest_and_without_a_step():
    turned = {}
    for pace_rad_s in (0.0, 1.0):
        rig = moved(pace_rad_s)
        direction(rig, 100, -0.05)
        turned[pace_rad_s] = [direction(rig, 10, -0.05, 0.9) for _ in range(3)]
    assert turned[0.0] == pytest.approx([2 * (1 - SLOW) ** n - 1 for n in (10, 20, 30)])
    assert turned[1.0] == pytest.approx([2 * (1 - TURN_TIMES * SLOW) ** n - 1 for n in (10, 20, 30)])


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_in_a_turn_that_is_quick_the_bristles_lead_and_no_ring_of_the_hand(way):
    """The intent was at the hand's torque within 10 ms, and the help stepped to it as the ring's speed passed
    zero.
    """
    rig = moved(1.0)
    rig.state["velocity_rad_s"] = 3 * NOMINAL["friction_blend_rad_s"]
    direction(rig, 100, 0.0, way, way)
    assert direction(rig, 100, -way * 0.2, 0.9 * way, 0.8 * way) == pytest.approx(0.8 * way, abs=2e-3)


def test_a_joint_that_creeps_or_rests_follows_the_hand():
    rig = moved(0.0)
    rig.state["bent_ticks"] = round(BENT_S / T) + 1
    assert direction(rig, 2000, -0.05) == pytest.approx(-1.0)


@pytest.mark.parametrize("pace_rad_s", [0.0, 1.0])
def test_so_does_one_that_sticks_at_the_end_of_its_bristles(pace_rad_s):
    rig = moved(pace_rad_s)
    direction(rig, 100, 0.05, 1.0, 1.0)
    rig.state["rest_ticks"] = round(REST_S / T) + 1
    followed = 1 - (1 - SLOW * (TURN_TIMES if pace_rad_s else 1.0)) ** 10
    assert direction(rig, 10, -0.05) == pytest.approx(1 - 2 * followed)


def test_the_policy_intent_is_the_hands_alone():
    rig = moved(0.0, friction_policy=int(Policy.INTENT))
    assert direction(rig, 100, -0.05) == pytest.approx(-1.0)


def test_the_intent_of_a_virtual_mass_is_the_way_it_goes():
    rig = moved(0.0)
    rig.state["display_kind"], rig.state["mass_velocity_rad_s"] = int(Display.ADMITTANCE), -0.05
    assert direction(rig, 100, 0.2) == pytest.approx(-1.0)
