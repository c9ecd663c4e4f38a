"""Current loop, fractional transport delay and slow samples of the mock, against what they must be
exactly.
"""

import math

import numpy as np
import pytest
from hardware import rig
from mock_runs import PER_A, march, plant, truth

from hw.simulators.jit import records
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_options import MockOptions
from rtctl.tick import new_ticks

FREE = {"coulomb_nm": 1e-6, "breakaway_nm": 1e-6, "viscous_nms_rad": 0.0, "bristle_stiffness_nm_rad": 1e-3,
        "bristle_damping_nms_rad": 0.0}  # fmt: skip
NO_HAND = [{"kind": "none"}]
J = 0.012


def test_the_real_current_follows_as_a_first_order_low_pass_and_carries_the_exact_momentum():
    for loop in ({"bandwidth_hz": 200.0}, {"time_constant_s": 1 / (2 * math.pi * 200.0)}):
        states = march(
            *plant(axis=[{"friction": FREE, "current_loop": loop}], hand=NO_HAND), np.full(20, PER_A)
        )
        t, tau = np.arange(1, 21) * 1e-3, 1 / (2 * math.pi * 200.0)
        assert np.allclose(truth(states, "current_a"), 1 - np.exp(-t / tau), rtol=1e-9)
        speed = PER_A / J * (t - tau * (1 - np.exp(-t / tau)))
        assert np.allclose(truth(states, "velocity_rad_s"), speed, rtol=1e-5)


@pytest.mark.parametrize("delay", [0.25, 0.999, 1.0, 2.6, 15.5, 16.0])
@pytest.mark.parametrize("loop", [None, {"bandwidth_hz": 300.0}])
def test_a_fractional_delay_switches_inside_the_period_at_its_place(delay, loop):
    torques = np.zeros(24)
    torques[0], torques[1] = 0.5, -0.2
    axis = {"friction": FREE} | ({"current_loop": loop} if loop else {})
    states = march(*plant(timing={"transport_delay_ticks": delay}, axis=[axis], hand=NO_HAND), torques)
    t = (np.arange(1, 25) - delay) * 1e-3
    tau = 1 / (2 * math.pi * 300.0) if loop else 0.0

    def momentum(since):
        """Integral of a unit step's torque, `since` seconds after it came."""
        since = np.maximum(since, 0.0)
        return since - (tau * (1 - np.exp(-since / tau)) if loop else 0.0)

    expected = 0.5 * momentum(t) - 0.7 * momentum(t - 1e-3) + 0.2 * momentum(t - 2e-3)
    assert np.allclose(truth(states, "velocity_rad_s") * J, expected, rtol=1e-5, atol=1e-8)


def test_whole_and_fractional_delay_add_up():
    torques = np.repeat([0.4, -0.3, 0.0], 10)
    one = march(
        *plant(axis=[{"torque_delay_ticks": 2}], timing={"transport_delay_ticks": 1.5}, hand=NO_HAND), torques
    )
    other = march(*plant(timing={"transport_delay_ticks": 3.5}, hand=NO_HAND), torques)
    assert np.array_equal(truth(one, "position_rad"), truth(other, "position_rad"))


def backend(**options):
    return MockBackend(MockOptions.model_validate(options).model_dump(mode="json"), rig())


def shown_by(device, slots, currents_a):
    tick = records(new_ticks(1))
    tick["enabled"] = 1
    rows = new_ticks(len(slots))
    for k, slot in enumerate(slots):
        tick["tick"] = slot
        # what the last cycle left in the tick must not come through
        tick["position_rad"] = tick["current_a"] = np.nan
        device.read(tick)
        tick["current_command_a"] = currents_a[k]
        device.write(tick)
        rows[k] = tick[0]
    return rows


SHOWN = ("position_rad", "current_a", "force_n", "temperature_c", "device_velocity_rad_s", "estop")
NOISY = {
    "velocity": {},
    "estop_from_s": 0.031,
    "estop_to_s": 0.04,
    "force": {"noise_n": 0.01},
    "axis": [{"current_noise_a": 0.01, "drift": {"temperature": [[0.0, 20.0], [1.0, 60.0]]}}],
}


def test_a_slow_device_shows_every_third_sample_of_a_fast_one_and_holds_it():
    currents = np.sin(np.arange(60) * 0.2)
    fast = shown_by(backend(**NOISY), range(60), currents)
    slow = shown_by(backend(timing={"sample_every_ticks": 3}, **NOISY), range(60), currents)
    assert slow["sample_count"].tolist() == [1 + k // 3 for k in range(60)]
    for name in SHOWN:
        assert np.array_equal(slow[name], fast[name][3 * (np.arange(60) // 3)]), name
    assert np.any(slow["force_n"][1:] != slow["force_n"][:-1])


def test_a_sample_that_fell_into_missed_slots_is_shown_at_the_next_read():
    slots = [0, 1, 2, 4, 5, 6, 13, 14, 15]
    slow = shown_by(backend(timing={"sample_every_ticks": 3}), slots, np.ones(9))
    assert slow["sample_count"].tolist() == [1, 1, 1, 2, 2, 3, 4, 4, 5]
    assert slow["position_rad"][3, 0] != slow["position_rad"][2, 0]


def test_the_watchdog_leaves_no_current_to_decay():
    device = backend(time_to_live_ticks=3, timing={"transport_delay_ticks": 1.5}, hand=NO_HAND,
                     axis=[{"current_loop": {"bandwidth_hz": 50.0}}])  # fmt: skip
    tick = records(new_ticks(1))
    tick["enabled"], tick["current_command_a"] = 1, 1.0
    for slot in range(20):
        tick["tick"] = slot
        device.write(tick)
    for slot, dead in ((22, False), (24, False), (26, True), (40, True)):
        tick["tick"] = slot
        device.read(tick)
        assert bool(device.state["motor_torque_nm"][0, 0] == 0.0) is dead


@pytest.mark.parametrize("gap", [61, 1000])
def test_after_a_long_gap_no_late_current_holds_the_motor(gap):
    """The longest time to live and a delay together outlast what is caught up slot by slot."""
    device = backend(time_to_live_ticks=50, axis=[{"torque_delay_ticks": 10}], hand=NO_HAND)
    tick = records(new_ticks(1))
    tick["enabled"], tick["current_command_a"] = 1, 1.0
    for slot in range(20):
        tick["tick"] = slot
        device.write(tick)
    tick["tick"] = 19 + gap
    device.read(tick)
    assert device.state["motor_torque_nm"][0, 0] == 0.0


def test_after_a_long_gap_a_late_force_sensor_shows_what_it_shows_without():
    """The low-pass and the line of what is shown late go on in a gap, too."""
    force = {"lowpass_hz": 20.0, "delay_ticks": 8, "resolution_n": 0.0}
    hand = [{"kind": "sine", "start_s": 0.0, "amplitude_rad": 0.3, "stiffness_nm_rad": 50.0}]
    tick, found = records(new_ticks(1)), []
    for slots in (range(300), [*range(300), 1000], range(1001)):
        device = backend(force=force, hand=hand)
        for slot in slots:
            tick["tick"] = slot
            device.read(tick)
        found.append(float(tick["force_n"][0, 1]))
    before, over_a_gap, without = found
    assert over_a_gap == pytest.approx(without, abs=0.1 * abs(without - before))
