"""What is known for sure of dry friction: floor, length of the bristles, bank."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from hw.motion import HANDLE_M
from rtctl.check import stability_report
from rtctl.friction import artefact
from rtctl.friction.guarantee import (
    BANK_LONGEST_RAD,
    LENGTH_FACTOR,
    LENGTH_UNKNOWN_RAD,
    SPREADS,
    guarantee,
    holding_friction_nm,
    holds_flicker,
)
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"


@pytest.fixture(scope="module")
def axis():
    return load(CONFIGS / "mock.toml").config.axis[0]


@pytest.fixture(scope="module")
def learned():
    """The shipped model with a bristle length, and nothing known of places."""
    model = artefact.load(CONFIGS / "friction" / "mock.json")
    branches = tuple(replace(branch, place_spread_nm=None) for branch in model.branches)
    return replace(model, branches=branches, presliding_rad=1e-3, presliding_spread_rad=None)


def with_friction(axis, **friction):
    return axis.model_copy(update={"friction": axis.friction.model_copy(update=friction)})


def placed(model, *spreads):
    branches = zip(model.branches, spreads, strict=True)
    return replace(model, branches=tuple(replace(branch, place_spread_nm=s) for branch, s in branches))


def test_the_floor_is_the_least_of_the_curve_less_the_worse_of_error_and_places_and_less_drift(axis, learned):
    least, error = float(learned.friction_min_nm.min()), float(learned.error_max_nm.max())
    assert guarantee(axis, learned).floor_nm == pytest.approx(least - error)
    assert guarantee(axis, placed(learned, 0.5 * error, 0.0)).floor_nm == pytest.approx(least - error)
    assert guarantee(axis, placed(learned, 0.01, 0.04)).floor_nm == pytest.approx(least - max(error, 0.04))
    drifted = guarantee(with_friction(axis, drift_nm=0.03), placed(learned, 0.01, 0.04))
    assert drifted.floor_nm == pytest.approx(least - max(error, 0.04) - 0.03)
    assert drifted.doubt_nm == pytest.approx(max(error, 0.04) + 0.03)
    assert guarantee(with_friction(axis, drift_nm=9.0), learned).floor_nm == 0.0
    assert guarantee(axis, None).floor_nm == 0.0


def test_sliding_may_be_less_in_doubt_than_all_of_it_and_the_floor_is_not_raised_for_that(axis, learned):
    rough = placed(learned, 0.01, 0.04)
    news_nm = axis.friction.drift.warn_share * float(rough.friction_min_nm.min())
    assert guarantee(axis, rough).sliding_doubt_nm == min(news_nm, guarantee(axis, rough).doubt_nm), (
        "nothing is known of it"
    )
    known = replace(rough, branches=tuple(replace(one, sliding_doubt_nm=0.012) for one in rough.branches))
    drifted = with_friction(axis, drift_nm=0.003)
    assert guarantee(drifted, known).sliding_doubt_nm == pytest.approx(0.015)
    assert guarantee(drifted, known).floor_nm == guarantee(drifted, rough).floor_nm
    worse = replace(rough, branches=tuple(replace(one, sliding_doubt_nm=0.5) for one in rough.branches))
    assert guarantee(axis, worse).sliding_doubt_nm == guarantee(axis, worse).doubt_nm
    half = replace(known, branches=(known.branches[0], rough.branches[1]))
    assert guarantee(axis, half).sliding_doubt_nm == guarantee(axis, rough).sliding_doubt_nm
    stated = with_friction(axis, drift_nm=0.5)
    assert guarantee(stated, known).sliding_doubt_nm == pytest.approx(news_nm), "what is stated is no place"


@pytest.mark.parametrize(
    ("given", "known", "length", "source"),
    [
        (2e-3, 1e-3, 2e-3, "rig file"),
        (0.0, 1e-3, 1e-3, "model"),
        (2e-3, None, 2e-3, "rig file"),
        (0.0, None, LENGTH_UNKNOWN_RAD, "assumed"),
    ],
)
def test_the_length_is_the_rig_files_or_the_models_or_assumed(axis, learned, given, known, length, source):
    sure = guarantee(with_friction(axis, presliding_rad=given), replace(learned, presliding_rad=known))
    assert (sure.length_rad, sure.length_source) == (length, source)
    assert sure.measured == (source != "assumed")
    assert sure.credited_rad == pytest.approx(LENGTH_FACTOR * length)


def test_the_spread_of_a_measured_length_lengthens_what_is_credited(axis, learned):
    spread = replace(learned, presliding_spread_rad=2e-4)
    assert guarantee(axis, spread).credited_rad == pytest.approx(LENGTH_FACTOR * (1e-3 + SPREADS * 2e-4))
    given = with_friction(axis, presliding_rad=2e-3)
    assert guarantee(given, spread).credited_rad == pytest.approx(LENGTH_FACTOR * 2e-3)


def test_a_bound_of_the_length_serves_the_account_and_leaves_the_stiffness_open(axis, learned):
    bound = replace(learned, presliding_spread_rad=0.0, presliding_ramps=8)
    sure = guarantee(axis, bound)
    assert (sure.length_source, sure.measured, sure.may_be_shorter) == ("model, at most", True, True)
    assert sure.credited_rad == pytest.approx(LENGTH_FACTOR * 1e-3)
    assert "at most" in sure.length_in_doubt
    assert sure.bank_j == guarantee(axis, replace(learned, presliding_rad=None)).bank_j
    assert not guarantee(with_friction(axis, presliding_rad=2e-3), bound).may_be_shorter
    assert not guarantee(axis, replace(learned, presliding_spread_rad=1e-4)).may_be_shorter
    unknown = guarantee(axis, replace(learned, presliding_rad=None))
    assert unknown.may_be_shorter
    assert "are assumed" in unknown.length_in_doubt


@pytest.mark.parametrize(("spread_rad", "stiffest"), [(0.0, 16.0), (1e-4, 4.0)])
def test_a_certificate_tries_stiffer_bristles_where_the_length_is_only_bounded(
    tmp_path, learned, spread_rad, stiffest
):
    told = replace(learned, presliding_spread_rad=spread_rad, presliding_ramps=8, rig="admittance")
    artefact.save(told, tmp_path / "told.json")
    loaded = load(CONFIGS / "admittance.toml")
    one = with_friction(loaded.config.axis[0], presliding_rad=0.0, model=str(tmp_path / "told.json"))
    loaded = loaded.model_copy(update={"config": loaded.config.model_copy(update={"axis": [one]})})
    assert stability_report.admittance_loop(loaded, 0).bristles_to == stiffest


def test_without_a_model_nothing_is_sure_but_the_cap(axis):
    sure = guarantee(axis, None)
    assert sure.peak_nm == pytest.approx(axis.friction.cap_share * axis.torque_limit_nm)
    assert sure.length_source == "assumed"


def test_the_bank_is_two_bent_bristles_but_never_more_than_a_hand_may_be_given(axis, learned):
    sure = guarantee(axis, learned)
    assert sure.peak_nm == pytest.approx(learned.friction_max_nm)
    assert sure.bank_j == pytest.approx(sure.peak_nm * LENGTH_FACTOR * 1e-3)
    assert sure.given_most_j == pytest.approx(2.5 * sure.bank_j)
    soft = guarantee(with_friction(axis, presliding_rad=0.006), learned)
    assert soft.bank_j == pytest.approx(sure.peak_nm * LENGTH_FACTOR * 6e-3), (
        "all of one turn of soft bristles"
    )
    long = guarantee(with_friction(axis, presliding_rad=0.02), learned)
    assert long.bank_j == sure.peak_nm * BANK_LONGEST_RAD
    strong = replace(learned, branches=tuple(replace(one, friction_max_nm=10.0) for one in learned.branches))
    heavy = axis.model_copy(update={"torque_limit_nm": 60.0})
    assert guarantee(heavy, strong).bank_j == pytest.approx(10.0 * LENGTH_FACTOR * 1e-3), "15 mJ"
    slide = guarantee(heavy.model_copy(update={"motion": "linear"}), replace(strong, presliding_rad=0.02))
    assert slide.bank_j == pytest.approx(10.0 * HANDLE_M * BANK_LONGEST_RAD)
    capped = guarantee(with_friction(axis, cap_share=0.01), learned)
    assert capped.peak_nm == pytest.approx(0.01 * axis.torque_limit_nm)


@pytest.mark.parametrize(("dry_nm", "gate_nm", "observer_nm"), [(1e-3, 1e-5, 1.5e-5), (0.25, 2e-3, 3e-3)])
def test_dead_bands_go_by_the_friction_of_a_weak_joint_unless_the_rig_file_names_them(
    axis, dry_nm, gate_nm, observer_nm
):
    sure = guarantee(axis.model_copy(update={"dry_friction_nm": dry_nm}), None)
    assert (sure.gate_deadband_nm, sure.observer_deadband_nm) == pytest.approx((gate_nm, observer_nm))
    named = with_friction(
        axis, gate_deadband_nm=0.02, observer=axis.friction.observer.model_copy(update={"deadband_nm": 0.03})
    )
    sure = guarantee(named, None)
    assert (sure.gate_deadband_nm, sure.observer_deadband_nm) == (0.02, 0.03)


def test_what_nobody_knows_of_a_carriage_is_as_at_a_handle(axis):
    slide = axis.model_copy(update={"motion": "linear", "dry_friction_nm": 0.0})
    sure = guarantee(with_friction(slide, intent_nm=0.0), None)
    assert sure.length_rad == pytest.approx(HANDLE_M * LENGTH_UNKNOWN_RAD)
    assert sure.intent_nm == pytest.approx(0.2 * 2.5)


def test_what_opens_gate_and_intent_goes_by_the_joints_friction_unless_the_rig_file_names_it(axis, learned):
    unnamed = with_friction(axis, intent_nm=0.0, gate_nm=0.0)
    least = float(learned.friction_min_nm.min())
    by_model = guarantee(unnamed, learned)
    assert (by_model.intent_nm, by_model.gate_nm) == pytest.approx((0.2 * least, 0.1 * least))
    by_file = guarantee(unnamed.model_copy(update={"dry_friction_nm": 0.01}), None)
    assert (by_file.intent_nm, by_file.gate_nm) == pytest.approx((0.002, 0.001))
    unknown = guarantee(unnamed.model_copy(update={"dry_friction_nm": 0.0}), None)
    assert (unknown.intent_nm, unknown.gate_nm) == pytest.approx((0.05, 0.025))
    named = guarantee(with_friction(axis, intent_nm=0.07, gate_nm=0.04), learned)
    assert (named.intent_nm, named.gate_nm) == (0.07, 0.04)


def test_friction_that_is_all_behind_the_spring_holds_no_flicker(axis):
    sure = guarantee(axis, None)
    assert holding_friction_nm(axis, 0.0) == math.inf
    assert not holds_flicker(axis, sure, 0.0)
