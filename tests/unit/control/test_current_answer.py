"""What the current's answer to the test pulse tells, against answers made by brute force in 200 sub-steps a
tick.
"""

import math

import numpy as np
import pytest
from law_rig import of_rows

from rtctl.control import current_answer, detectors
from rtctl.control.jit import records
from rtctl.control.records import new_records
from rtctl.control.vocabulary import Fault

KEEP, REMEMBER = of_rows(current_answer.keep), of_rows(detectors.remember_torque)
TORQUE = 0.1
LIMIT = 2.0
PART = 20
SUBSTEPS = 200
NOISE = 0.0064
"""N m: noise and quantum of the shipped mock's Hall sensor against its pulse."""


def pulse(part=PART, rate=1.0):
    """Torque sent, tick by tick, with at most `rate` per tick."""
    sent, torque = [], 0.0
    for wanted in [0.0] * part + [TORQUE] * part + [-TORQUE] * part + [0.0] * part:
        torque += min(max(wanted - torque, -rate), rate)
        sent.append(torque)
    return np.array(sent)


def answer(sent, delay=0.0, lag=0.0, gain=1.0, offset=0.0, noise=0.0, seed=0):
    """What a sample at the end of each tick shows."""
    fine = np.concatenate([np.zeros(round(delay * SUBSTEPS)), np.repeat(sent, SUBSTEPS)])[
        : len(sent) * SUBSTEPS
    ]
    if lag > 0.0:
        share, current = -math.expm1(-1 / (lag * SUBSTEPS)), 0.0
        for k, value in enumerate(fine):
            current += share * (value - current)
            fine[k] = current
    shown = gain * fine[SUBSTEPS - 1 :: SUBSTEPS] + offset
    return shown + noise * np.random.default_rng(seed).standard_normal(len(shown))


class Measured:
    """The test on one axis: sent and measured torque in, results and faults out."""

    def __init__(self, sent, shown, proof_ticks=0.0, late_at=-1, overshoot=0.05):
        made = new_records(1)
        params, state = records(made[0]), records(made[1])
        params["arming_ticks"], params["period_s"] = len(sent) // 4, 1e-3
        params["torque_limit_nm"], params["proof_delay_s"] = LIMIT, proof_ticks * 1e-3
        params["current_gain_error"], params["current_offset_nm"] = 0.3, 0.1 * LIMIT
        p, s = params[0], state[0]
        params["current_overshoot_limit"] = overshoot
        state["answer_sent_nm"], state["answer_gap_nm"] = 7.0, 7.0  # of a test before
        state["answer_count"] = state["running_count"] = 1
        current_answer.forget(s, 0)
        assert (state["answer_count"][0, 0], state["running_count"][0, 0]) == (0, 0)
        for k, torque in enumerate(sent):
            state["torque_applied_nm"] = torque
            REMEMBER(state, 0)
            state["ticks"] += 1
            KEEP(state, params, 0, shown[k], k + 1, 1 if k == late_at else 0)
        self.fault = Fault(int(current_answer.conclude(s, p, 0)))
        self.known = int(state["answer_count"][0, 0]) == 1
        self.delay, self.lag, self.gain, self.offset = (
            float(state[f"answer_{name}"][0, 0]) for name in ("delay", "lag", "gain", "offset_nm")
        )


def ringing(sent, overshoot, hz):
    """The sent torque behind a loop of second order, integrated, as a sample of every tick shows it."""
    decay = -math.log(overshoot)
    zeta, w = decay / math.hypot(math.pi, decay), 2 * math.pi * hz * 1e-3
    # a tick by the matrix of a fine step, squared until it is one
    tick = np.eye(3) + np.array([[0, 1, 0], [-w * w, -2 * zeta * w, w * w], [0, 0, 0]]) / 1024
    for _ in range(10):
        tick = tick @ tick
    current, shown = np.zeros(3), np.zeros(len(sent))
    for k, torque in enumerate(sent):
        current[2] = torque
        current = tick @ current
        shown[k] = current[0]
    return shown


