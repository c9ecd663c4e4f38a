"""The test pulse of ARMING: sign of current and motion, bounded motion, its own limits."""

import math

import pytest
from law_rig import COUNT, LawRig

from rtctl.control.vocabulary import Fault, State

PER_AMPERE = 80 * 0.8 * 0.02
TORQUE = 0.1
PART = 20


class Bench:
    """A rig in ARMING with a motor, and a joint that a bristle holds (10 counts at the pulse)."""

    def __init__(self, current=1.0, motion=1.0, counts=10.0, drift_rad=0.0, hand_n=0.0, **params):
        self.rig = LawRig(follow_kind=1, **{"arming_torque_nm": TORQUE, "arming_travel_rad": 0.05, **params})
        self.rig.params["arming_ticks"] = PART
        self.current, self.motion = current, motion * counts * COUNT / TORQUE
        self.drift_rad, self.hand_n = drift_rad, hand_n
        self.rig.run(40)
        self.rig.request("arm_count")
        self.torques = []
        self.rig.tick()
        assert self.rig.mode is State.ARMING

    def run(self, most=4 * PART + 1):
        torque, base = 0.0, 0.0
        for _ in range(most):
            base += self.drift_rad
            self.rig.force_n[1] = self.hand_n
            self.rig.tick(base + self.motion * torque, current_a=self.current * torque / PER_AMPERE)
            torque = self.rig["torque_applied_nm"]
            self.torques.append(torque)
            if self.rig.mode is not State.ARMING:
                break
        return self.rig

    def fault(self):
        first = int(self.run()["fault_first"])
        return Fault(1 << first) if first >= 0 else None


def test_the_pulse_is_plus_then_minus_within_five_percent_and_a_hundred_milliseconds():
    bench = Bench()
    assert bench.run().mode is State.ACTIVE
    torques = bench.torques[:-1]
    assert len(bench.torques) == 4 * PART
    assert torques[: PART - 1] == [0.0] * (PART - 1)
    assert torques[PART - 1 : 2 * PART - 1] == [pytest.approx(TORQUE)] * PART
    assert torques[2 * PART - 1 : 3 * PART - 1] == [pytest.approx(-TORQUE)] * PART
    assert torques[3 * PART - 1 :] == [0.0] * PART
    assert bench.rig["enabled"] == 1.0


def test_more_than_five_percent_is_impossible_whatever_the_parameters_say():
    bench = Bench(arming_torque_nm=2.0)
    bench.run()
    assert max(abs(torque) for torque in bench.torques) == pytest.approx(0.05 * 3.0)


@pytest.mark.parametrize("current", [-1.0, 0.0, 0.2, math.nan])
def test_current_of_the_wrong_sign_or_none_is_refused(current):
    bench = Bench(current=current)
    if math.isnan(current):
        assert bench.fault() is Fault.BAD_SAMPLE
    else:
        assert bench.fault() is Fault.WIRING
    assert bench.rig.mode is State.FAULT


@pytest.mark.parametrize(
    ("current", "fault"), [(0.5, Fault.CURRENT), (0.75, None), (1.25, None), (1.4, Fault.CURRENT)]
)
def test_current_that_answers_too_weakly_or_too_strongly_is_refused(current, fault):
    bench = Bench(current=current)
    assert bench.fault() is fault
    assert bench.rig["arming_gain"] == pytest.approx(current)


@pytest.mark.parametrize("counts", [5, 10, 100])
def test_motion_against_the_pulse_is_refused(counts):
    assert Bench(motion=-1.0, counts=counts).fault() is Fault.WIRING
    assert Bench(motion=1.0, counts=counts).fault() is None


def test_a_joint_that_stiction_holds_passes():
    assert Bench(counts=0.0).fault() is None
    assert Bench(motion=-1.0, counts=3.0).fault() is None


def test_a_moving_joint_or_a_pulling_hand_is_not_judged_by_its_direction():
    assert Bench(motion=-1.0, drift_rad=1e-4).fault() is None
    assert Bench(motion=-1.0, hand_n=1.0).fault() is None
    assert Bench(motion=-1.0, hand_n=-1.0).fault() is None
    assert Bench(motion=-1.0, hand_n=0.1).fault() is Fault.WIRING


def test_a_joint_that_moves_too_far_is_cut_at_once():
    bench = Bench(drift_rad=0.005)
    assert bench.run(11).mode is State.FAULT
    assert bench.rig["fault_first"] == Fault.ARMING_MOVED.value.bit_length() - 1


def test_a_stop_during_the_pulse_ramps_down():
    bench = Bench()
    bench.run(PART + 5)
    assert bench.rig["torque_applied_nm"] == pytest.approx(TORQUE)
    bench.rig.request("stop_count")
    assert bench.run(1).mode is State.STOPPING
    assert 0.0 < bench.rig["torque_applied_nm"] < TORQUE


@pytest.mark.parametrize("late_ticks", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_device_may_answer_anywhere_within_its_declared_delay_even_with_short_pulses(late_ticks, sign):
    rig = LawRig(follow_kind=1, follow_delay_ticks=2, arming_torque_nm=TORQUE, arming_travel_rad=0.05)
    rig.params["arming_ticks"] = 4
    rig.run(40)
    rig.request("arm_count")
    rig.tick()
    sent = [0.0] * 3 + [rig["torque_applied_nm"]]
    while rig.mode is State.ARMING:
        rig.tick(current_a=sign * 0.9 * sent[-1 - late_ticks] / PER_AMPERE)  # k_t a little off, as ever
        sent.append(rig["torque_applied_nm"])
    assert rig.mode is (State.ACTIVE if sign > 0 else State.FAULT)
    assert bool(rig.faults & Fault.WIRING) == (sign < 0)
