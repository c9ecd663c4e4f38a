"""Point-to-point and tracking by the law's own program: as the simulation says, and honest where a rig
cannot.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtctl.control.records import MODEL
from rtctl.control.vocabulary import Program
from rtctl.errors import ConfigError, DataError, FaultError, HandOnRigError
from rtctl.experiments import point_to_point, positioning, positioning_on_rig, tracking
from rtctl.experiments.kept_runs import KeptRuns
from rtctl.experiments.models import Compared
from rtctl.experiments.order import Order
from rtctl.experiments.simulated_identification import drive
from rtctl.friction import artefact
from rtctl.identify.settings import without_feedforward
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

CONFIGS = Path(__file__).parents[2] / "configs"
NONE = Compared("none", np.zeros(1, MODEL), float("nan"), "-")


@pytest.fixture(scope="module")
def shipped():
    return Compared("shipped", artefact.load(CONFIGS / "friction/mock.json").record(), 0.0, "-")


@pytest.fixture
def order():
    return Order(load(CONFIGS / "mock-identify.toml"), simulate=False)


def driven(order, cases, model, change=lambda _simulation: None):
    """Every run of a session, driven on a simulation of the whole loop."""
    simulation = Simulation(without_feedforward(order.loaded))
    simulation.model[0] = model.record[0]
    change(simulation)
    rig = positioning_on_rig.require(order, cases)
    session = positioning_on_rig.Session(order, rig, cases, model, (0.0, 1.0))
    drive(simulation, session.steps(), 0)
    return session.runs


@pytest.mark.parametrize("which", ["none", "shipped"])
def test_the_loop_does_what_the_simulated_controller_does(order, shipped, which):
    model = {"none": NONE, "shipped": shipped}[which]
    for module, case in (
        (point_to_point, point_to_point.cases_of(order)[2]),
        (tracking, tracking.cases_of(order)[3]),
    ):
        runs = driven(order, [case], model)
        for controller in positioning.CONTROLLERS:
            found = module.judge(case, runs[controller, case.name, model.name])
            told = module.judge(case, positioning.follow_once(order, 0, controller, case, model))
            for name in ("effort_nm", "steady_error_rad", "error_rms_rad"):
                if name in found:
                    assert found[name] == pytest.approx(told[name], rel=0.15, abs=1e-4)


def test_at_a_slow_rate_the_soft_servo_has_time_to_bring_the_joint_home(order):
    config = order.loaded.config
    slow = config.model_copy(update={"loop": config.loop.model_copy(update={"rate_hz": 250.0})})
    order = replace(order, loaded=order.loaded.model_copy(update={"config": slow}))
    cases = point_to_point.cases_of(order)
    runs = driven(order, cases, NONE)
    assert len(runs) == len(positioning.CONTROLLERS) * len(cases)


def losing(steps, times):
    """The same procedure, which does not get some ticks of its first `times` runs."""
    order = next(steps)
    while True:
        rows = yield order
        tracked = rows["program_kind"][:, 0] == Program.TRACK
        if times > 0 and tracked.sum() > 200:
            times, rows = times - 1, np.concatenate([rows[:100], rows[150:]])
        try:
            order = steps.send(rows)
        except StopIteration:
            return


def lossy(order, shipped, times):
    cases = point_to_point.cases_of(order)[2:3]
    said = []
    order = replace(order, announce=said.append)
    simulation = Simulation(without_feedforward(order.loaded))
    simulation.model[0] = shipped.record[0]
    rig = positioning_on_rig.require(order, cases)
    session = positioning_on_rig.Session(order, rig, cases, shipped, (0.0, 1.0))
    drive(simulation, losing(session.steps(), times), 0)
    return session.runs, cases[0], said


def test_a_run_of_which_ticks_were_lost_is_measured_again(order, shipped):
    runs, case, said = lossy(order, shipped, 1)
    assert len(runs["PD", case.name, "shipped"].position_rad) == len(case.reference)
    assert sum("measured again" in text for text in said) == 1


def test_ticks_that_are_always_lost_end_it(order, shipped):
    with pytest.raises(DataError, match=r"ticks were lost .* 4 times"):
        lossy(order, shipped, 99)


def test_a_session_measures_only_what_is_not_kept_yet(order, shipped):
    cases = point_to_point.cases_of(order)[2:4]
    rig = positioning_on_rig.require(order, cases)
    done = {(controller, cases[0].name, "shipped") for controller in positioning.CONTROLLERS}
    session = positioning_on_rig.Session(order, rig, cases, shipped, (0.0, 1.0), done)
    assert session.todo == [(controller, cases[1]) for controller in positioning.CONTROLLERS]


def test_what_was_measured_before_a_fault_is_kept_and_a_second_start_goes_on(
    order, shipped, tmp_path, monkeypatch
):
    """The loop is a simulation here; the first one dies in its second case."""
    cases = point_to_point.cases_of(order)[2:4]
    here = replace(order, out=tmp_path)
    simulations = iter([1, None])

    class Run:
        def __init__(self, loaded, observers, model, **_rest):
            self.simulation, self.watcher = Simulation(loaded), observers[0]
            self.simulation.model[0] = model[0]
            self.dies_after = next(simulations)

        def __enter__(self):
            return self

        def __exit__(self, *_error):
            return None

        def run(self):
            cases_seen = []

            def watch(rows):
                flags = rows["program_kind"][:, 0]
                cases_seen.append(bool((flags == Program.TRACK).any()))
                if self.dies_after is not None and sum(np.diff(cases_seen) > 0) > self.dies_after:
                    raise FaultError("pulled out")

            drive(self.simulation, self.watcher._steps, 0, watch)
            self.watcher.complete = True

    monkeypatch.setattr(positioning_on_rig, "Host", Run)
    kept = KeptRuns(tmp_path, {}, resume=False)
    kept.models = [shipped]
    with pytest.raises(FaultError, match="pulled out"):
        positioning_on_rig.run_all(here, cases, point_to_point.judge, kept)
    again = KeptRuns(tmp_path, {}, resume=True)
    assert list(again.runs) == [("PD", cases[0].name, "shipped")]
    before = again.runs["PD", cases[0].name, "shipped"].position_rad.copy()
    found = positioning_on_rig.run_all(here, cases, point_to_point.judge, again)
    assert set(found["PID"]) == {case.name for case in cases}
    assert again.runs["PD", cases[0].name, "shipped"].position_rad.tolist() == before.tolist()


def test_a_hand_that_stays_ends_it(order, shipped):
    def grip(simulation):
        axis = simulation.plant_params[0]
        axis["hand_kind"][0], axis["hand_stiffness_nm_rad"][0], axis["hand_damping_nms_rad"][0] = 1, 5.0, 0.1
        axis["hand_sine_rad"][0, 0], axis["hand_sine_rad_s"][0, 0] = 0.5, 3.0

    with pytest.raises(HandOnRigError):
        driven(order, point_to_point.cases_of(order)[:1], shipped, grip)


def test_a_stuck_joint_is_said_to_fall_behind(order):
    def stuck(simulation):
        simulation.plant_params["inertia_kgm2"] = 50.0

    with pytest.raises(DataError, match=r"does not follow|ended the motion"):
        driven(order, tracking.cases_of(order)[3:4], NONE, stuck)


def changed(order, **values):
    config = order.loaded.config
    axis = config.axis[0].model_copy(update=values)
    return replace(
        order, loaded=order.loaded.model_copy(update={"config": config.model_copy(update={"axis": (axis,)})})
    )


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"encoder_counts_per_rev": 1000.0}, "encoder_counts_per_rev"),
        ({"velocity_limit_rad_s": 1.0}, "velocity_limit_rad_s"),
        ({"position_min_rad": -0.2, "position_max_rad": 0.2}, "travel"),
    ],
)
def test_what_a_rig_lacks_is_named_before_it_arms(order, values, named):
    with pytest.raises(ConfigError, match=named):
        positioning_on_rig.require(changed(order, **values), tracking.cases_of(order))
