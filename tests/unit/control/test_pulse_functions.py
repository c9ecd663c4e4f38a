"""The functions of the test pulse one by one, to the tick and to the last bit of their thresholds."""

import math

import numpy as np
import pytest
from safety_rows import Rows, sent

from rtctl.control import arming
from rtctl.control.records import HELD
from rtctl.control.vocabulary import Fault, State


def pulse(rig, ticks):
    rig["ticks_in_state"] = ticks
    return arming.pulse_torque(rig.state[0], rig.params[0], 0)


def test_the_pulse_has_four_parts_and_at_most_a_twentieth_of_the_limit():
    rig = Rows(State.ARMING)
    assert [pulse(rig, k) for k in range(14)] == [0.0] * 3 + [0.08] * 3 + [-0.08] * 3 + [0.0] * 5
    rig.params["arming_torque_nm"] = 1.0
    assert pulse(rig, 3) == pytest.approx(0.1)
    rig.params["arming_ticks"] = 0
    assert [pulse(rig, k) for k in range(4)] == pytest.approx([0.0, 0.1, -0.1, 0.0])


def test_the_test_is_over_with_the_last_tick_of_the_last_part_of_arming_only():
    for state in State:
        rig = Rows(state)
        over = []
        for ticks in range(13):
            rig["ticks_in_state"] = ticks
            over.append(bool(arming.tested(rig.state[0], rig.params[0])))
        assert over == [state is State.ARMING and ticks >= 11 for ticks in range(13)]


def armed(
    moved=(0.0, 0.0, 0.0),
    current=1.0,
    hand=0.0,
    before=0.0,
    delay=0,
    kind=1,
    elapsed=1,
    travel=None,
    start=0.3,
    pulse_nm=0.08,
):
    """Faults of a test pulse, tick by tick: joint positions at the end of parts 1 to 3 relative to the
    start.
    """
    rig = Rows(State.IDLE, follow_kind=kind, follow_delay_ticks=delay, arming_torque_nm=pulse_nm)
    rig["test_product_nm2"] = rig["test_square_nm2"] = rig["test_hand_nm"] = rig["test_moved_rad"] = 9.0
    rig["position_rad"] = start
    faults = [step_of_test(rig, 0.0, before, 1)]
    rig["state"] = State.ARMING
    sent_ago = [0.0] * (delay + 1)
    for ticks in range(12):
        rig["ticks_in_state"] = ticks
        torque = pulse(rig, ticks)
        sent(rig, torque)
        sent_ago.append(torque)
        place = [0.0, *moved][min((ticks + 1) // 3, 3)]
        rig["position_rad"] = start + (travel if travel is not None else place)
        faults.append(step_of_test(rig, current * sent_ago[-1 - delay], hand, elapsed))
    return faults


def step_of_test(rig, motor_nm, hand_nm, elapsed):
    rig.tick["motor_torque_nm"], rig.tick["hand_torque_nm"] = motor_nm, hand_nm
    return Fault(int(arming.arming_faults(rig.tick[0], rig.state[0], rig.params[0], 0, elapsed, 0)))


QUIET = [Fault(0)] * 13


AT_THE_END = [Fault(0)] * 12 + [Fault.WIRING]


COUNTS = 4e-4
"""What still counts as no motion."""


@pytest.mark.parametrize(
    ("bench", "faults"),
    [
        ({}, QUIET),
        ({"current": 0.25}, QUIET),
        ({"current": 0.24}, AT_THE_END),
        ({"current": 0.0}, AT_THE_END),
        ({"current": -1.0}, AT_THE_END),
        ({"current": math.nan}, AT_THE_END),
        ({"current": -1.0, "kind": 0}, QUIET),
        ({"current": -1.0, "elapsed": 0}, QUIET),
        ({"delay": 2}, QUIET),
        ({"moved": (0.0, 0.01, 0.0)}, QUIET),
        ({"moved": (0.0, -0.01, 0.0)}, AT_THE_END),
        ({"moved": (0.0, -0.9 * COUNTS, 0.0)}, QUIET),
        ({"moved": (0.0, -1.1 * COUNTS, 0.0)}, AT_THE_END),
        ({"moved": (0.9 * COUNTS, -0.01, 0.0)}, AT_THE_END),
        ({"moved": (-0.9 * COUNTS, -0.01, 0.0)}, AT_THE_END),
        ({"moved": (1.1 * COUNTS, -0.01, 0.0)}, QUIET),
        ({"moved": (-1.1 * COUNTS, -0.01, 0.0)}, QUIET),
        ({"moved": (0.0, -0.01, 0.0), "hand": 0.04}, AT_THE_END),
        ({"moved": (0.0, -0.01, 0.0), "hand": 0.0401}, QUIET),
        ({"moved": (0.0, -0.01, 0.0), "hand": -0.0401}, QUIET),
        ({"moved": (0.0, -0.01, 0.0), "before": 5.0}, AT_THE_END),
        ({"delay": 2, "current": 0.0}, AT_THE_END),
        ({"pulse_nm": 0.0, "current": math.nan}, QUIET),
        ({"start": 0.0, "moved": (COUNTS, -0.01, 0.0)}, AT_THE_END),
        ({"start": 0.0, "moved": (0.0, -COUNTS, 0.0)}, QUIET),
        ({"start": 0.0, "travel": 0.1}, QUIET),
        ({"travel": 0.0999}, QUIET),
        ({"travel": -0.0999}, QUIET),
        ({"travel": 0.1001}, [Fault(0)] + [Fault.ARMING_MOVED] * 12),
        ({"travel": -0.1001}, [Fault(0)] + [Fault.ARMING_MOVED] * 12),
        ({"travel": math.nan}, [Fault(0)] + [Fault.ARMING_MOVED] * 12),
    ],
)
def test_the_pulse_is_judged_by_current_direction_and_travel(bench, faults):
    assert armed(**bench) == faults


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_the_current_expected_is_the_mean_of_what_was_sent_within_the_delay(delay):
    rig = Rows(follow_delay_ticks=delay)
    torques = [float(1 << k) for k in range(HELD + 2)]
    sent(rig, *torques)
    expected = arming._expected(rig.state[0], rig.params[0], 0)
    assert expected == pytest.approx(np.mean(torques[-1 - delay :]), rel=1e-12)


def test_without_parts_nothing_of_an_earlier_test_is_judged():
    rig = Rows(State.IDLE, arming_ticks=0)
    rig["test_moved_rad"] = -9.0
    assert step_of_test(rig, 0.0, 0.0, 1) == 0
    rig["state"] = State.ARMING
    assert step_of_test(rig, 0.0, 0.0, 1) == 0