@pytest.mark.parametrize(("overshoot", "hz"), [(0.16, 80), (0.16, 150), (0.3, 60), (0.3, 450)])
def test_a_current_that_exceeds_the_step_is_refused_unless_it_is_declared(overshoot, hz):
    sent = pulse()
    shown = ringing(sent, overshoot, hz)
    assert Measured(sent, shown).fault & Fault.CURRENT
    assert Measured(sent, shown, overshoot=overshoot + 0.05).fault == 0
    assert Measured(sent, shown, overshoot=0.0).fault == 0  # a recording of before: nobody asked


@pytest.mark.parametrize("noise", [0.0, 0.1 * TORQUE])
def test_noise_is_no_overshoot(noise):
    for part in (10, 20, 80):
        sent = pulse(part)
        late, rings = answer(sent, 1.0, 0.8), ringing(sent, 0.04, 200)
        for seed in range(30):
            some = noise * np.random.default_rng(seed).standard_normal(len(sent))
            assert Measured(sent, late + some).fault == 0
            assert Measured(sent, rings + some).fault == 0


@pytest.mark.parametrize("part", [5, 10, 20, 80])
@pytest.mark.parametrize("delay", [0, 1, 2, 4])
def test_whole_delays_are_found_to_the_tick(delay, part):
    if delay > part - 3:
        delay = part - 3  # the answer must settle within a part
    sent = pulse(part)
    found = Measured(sent, answer(sent, delay))
    assert found.known
    assert found.delay == pytest.approx(delay, abs=0.11)
    assert found.lag <= 0.11
    assert found.gain == pytest.approx(1.0, abs=1e-6)
    assert found.fault == 0


@pytest.mark.parametrize(
    ("delay", "lag"), [(0.0, 0.318), (0.0, 0.796), (0.0, 1.5), (0.3, 0.5), (1.7, 1.0), (0.0, 3.0), (2.0, 2.0)]
)
def test_a_lag_counts_as_delay_and_never_more_than_there_is(delay, lag):
    sent = pulse()
    found = Measured(sent, answer(sent, delay, lag))
    assert delay + lag - 0.15 * (1 + lag) <= found.delay <= delay + lag + 0.02
    assert found.gain == pytest.approx(1.0, abs=0.02)


def test_a_fraction_of_a_period_that_no_sample_can_show_is_not_claimed():
    sent = pulse()
    for delay in (0.1, 0.5, 0.9):
        assert Measured(sent, answer(sent, delay)).delay == 0.0
        assert Measured(sent, answer(sent, 2 + delay)).delay == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize(("delay", "lag"), [(0.0, 0.0), (2.0, 0.0), (0.0, 0.318), (0.0, 0.8), (1.7, 1.0)])
def test_noise_does_not_make_the_delay_longer_than_the_tolerance(delay, lag):
    sent = pulse()
    clean = answer(sent, delay, lag)
    draw = np.random.default_rng(1)
    found = [Measured(sent, clean + NOISE * draw.standard_normal(len(sent))) for _ in range(60)]
    assert all(one.known and one.fault == 0 for one in found)
    assert max(one.delay for one in found) <= delay + lag + current_answer.TOLERANCE_TICKS
    assert min(one.delay for one in found) >= math.floor(delay + 0.1)
    assert all(abs(one.gain - 1) <= 0.05 for one in found)


def test_where_noise_hides_the_answer_nothing_is_said():
    sent = pulse()
    found = Measured(sent, answer(sent, 2.0, noise=2 * TORQUE, seed=3), proof_ticks=1.0)
    assert not found.known
    assert found.fault == 0


