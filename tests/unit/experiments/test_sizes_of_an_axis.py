"""Experiments on a carriage and on a joint of short travel: motions that fit, units of the axis, errors that
say why.
"""

import json

import numpy as np
import pytest
from axes import MOTIONS, narrow

from hw.motion import own_size
from rtctl import pictures
from rtctl.control.vocabulary import Fault, State, state_and_cause
from rtctl.errors import ConfigError, DataError
from rtctl.experiments import (
    comparison,
    point_to_point,
    policies,
    registry,
    stability_map,
    still_hand,
    tracking,
    virtual,
)
from rtctl.experiments.one_mass import Device
from rtctl.experiments.order import Order
from rtctl.experiments.registry import EXPERIMENTS
from rtctl.experiments.report import Outcome, Part, in_units_of
from rtctl.experiments.virtual import FAST_SINE, PUSH
from rtctl.friction.learn.report_tables import Table
from rtctl.plain_data import as_data
from rtctl.tick import new_ticks


def test_a_joint_with_room_has_the_motions_as_they_were_written(mock):
    assert [one.on(mock) for one in MOTIONS] == list(MOTIONS)
    assert [case.name for case in tracking.cases_of(Order(mock))][-1] == "triangle 0.5 rad/s"


def test_a_carriage_has_them_as_at_its_handle_with_the_same_periods(carriage):
    for one in MOTIONS:
        own = one.on(carriage)
        assert own.amplitude_rad == pytest.approx(0.1 * one.amplitude_rad)
        assert (own.top_rad_s, own.period_s) == pytest.approx((0.1 * one.top_rad_s, one.period_s))


@pytest.mark.parametrize("travel", [(-0.2, 0.2), (-5.0, 0.2), (-0.2, 5.0)])
def test_the_nearer_end_and_the_velocity_limit_make_a_motion_smaller(mock, travel):
    short = narrow(mock, *travel)
    assert PUSH.on(short).amplitude_rad == pytest.approx(0.16)
    assert PUSH.on(short).period_s == pytest.approx(PUSH.period_s)
    slow = narrow(mock, -5.0, 5.0, velocity_limit_rad_s=0.5)
    assert FAST_SINE.on(slow).top_rad_s == pytest.approx(0.4)


def test_a_rig_that_starts_at_an_end_is_refused_by_the_key(mock, carriage):
    with pytest.raises(ConfigError, match="start_position_rad 0"):
        PUSH.on(narrow(mock, 0.0, 1.0))
    with pytest.raises(ConfigError, match="position_min_m to position_max_m are 0 to 1 m"):
        PUSH.on(narrow(carriage, 0.0, 1.0))


def test_a_hand_nobody_told_holds_a_carriage_as_at_its_handle_and_a_told_one_as_told(carriage):
    told = virtual.make(carriage, 0).plant_params["hand_stiffness_nm_rad"][0, 0]
    table = carriage.config.device[0]
    free = table.model_copy(update={"options": {**table.options, "hand": [{"kind": "none"}]}})
    config = carriage.config.model_copy(update={"device": (free,)})
    hand = [{**one, "stiffness_nm_rad": 5.0, "damping_nms_rad": 0.1} for one in carriage.options["hand"]]
    made = virtual.make(
        carriage.model_copy(update={"config": config, "options": {**carriage.options, "hand": hand}}), 0
    )
    assert made.plant_params["hand_stiffness_nm_rad"][0, 0] == pytest.approx(told)  # 500 N/m either way


def test_thresholds_and_names_of_policies_are_those_of_the_axis():
    still = still_hand.Still(0.0005, 0.0, stopped=False)
    assert still.faults() == []
    assert still.faults("linear") == ["shakes a hand that holds still"]
    assert policies.own_names("tanh .02 rad/s, encoder of 8000 counts", "linear") == (
        "tanh 2 mm/s, encoder with steps of 79 um"
    )
    assert "500 to 50000 N m/rad" in policies._explanation("linear")


def test_steps_of_a_carriage_are_named_in_mm(carriage):
    names = [case.name for case in point_to_point.cases_of(Order(carriage))]
    assert names[0] == "step 1 mm"
    assert tracking.cases_of(Order(carriage))[-1].name == "triangle 50 mm/s"


def test_a_page_of_a_carriage_speaks_in_its_units_and_a_joint_s_is_left_alone():
    table = Table("at 0.002 rad/s", ("torque, mN m",), (("as hand_rms_nm",),))
    made = Outcome("x", "X", "5 mN m", (Part("P", ("3 N m/rad",), (table,)),), (), {"a_nm": {"b_rad": 1.0}})
    assert in_units_of(made, "rotary") is made
    own = in_units_of(made, "linear")
    assert json.dumps(as_data(own.numbers)) == '{"a_n": {"b_m": 1.0}}'
    assert (own.key, own.parts[0].paragraphs) == ("5 mN", ("3 N/m",))
    shown = own.parts[0].shown[0]
    assert (shown.caption, shown.header, shown.rows) == (
        "at 2 mm/s",
        ("force, mN",),
        (("as hand_rms_n",),),
    )


def test_pictures_of_a_carriage_are_labelled_in_its_units(carriage, monkeypatch):
    labels = []
    monkeypatch.setattr(
        pictures,
        "png",
        lambda figure: labels.extend((one.get_xlabel(), one.get_ylabel()) for one in figure.axes),
    )
    once = {"PD": {"a sine": {"none": {name: np.ones(2) for name in tracking.FIGURES}}}}
    comparison.parts(Order(carriage), once, tracking.FIGURES)
    device = Device(2.0, 8.0, 1e-3, "linear")
    edges = [1e4] * len(stability_map.SHARES)
    stability_map._picture(device, {1: edges}, {0.5: edges})
    assert labels == [("RMS error [mm]", ""), *[("b_c [N s/m]", "k_c [N/m]")] * 2]


def test_the_admittance_experiment_refuses_what_its_hands_do_not_fit(mock, carriage):
    with pytest.raises(ConfigError, match=r"axis\[0\].motion"):
        EXPERIMENTS["admittance"].run(Order(carriage))
    with pytest.raises(ConfigError, match=r"axis\[0\].position_min_rad"):
        EXPERIMENTS["admittance"].run(Order(narrow(mock, -0.2, 0.2)))


def test_all_experiments_together_leave_out_what_a_carriage_cannot_do(carriage, monkeypatch):
    ran = []
    monkeypatch.setattr(registry.Experiment, "run", lambda self, _order: ran.append(self.name))
    registry.papers(Order(carriage))
    assert "admittance" not in ran
    assert "free-motion" in ran


def test_a_rig_that_stopped_is_told_with_its_first_fault():
    trace = new_ticks(1, 1)
    trace["state"], trace["fault_first"], trace["faults"] = State.FAULT, 2, 0
    assert state_and_cause(trace[0]) == f"FAULT by {Fault.JUMP.name}"
    with pytest.raises(DataError, match="for FAULT by JUMP"):
        virtual.require_active(trace, "spring")
    trace["state"], trace["fault_first"] = State.IDLE, -1
    assert state_and_cause(trace[0]) == "IDLE"


def test_own_scales_a_carriage_alone():
    assert own_size("stiffness_nm_rad", 5.0, "linear") == pytest.approx(500.0)
    assert own_size("stiffness_nm_rad", 5.0, "rotary") == 5.0
