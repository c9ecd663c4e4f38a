"""The delay of the torque as motion shows it: windows, confidence, two in a row."""

import math

import numpy as np
import pytest

from rtctl.control import detectors, running_delay
from rtctl.control.jit import compiled, records
from rtctl.control.records import new_records
from rtctl.control.vocabulary import Fault, State
from rtctl.tick import new_ticks

LIMIT = 2.0


@compiled
def _through(tick, state, params, sent, measured, skipped, found):
    """Tick and bits of the first fault, or -1 and 0; the delay that is known at each tick is put into
    `found`.
    """
    t, s, p = tick[0], state[0], params[0]
    for k in range(len(sent)):
        s.torque_applied_nm[0] = sent[k]
        detectors.remember_torque(s, 0)
        s.ticks += 1
        s.sample_age_ticks = k % (p.proof_age_ticks[0] + 1)
        t.motor_torque_nm[0] = measured[k - s.sample_age_ticks]
        fault = running_delay.running_fault(t, s, p, 0, int(skipped[k]))
        if s.running_count[0] == 1:
            found[k] = s.running_delay[0]
        if fault:
            return k, fault
    return -1, 0


class Motor:
    """Torque sent and measured, tick by tick, in ACTIVE."""

    def __init__(self, proof_ticks=1.0, period_s=1e-3, **params):
        made = new_records(1)
        self.params, self.state = records(made[0]), records(made[1])
        self.tick = records(new_ticks(1, 1))
        for name, value in {
            "period_s": period_s, "follow_kind": 1, "proof_delay_s": proof_ticks * period_s,
            "torque_limit_nm": LIMIT,
            "current_gain_error": 0.3, "current_offset_nm": 0.1 * LIMIT, **params,
        }.items():  # fmt: skip
            self.params[name] = value
        self.state["state"], self.state["ticks_in_state"] = State.ACTIVE, 1
        self.state["running_ticks"] = -1  # as it is left outside of ACTIVE
        self.seen = []
        self.fault = Fault(0)

    def run(self, sent, measured, skipped_at=()):
        """Returns the tick of the first fault, or -1."""
        skipped, found = np.isin(np.arange(len(sent)), list(skipped_at)), np.full(len(sent), np.nan)
        at, fault = _through(self.tick, self.state, self.params, sent, measured, skipped, found)
        self.fault = Fault(fault)
        self.seen += found[~np.isnan(found)].tolist()
        return at

    @property
    def known(self):
        return int(self.state["running_count"][0, 0]) == 1

    @property
    def delay(self):
        return float(self.state["running_delay"][0, 0])


def motion(ticks, amplitude=0.5, hz=1.5, seed=0):
    """A torque like a hand's and a spring's: two sines, some chatter of the encoder."""
    t = np.arange(ticks) * 1e-3
    torque = amplitude * (np.sin(2 * math.pi * hz * t) + 0.3 * np.sin(2 * math.pi * 2.7 * hz * t))
    return torque + 0.01 * np.random.default_rng(seed).choice([-1.0, 1.0], ticks)


def shown(sent, delay, gain=1.0, offset=0.05, noise=0.006, seed=1):
    """What is measured `delay` whole ticks late."""
    late = np.concatenate([np.zeros(delay), sent])[: len(sent)]
    return gain * late + offset + noise * np.random.default_rng(seed).standard_normal(len(sent))


@pytest.mark.parametrize("gain", [0.8, 1.0, 1.2])
@pytest.mark.parametrize("delay", [0, 1, 2, 4])
def test_the_delay_is_found_beside_gain_offset_and_noise(delay, gain):
    motor = Motor(proof_ticks=10.0)
    sent = motion(6000)
    assert motor.run(sent, shown(sent, delay, gain)) == -1
    assert motor.seen
    assert np.array(motor.seen) == pytest.approx(delay, abs=running_delay.MOST_ERROR_TICKS)


