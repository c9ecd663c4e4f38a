"""The simulated force sensor's own low-pass and delay, against what they must be exactly; what sensors
declare of theirs.
"""

import math

import numpy as np
import pytest

from hw import registry
from hw.force import optoforce
from hw.interface import BackendError, BackendInfo, ForceSensor, Rig
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_force_filter import FORCE_LINE, advance_force, shown_torque
from hw.simulators.mock_options import MockOptions

T = 1e-3
RIG = Rig(1, T, *(np.ones(1) for _ in range(4)), lever_m=np.array([[0.0, 0.1, 0.0]]))


def shown(torques, **force):
    """What a sensor shows of these torques, one a period."""
    backend = MockBackend(MockOptions.model_validate({"force": force}).model_dump(mode="json"), RIG)
    out = []
    for torque in torques:
        backend.state["hand_torque_nm"] = torque
        advance_force(backend.state[0], backend.params[0], 1)
        out.append(shown_torque(backend.state[0], backend.params[0], 0))
    return np.array(out)


def test_a_sensor_without_a_filter_shows_what_there_is():
    torques = np.array([0.3, -0.2, 0.5])
    assert np.array_equal(shown(torques), torques)


@pytest.mark.parametrize("hz", [3.0, 60.0, 900.0])
def test_the_low_pass_answers_a_ramp_as_one_in_continuous_time(hz):
    t, tau = T * np.arange(1, 400), 1 / (2 * math.pi * hz)
    exact = t - tau * (1 - np.exp(-t / tau))
    np.testing.assert_allclose(shown(t, lowpass_hz=hz), exact, rtol=1e-9, atol=1e-12)


def test_many_periods_at_once_are_as_many_of_a_ramp():
    options = MockOptions.model_validate({"force": {"lowpass_hz": 3.0}}).model_dump(mode="json")
    device = MockBackend(options, RIG)
    device.state["hand_torque_nm"] = 400 * T
    advance_force(device.state[0], device.params[0], 400)
    one_by_one = shown(T * np.arange(1, 401), lowpass_hz=3.0)[-1]
    assert shown_torque(device.state[0], device.params[0], 0) == pytest.approx(one_by_one, rel=1e-9)


@pytest.mark.parametrize("late", [1, 5, FORCE_LINE - 1])
def test_a_delay_is_of_whole_periods(late):
    torques = np.arange(1.0, 60.0)
    assert np.array_equal(shown(torques, delay_ticks=late)[late:], torques[:-late])
    both = shown(torques, delay_ticks=late, lowpass_hz=50.0)
    np.testing.assert_array_equal(both[late:], shown(torques, lowpass_hz=50.0)[:-late])


def test_the_mock_declares_its_sensor():
    options = {"force": {"lowpass_hz": 80.0, "delay_ticks": 3}}
    assert registry.force_sensor("mock", options, RIG) == ForceSensor(80.0, 3 * T)
    assert registry.force_sensor("mock", {}, RIG) == ForceSensor()


def test_the_optoforce_declares_the_filter_it_is_set_to_and_how_old_a_sample_is():
    options = {"layout": "3-axis", "baud": 1_000_000, "filter_hz": 150, "output_hz": 333}
    found = registry.force_sensor("optoforce", options, RIG)
    assert found.lowpass_hz == 150.0
    assert found.delay_s == pytest.approx(1 / 333 + 10 * optoforce.length("3-axis") / 1e6)


@pytest.mark.parametrize("kind", ["rokubi", "rdt", "serial", "can"])
def test_a_sensor_whose_filter_only_it_knows_declares_nothing(kind):
    assert registry.force_sensor(kind, {}, RIG) is None


def bad_sensor(options, rig):
    """A declaration that no proof may rest on."""
    return ForceSensor(math.nan)


def test_a_declaration_that_is_no_number_is_refused(monkeypatch):
    info = BackendInfo("x:y", "x:y", simulated=True, force=f"{__name__}:bad_sensor")
    monkeypatch.setattr(registry, "lookup", lambda kind: info)
    with pytest.raises(BackendError, match="ForceSensor"):
        registry.force_sensor("mock", {}, RIG)
