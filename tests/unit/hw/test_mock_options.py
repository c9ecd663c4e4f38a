"""Faults in `[device.options]` of the mock are refused, each by its key."""

import json
import math

import pytest
from pydantic import ValidationError

from hw.simulators.mock_options import MockOptions


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({"sead": 1}, "sead"),
        ({"seed": -1}, "seed"),
        ({"seed": 1.0}, "seed"),
        ({"substeps": 1001}, "substeps"),
        ({"time_to_live_ticks": 51}, "time_to_live_ticks"),
        ({"axis": []}, "axis"),
        ({"axis": [{"inertia_kgm2": 0}]}, "inertia_kgm2"),
        ({"axis": [{"inertia_kgm2": math.nan}]}, "inertia_kgm2"),
        ({"axis": [{"current_noise_a": math.inf}]}, "current_noise_a"),
        ({"axis": [{"torque_delay_ticks": 17}]}, "torque_delay_ticks"),
        ({"axis": [{"inertia": 0.1}]}, "inertia"),
        ({"axis": [{"inertia_kgm2": "0.012"}]}, "inertia_kgm2"),
        ({"axis": [{"friction": {"coulomb_nm": 0}}]}, "coulomb_nm"),
        ({"axis": [{"friction": {"model": "dahl"}}]}, "model"),
        ({"axis": [{"friction": {"elastic_share": 1.0}}]}, "elastic_share"),
        ({"axis": [{"friction": {"modulation_share": 1.0}}]}, "modulation_share"),
        ({"force": {"bias_n": [0.0, 0.0]}}, "bias_n"),
        ({"velocity": {"lag_s": 2.0}}, "lag_s"),
        ({"velocity": {"noise_rad_s": math.nan}}, "noise_rad_s"),
        ({"velocity": {"sensor": True}}, "sensor"),
        ({"force": {"bias_n": [0.0, math.nan, 0.0]}}, "bias_n"),
        ({"force": {"crosstalk": [[1.0, 0.0, 0.0]]}}, "crosstalk"),
        ({"hand": [{"kind": "wave"}]}, "kind"),
        ({"hand": [{"frequency_hz": 0.0}]}, "frequency_hz"),
        ({"hand": [{"grips_s": [[0.0, 1.0]] * 9}]}, "grips_s"),
        ({"hand": [{"kind": "sines", "sines": [[0.1, 1.0]] * 5}]}, "sines"),
    ],
)
def test_a_bad_value_is_refused_under_its_key(table, key):
    with pytest.raises(ValidationError) as refused:
        MockOptions.model_validate(table)
    assert key in {part for fault in refused.value.errors() for part in fault["loc"]}


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({"axis": [{"friction": {"coulomb_nm": 0.4}}]}, "breakaway_nm 0.35 must not be below coulomb_nm 0.4"),
        ({"hand": [{"kind": "sines"}]}, "at least one"),
        ({"hand": [{"kind": "triangle", "amplitude_rad": -0.1}]}, "positive"),
        ({"hand": [{"kind": "push", "amplitude_rad": 0.0}]}, "at least 1e-4"),
        ({"hand": [{"grips_s": [[2.0, 1.0]]}]}, "ends before it begins"),
        ({"estop_from_s": 5.0}, "estop_to_s 0 lies before estop_from_s 5: never pressed"),
        (
            {"faults": [{"channel": "velocity", "kind": "nan", "at_s": 1.0, "for_s": 0.0}]},
            "needs a sensor",
        ),
    ],
)
def test_pairs_that_contradict_each_other_are_refused_with_the_reason(table, text):
    with pytest.raises(ValidationError, match=text):
        MockOptions.model_validate(table)


def test_all_faults_are_reported_at_once():
    with pytest.raises(ValidationError) as refused:
        MockOptions.model_validate({"seed": -1, "axis": [{"inertia_kgm2": 0}], "hand": [{"kind": "wave"}]})
    assert refused.value.error_count() == 3


def test_the_dump_is_plain_data_that_validates_to_itself():
    options = MockOptions.model_validate(
        {
            "hand": [{"kind": "sines", "sines": [[0.1, 1.0]], "grips_s": [[0.0, 3.0]]}],
            "force": {"bias_n": [1.0, 2.0, 3.0]},
        }
    )
    dump = json.loads(json.dumps(options.model_dump(mode="json")))
    assert MockOptions.model_validate(dump) == options


def test_the_defaults_are_the_nominal_joint_of_the_theory():
    axis = MockOptions().axis[0]
    assert (axis.inertia_kgm2, axis.friction.viscous_nms_rad, axis.friction.coulomb_nm) == (0.012, 0.05, 0.25)
    assert (axis.friction.breakaway_nm, axis.friction.stribeck_rad_s, axis.friction.stribeck_exponent) == (
        0.35,
        0.1,
        2,
    )
    assert (axis.friction.bristle_stiffness_nm_rad, axis.friction.bristle_damping_nms_rad) == (250.0, 1.0)