def test_only_two_windows_in_a_row_beyond_the_proof_are_a_fault():
    motor = Motor(proof_ticks=1.0)
    sent = motion(6000)
    found = motor.run(sent, shown(sent, 3))
    assert motor.fault is Fault.DELAY
    assert found == 2000, "the first tick begins the first window"
    assert Motor(proof_ticks=3.0).run(sent, shown(sent, 3)) == -1
    late = shown(sent, 0)
    late[1001:2001] = shown(sent, 3)[1001:2001]
    late[3001:4001] = shown(sent, 3)[3001:4001]
    motor = Motor(proof_ticks=1.0)
    assert motor.run(sent, late) == -1
    assert max(motor.seen) > 2.0, "seen, but not twice in a row"


def in_frames(torque, every, damped_ticks=2.0):
    """What is sent where only every n-th tick has a fresh sample: the last that was sent on it has a damper
    in it, worth so many ticks of the torque's change, which has relaxed in the ticks without."""
    fresh = np.arange(len(torque)) % every == 1
    return torque + damped_ticks * fresh * np.gradient(torque)


@pytest.mark.parametrize("every", [2, 3])
def test_a_held_current_is_compared_with_what_was_sent_when_it_was_sampled(every):
    motor = Motor(proof_ticks=every - 1.0, proof_age_ticks=every - 1)
    smooth = motion(6000)
    sent = in_frames(smooth, every)
    assert motor.run(sent, shown(sent, 0)) == -1
    assert np.array(motor.seen) == pytest.approx(0.0, abs=0.2)
    # as old as undeclared, it is late
    assert Motor(proof_ticks=0.05, proof_age_ticks=0).run(sent, np.repeat(sent[::every], every)) == 2000


@pytest.mark.parametrize("every", [2, 3])
def test_a_delay_counts_beside_the_age_of_samples_that_the_proof_includes(every):
    sent = motion(6000)
    late = Motor(proof_ticks=every - 1.0, proof_age_ticks=every - 1)
    assert late.run(sent, shown(sent, 1)) == 2000
    assert late.fault is Fault.DELAY
    assert late.delay == pytest.approx(1.0, abs=0.2)
    assert Motor(proof_ticks=1.0 * every, proof_age_ticks=every - 1).run(sent, shown(sent, 1)) == -1


def test_noise_alone_and_a_torque_that_stands_still_tell_nothing():
    draw = np.random.default_rng(5)
    for sent in (np.zeros(4000), np.full(4000, 0.7), 0.003 * draw.standard_normal(4000)):
        motor = Motor(proof_ticks=0.01)
        assert motor.run(sent, sent + 0.02 * draw.standard_normal(4000)) == -1
        assert not motor.known


def test_a_delay_at_the_very_bound_of_the_proof_is_no_alarm_with_any_noise():
    for seed in range(6):
        sent = motion(6000, amplitude=0.1, seed=seed)
        assert Motor(proof_ticks=2.0).run(sent, shown(sent, 2, noise=0.02, seed=seed)) == -1


def test_skipped_slots_begin_a_new_window():
    sent = motion(6000)
    motor = Motor(proof_ticks=1.0)
    assert motor.run(sent, shown(sent, 3), skipped_at=set(range(500, 6000, 900))) == -1
    assert not motor.known


@pytest.mark.parametrize(
    ("params", "state"),
    [({"follow_kind": 0}, State.ACTIVE), ({"proof_delay_s": 0.0}, State.ACTIVE), ({}, State.HOLD),
        ({}, State.ARMING), ({}, State.IDLE)],
)  # fmt: skip
def test_nothing_is_watched_without_a_sensor_a_proof_or_the_torque_of_active(params, state):
    motor = Motor(**{"proof_ticks": 1.0, **params})
    motor.state["state"] = state
    sent = motion(5000)
    assert motor.run(sent, shown(sent, 4)) == -1
    assert not motor.known


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_measurement_that_is_no_number_is_no_estimate_and_no_current_that_was_asked_for(value):
    sent = motion(5000)
    measured = shown(sent, 0)
    measured[500] = value
    motor = Motor(proof_ticks=1.0)
    assert motor.run(sent, measured) == 2000  # the second window
    assert motor.fault is Fault.CURRENT
    assert not motor.known