def test_a_gate_that_turns_the_steps_into_ramps_changes_nothing():
    sent = pulse(rate=0.02)
    assert np.max(np.abs(np.diff(sent))) == pytest.approx(0.02)
    assert Measured(sent, answer(sent, 2.0)).delay == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize(
    ("gain", "fault"),
    [(0.69, Fault.CURRENT), (0.71, 0), (1.0, 0), (1.29, 0), (1.31, Fault.CURRENT), (3.0, Fault.CURRENT)],
)
def test_gain_has_both_bounds(gain, fault):
    sent = pulse()
    found = Measured(sent, answer(sent, 1.0, gain=gain))
    assert found.gain == pytest.approx(gain, rel=1e-3)
    assert found.fault == fault


@pytest.mark.parametrize(
    ("offset", "fault"), [(0.19, 0), (0.21, Fault.CURRENT), (-0.19, 0), (-0.21, Fault.CURRENT), (0.0, 0)]
)
def test_an_offset_has_its_bound_in_the_torque_limit_and_does_not_touch_the_rest(offset, fault):
    sent = pulse()
    found = Measured(sent, answer(sent, 1.0, offset=offset))
    assert found.offset == pytest.approx(offset, abs=1e-6)
    assert (found.delay, found.gain) == (pytest.approx(1.0, abs=0.01), pytest.approx(1.0, abs=1e-6))
    assert found.fault == fault


@pytest.mark.parametrize(
    ("delay", "proof_ticks", "fault"),
    [(2.0, 1.0, Fault.DELAY), (2.0, 1.85, Fault.DELAY), (2.0, 1.95, 0), (2.0, 2.0, 0), (2.0, 0.0, 0),
        (2.0, 1e-6, Fault.DELAY),
     (0.0, 1e-6, 0), (4.0, 3.5, Fault.DELAY)],
)  # fmt: skip
def test_a_delay_beyond_the_proof_is_a_fault(delay, proof_ticks, fault):
    sent = pulse()
    assert Measured(sent, answer(sent, delay), proof_ticks).fault == fault


def test_a_lag_beyond_the_proof_is_one_too():
    sent = pulse()
    assert Measured(sent, answer(sent, 0.0, 0.8), 0.5).fault == Fault.DELAY
    assert Measured(sent, answer(sent, 0.0, 0.8), 0.8).fault == 0


def test_a_proof_that_is_no_number_excuses_nothing():
    made = new_records(1)
    params = records(made[0])
    params["period_s"], params["proof_delay_s"] = 1e-3, 2e-3
    assert current_answer.leaves_proof(params[0], 0, math.nan) == Fault.DELAY
    assert current_answer.leaves_proof(params[0], 0, 2.0) == 0


def test_a_slot_left_out_a_short_pulse_or_none_measures_nothing():
    sent = pulse()
    shown = answer(sent, 3.0)
    late = Measured(sent, shown, proof_ticks=1.0, late_at=30)
    assert (late.known, late.fault) == (False, Fault(0))
    short = pulse(4)
    assert not Measured(short, answer(short)).known
    assert not Measured(0.0 * sent, shown).known


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_an_answer_that_is_no_number_is_refused(value):
    sent = pulse()
    shown = answer(sent)
    shown[33] = value
    found = Measured(sent, shown, proof_ticks=1.0)
    assert found.fault == Fault.CURRENT
    assert not found.known


def test_no_answer_or_one_of_the_wrong_sign_is_not_taken_for_a_short_delay():
    sent = pulse()
    for gain in (0.0, -1.0):
        assert not Measured(sent, answer(sent, gain=gain)).known


@pytest.mark.parametrize("lag", [0.9, 1.7, 2.13, 2.52, 2.7, 3.3, 4.4])
@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_a_current_without_noise_is_no_slower_than_it_is_between_two_lags_of_the_row(lag, noise):
    sent = pulse(part=32)
    found = Measured(sent, answer(sent, lag=lag, noise=noise), proof_ticks=lag)
    assert found.known
    assert found.fault == 0
    assert lag - 0.4 <= found.delay <= lag + 0.02
