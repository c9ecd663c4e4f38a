"""The compiled closed loop is the loop: same ticks, continued at will, armed as by an operator."""

from pathlib import Path

import numpy as np
import pytest
from one_by_one import require_same, ticks_one_by_one

from rtctl.control.vocabulary import State
from rtctl.errors import ConfigError, FaultError
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def loaded():
    return load(CONFIGS / "mock.toml")


def test_it_gives_the_ticks_that_backend_and_law_give_one_by_one(loaded):
    simulation = Simulation(loaded)
    trace = np.concatenate([simulation.run(0.8), simulation.run(1.2, arm_count=1)])

    require_same(ticks_one_by_one(loaded, loaded.options, 2000, arm_at=800), trace)
    assert trace["state"][-1] == State.ACTIVE
    assert np.any(trace["torque_applied_nm"] != 0)


def test_two_runs_are_one_run(loaded):
    whole, parts = Simulation(loaded), Simulation(loaded)
    whole.arm()
    parts.arm()
    assert whole.run(1.0).tobytes() == np.concatenate([parts.run(0.3), parts.run(0.7)]).tobytes()


def test_a_decimated_trace_holds_every_nth_tick(loaded):
    full, thin = Simulation(loaded), Simulation(loaded)
    trace = full.run(1.0)
    assert trace[9::10].tobytes() == thin.run(1.0, every=10).tobytes()
    assert full.time_s == thin.time_s == pytest.approx(1.0)


def test_the_truth_stands_beside_the_trace(loaded):
    simulation = Simulation(loaded)
    trace = simulation.run(2.0)
    shown, true = trace["position_rad"][1:, 0], simulation.truth["position_rad"][:-1, 0]
    assert np.max(np.abs(true)) > 0.1
    assert np.all((true - shown >= -1e-12) & (true - shown < 4e-5)), "the encoder truncates to its count"


def test_arming_ends_in_active_with_full_authority(loaded):
    simulation = Simulation(loaded)
    trace = simulation.arm(compensation=0.5)
    assert trace["state"][-1] == State.ACTIVE
    assert trace["authority"][-1] == 1.0
    assert trace["compensation"][-1, 0] == 0.5
    assert trace["tick"].tolist() == list(range(len(trace)))


def test_a_rig_that_cannot_be_armed_says_in_which_state_it_is(loaded):
    simulation = Simulation(loaded)
    simulation.plant_params["estop_to_s"] = 1e9
    with pytest.raises(FaultError, match="ESTOP"):
        simulation.arm()


def test_only_a_mock_can_be_simulated(loaded):
    device = loaded.config.device[0].model_copy(update={"kind": "playback"})
    other = loaded.model_copy(update={"config": loaded.config.model_copy(update={"device": (device,)})})
    with pytest.raises(ConfigError, match="only 'mock' can be simulated"):
        Simulation(other)


SHOWN_BY_SOME_MOTIONS = ("running_delay_ticks", "running_gain", "running_offset_nm", "force_offset_nm")


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("mock*.toml")), ids=lambda path: path.stem)
def test_every_shipped_rig_runs_armed_without_a_fault(path):
    simulation = Simulation(load(path))
    simulation.arm()
    trace = simulation.run(6.0)
    assert np.all(trace["state"] == State.ACTIVE)
    assert np.all(trace["faults"] == 0)
    for name in trace.dtype.names:
        if name not in SHOWN_BY_SOME_MOTIONS:
            assert np.isfinite(trace[name]).all(), name
