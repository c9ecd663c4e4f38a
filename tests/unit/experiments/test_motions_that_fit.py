"""Experiments in motion on a carriage and on a joint of short travel, simulated."""

from dataclasses import replace

import numpy as np
import pytest
from axes import MOTIONS, narrow

from rtctl.experiments import (
    identification,
    models,
    point_to_point,
    positioning,
    spring,
    still_hand,
    tracking,
    virtual,
)
from rtctl.experiments.models import Compared
from rtctl.experiments.order import Order
from rtctl.experiments.virtual import Variant
from rtctl.identify.settings import Settings, settings_of


@pytest.mark.parametrize("rig", ["carriage", "short"])
def test_every_motion_of_the_hand_is_measured_without_a_fault(mock, carriage, rig):
    loaded = carriage if rig == "carriage" else narrow(mock, -0.2, 0.2)
    for motion in MOTIONS:
        run = virtual.measure(loaded, 0, motion, Variant("on"))
        moved = float(np.ptp(run.truth["position_rad"][:, 0]))
        assert 0.2 * motion.on(loaded).amplitude_rad < moved
    assert not still_hand.held(loaded, 0, Variant("on"), 5.0, 0.1).stopped
    assert np.isfinite(spring._figures(spring._measure(Order(loaded), 0, Variant("on")))["error_rms_nm"])


@pytest.mark.parametrize("rig", ["carriage", "short"])
@pytest.mark.parametrize("experiment", [point_to_point, tracking])
def test_references_stay_within_the_travel_and_are_followed(mock, carriage, rig, experiment):
    loaded = carriage if rig == "carriage" else narrow(mock, -0.2, 0.2)
    order, axis = Order(loaded, seeds=1), loaded.config.axis[0]
    none = Compared("none", np.zeros(1, models.MODEL), float("nan"), "-")
    cases = experiment.cases_of(order)
    assert all(
        axis.position_min_rad < end < axis.position_max_rad for case in cases for end in case.range_rad
    )
    largest = max(cases, key=lambda case: case.range_rad[1])
    run = positioning.follow_once(order, 0, "PID", largest, none)
    assert np.abs(run.position_rad - largest.reference[:, 0])[-50:].max() < 0.5 * largest.range_rad[1]


def test_an_identification_of_a_carriage_has_the_defaults_of_its_own(carriage, monkeypatch):
    asked = []

    def fewer(loaded, given):
        asked.append(settings_of(loaded, given))
        return replace(asked[-1], train_levels=3, test_levels=2, measurements=2, spots=2, warm_up_s=1.0)

    monkeypatch.setattr(identification, "settings_of", fewer)
    kept = identification.measured(carriage, 1)
    assert asked[0].speed_max_rad_s == pytest.approx(0.2)
    assert asked[0].speed_max_rad_s < Settings().speed_max_rad_s
    assert (kept.of("train").motion, kept.of("test").motion) == ("linear", "linear")
    assert kept.of("train").branch(1)[1].max() == pytest.approx(8.0, rel=0.2)
