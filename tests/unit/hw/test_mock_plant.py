"""The simulated rig as a whole: balance of torques, grid, missed slots, repeatability, extremes."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hardware import rig
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_plant import NOISY, make, run

from hw.interface import BackendError
from hw.simulators.jit import records
from rtctl.tick import new_ticks

TORQUE_PER_AMPERE = 80 * 0.72 * 0.0134


def truth(backend, name):
    return float(backend.state[name][0, 0])


@pytest.mark.parametrize("hand_inertia_kgm2", [0.0, 0.003])
def test_the_torques_of_motor_hand_and_friction_balance_the_inertia(hand_inertia_kgm2):
    hand = [{"kind": "sine", "start_s": 0.0, "inertia_kgm2": hand_inertia_kgm2}]
    backend = make(hand=hand, axis=[{"ripple_nm": 0}])
    tick = records(new_ticks())
    tick["enabled"], tick["current_command_a"] = 1, 0.1
    motion = []
    for k in range(1000):
        tick["tick"] = k
        backend.read(tick)
        backend.write(tick)
        torques = (
            truth(backend, name) for name in ("motor_torque_nm", "hand_torque_nm", "friction_torque_nm")
        )
        motion.append((truth(backend, "velocity_rad_s"), *torques))
    v, motor, hand_torque, friction = np.array(motion).T
    change = (8 * (v[3:-1] - v[1:-3]) - (v[4:] - v[:-4])) / 12e-3
    error = np.abs(0.012 * change - (motor + hand_torque - friction)[2:-2])
    assert error[20:].max() < 1e-3, "of the differences, where a bristle turns"
    assert np.median(error) < 1e-6


@pytest.mark.parametrize("stiffness_nm_rad", [200.0, 1e3, 1e4])
@pytest.mark.parametrize("damping_nms_rad", [0.0, 1.0, 100.0])
@pytest.mark.parametrize("period_s", [1e-3, 1e-2])
def test_a_hand_however_stiff_pulls_the_joint_in_and_rests_even_in_single_coarse_steps(
    stiffness_nm_rad, damping_nms_rad, period_s
):
    hand = {"kind": "rest", "center_rad": 0.2, "start_s": 0.0}
    hand |= {"stiffness_nm_rad": stiffness_nm_rad, "damping_nms_rad": damping_nms_rad}
    backend = make(rig(period_s=period_s), substeps=1, hand=[hand])
    run(backend, np.zeros(round(4.0 / period_s)))
    travel = abs(truth(backend, "position_rad") - 0.2)
    assert travel <= 0.35 / stiffness_nm_rad + 0.35 / 250
    assert abs(truth(backend, "velocity_rad_s")) < 1e-3


def test_a_current_becomes_link_torque_through_gear_efficiency_and_torque_constant():
    backend = make(axis=[{"torque_scale": 1.1}])
    run(backend, [0.4])
    assert truth(backend, "motor_torque_nm") == pytest.approx(0.4 * TORQUE_PER_AMPERE * 1.1, rel=1e-14)


def test_a_slow_ramp_breaks_away_near_the_stiction_torque():
    for direction in (1, -1):
        backend = make(hand=[{"kind": "none"}], axis=[{"friction": {"scale_negative": 1.2}}])
        tick = records(new_ticks())
        tick["enabled"] = 1
        torque = 0.0
        for k in range(20_000):
            tick["tick"] = k
            torque = direction * 0.05e-3 * k
            tick["current_command_a"] = torque / TORQUE_PER_AMPERE
            backend.write(tick)
            if abs(truth(backend, "velocity_rad_s")) > 0.05:
                break
        expected = 0.35 if direction > 0 else 0.42
        assert abs(torque) == pytest.approx(expected, rel=0.02)
        assert truth(backend, "velocity_rad_s") * direction > 0


def test_a_constant_torque_ends_at_the_speed_whose_friction_it_equals():
    backend = make(hand=[{"kind": "none"}])
    run(backend, np.full(3000, 0.45 / TORQUE_PER_AMPERE))  # .25 + .05 v = .45
    assert truth(backend, "velocity_rad_s") == pytest.approx(4.0, rel=1e-3)


def test_without_enable_no_torque_acts_whatever_the_current_says():
    backend = make()
    run(backend, np.full(50, 3.0), enabled=0)
    assert truth(backend, "motor_torque_nm") == 0
    assert truth(backend, "velocity_rad_s") == 0


def test_stop_makes_the_motor_torque_free_until_the_next_current():
    backend = make(hand=[{"kind": "none"}], axis=[{"torque_delay_ticks": 3}])
    run(backend, np.full(100, 2.0))
    moving = truth(backend, "velocity_rad_s")
    backend.stop()
    tick = records(new_ticks())
    tick["tick"] = 110
    backend.read(tick)
    assert truth(backend, "motor_torque_nm") == 0
    assert abs(truth(backend, "velocity_rad_s")) < abs(moving)


def test_a_delayed_torque_acts_that_many_periods_later():
    backend = make(hand=[{"kind": "none"}], axis=[{"torque_delay_ticks": 3}])
    seen = []
    for k in range(8):
        run(backend, [1.0 if k == 0 else 0.0], first=k)
        seen.append(truth(backend, "current_a"))
    assert seen == [0, 0, 0, 1.0, 0, 0, 0, 0]


def test_the_amplifier_saturates_and_refuses_what_is_not_finite():
    backend = make(axis=[{"current_max_a": 2.0}])
    for current_a, expected in ((5.0, 2.0), (-9e300, -2.0), (math.nan, 0.0), (math.inf, 0.0), (1.5, 1.5)):
        run(backend, [current_a], first=int(backend.state["tick"][0]))
        assert truth(backend, "current_a") == expected


def test_missed_slots_pass_under_the_held_current():
    steady, gapped = make(), make()
    run(steady, np.full(10, 1.0))
    run(gapped, np.full(5, 1.0))
    tick = records(new_ticks())
    tick["tick"] = 10
    for backend in (steady, gapped):
        backend.read(tick)
    for name in ("position_rad", "velocity_rad_s", "bristle_rad"):
        assert truth(gapped, name) == truth(steady, name)


def test_a_current_dies_with_its_time_to_live():
    backend = make(hand=[{"kind": "none"}], time_to_live_ticks=10)
    run(backend, [1.0])
    tick = records(new_ticks())
    for slot, alive in ((5, True), (10, True), (11, False), (40, False)):
        tick["tick"] = slot
        backend.read(tick)
        assert (truth(backend, "current_a") != 0) is alive


def test_an_hour_of_missed_slots_leaves_the_rig_at_rest_and_in_time():
    backend = make(hand=[{"kind": "rest"}])
    run(backend, np.full(20, 2.0))
    tick = records(new_ticks())
    tick["tick"] = 3_600_000
    backend.read(tick)
    assert backend.state["tick"][0] == 3_600_000
    assert abs(truth(backend, "velocity_rad_s")) < 1e-6


def test_a_slot_written_twice_moves_the_rig_once():
    backend = make()
    tick = records(new_ticks())
    tick["enabled"], tick["current_command_a"] = 1, 2.0
    backend.write(tick)
    after = backend.state.copy()
    backend.write(tick)
    assert truth(backend, "position_rad") == after["position_rad"][0, 0]
    assert backend.state["tick"][0] == 1


def test_the_first_slot_may_be_any():
    early, late = make(**NOISY), make(**NOISY)
    a, b = run(early, np.ones(50)), run(late, np.ones(50), first=123_456)
    for name in ("position_rad", "current_a", "force_n"):
        assert np.array_equal(a[name], b[name])


def test_the_same_seed_gives_the_same_run_bit_for_bit_and_another_does_not():
    currents = np.sin(np.arange(500) * 0.05)
    a, b, c = (run(make(seed=seed, **NOISY), currents) for seed in (7, 7, 8))
    assert a.tobytes() == b.tobytes()
    assert np.any(a["force_n"] != c["force_n"])
    assert np.array_equal(a["position_rad"], c["position_rad"]), (
        "noise of the sensors does not move the joint"
    )


def test_a_copied_state_continues_as_the_original():
    backend, other = make(**NOISY), make(**NOISY)
    run(backend, np.ones(100))
    other.state[:] = backend.state
    assert run(backend, np.ones(100), first=100).tobytes() == run(other, np.ones(100), first=100).tobytes()


def test_warming_up_changes_nothing():
    backend = make(**NOISY)
    before = backend.state.tobytes()
    backend.warm_up(records(new_ticks()))
    assert backend.state.tobytes() == before


def test_two_axes_do_not_disturb_each_other():
    options = {"axis": [{}, {"inertia_kgm2": 0.02}], "hand": [{"kind": "rest"}, {"kind": "none"}]}
    pair = make(of=rig(2), **options)
    run(pair, [[0.0, 1.0]] * 200)
    alone = make(axis=[{"inertia_kgm2": 0.02}], hand=[{"kind": "none"}])
    run(alone, [1.0] * 200)
    assert pair.state["position_rad"][0, 0] == 0
    assert pair.state["position_rad"][0, 1] == truth(alone, "position_rad") != 0


def test_the_emergency_stop_input_is_pressed_in_its_interval():
    ticks = run(make(estop_from_s=0.010, estop_to_s=0.020), np.zeros(30))
    assert np.flatnonzero(ticks["estop"]).tolist() == list(range(10, 20))


def test_wrong_numbers_of_tables_and_dependent_levers_are_refused_by_name():
    with pytest.raises(BackendError, match="axis has 3 tables; give one for all, or 2"):
        make(of=rig(2), axis=[{}, {}, {}])
    with pytest.raises(BackendError, match="no force at the tip"):
        make(of=rig(2, lever_m=[[0.0, 0.1, 0.0], [0.0, 0.2, 0.0]]))


CURRENT = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-30, 30)
SLOT = st.integers(1, 20) | st.integers(-5, 0) | st.integers(10**3, 10**9)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(CURRENT, SLOT, st.integers(0, 1)), min_size=1, max_size=30),
    st.sampled_from([1e-4, 1e-2]),
)
def test_nothing_a_controller_sends_makes_the_rig_show_or_hold_nan(cycles, period_s):
    backend = make(of=rig(period_s=period_s), **NOISY)
    tick, slot = records(new_ticks()), 0
    for current_a, jump, enabled in cycles:
        slot += jump
        tick["tick"] = slot
        backend.read(tick)
        tick["current_command_a"], tick["enabled"] = current_a, enabled
        backend.write(tick)
        for array in (backend.state, tick):
            for name in array.dtype.names:
                if array.dtype[name].base.kind == "f" and name != "current_command_a":
                    assert np.isfinite(array[name]).all(), name


PLAIN = """
import json
import sys
sys.path[:0] = [{folder!r}, {tests!r}]
import numpy as np
from mock_plant import NOISY, make, run
ticks = run(make(seed=3, **NOISY), np.sin(np.arange(40) * 0.3))
sys.stdout.write(json.dumps([ticks[name].tolist() for name in ("position_rad", "force_n", "current_a")]))
"""


def test_the_same_source_runs_as_plain_python_without_a_warning():
    here = Path(__file__).parent
    script = PLAIN.format(folder=str(here), tests=str(here.parents[1]))
    shown = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert shown.returncode == 0, shown.stderr
    plain = json.loads(shown.stdout)
    ticks = run(make(seed=3, **NOISY), np.sin(np.arange(40) * 0.3))
    for values, name in zip(plain, ("position_rad", "force_n", "current_a"), strict=True):
        assert np.allclose(values, ticks[name], rtol=1e-9, atol=1e-12)
