"""From the rig file to the arrays of the law."""

from pathlib import Path

import numpy as np
import pytest

from rtctl.check import law_plan as plan
from rtctl.check.stability_report import examine
from rtctl.control.vocabulary import Environment, Policy
from rtctl.errors import ModelError
from rtctl.friction.guarantee import holds_flicker
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[2] / "configs"


def rig(tmp_path, *changes):
    text = (CONFIGS / "mock.toml").read_text().replace('"friction/', f'"{CONFIGS}/friction/')
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return load(path)


def test_units_and_periods_are_converted_once(tmp_path):
    built = plan.build(rig(tmp_path))
    p = built.params[0]
    assert built.period_ns == 1_000_000
    assert built.ring_rows == 8000
    assert p["count_rad"][0] == pytest.approx(2 * np.pi / 160000)
    assert p["torque_rate_nm"][0] == pytest.approx(rig(tmp_path).config.axis[0].torque_rate_nm_s * 1e-3)
    assert built.command[0]["environment_kind"][0] == Environment.FREE
    assert p["friction_policy"][0] == Policy.HYBRID


def test_the_feedforward_is_capped_at_its_share_of_the_torque_limit(tmp_path):
    loaded = rig(tmp_path)
    axis, p = loaded.config.axis[0], plan.build(loaded).params[0]
    assert p["friction_cap_nm"][0] == pytest.approx(axis.friction.cap_share * axis.torque_limit_nm)
    assert 0 < p["friction_floor_nm"][0] < p["friction_ungated_cap_nm"][0] / axis.friction.gain


def test_slow_loops_keep_the_cycle_counts_and_fast_ones_the_times_of_the_safety_contract(tmp_path):
    for rate, ticks in ((100, 500), (1000, 500)):
        built = plan.build(rig(tmp_path, ("rate_hz = 1000.0", f"rate_hz = {rate}.0"), ("= 60.0", "= 5.0")))
        assert built.params[0]["soft_start_ticks"] == ticks
        assert built.params[0]["ready_ticks"] == ticks
    fast = plan.build(rig(tmp_path, ("rate_hz = 1000.0", "rate_hz = 10000.0")))
    assert fast.params[0]["soft_start_ticks"] == 5000


def test_late_ticks_are_only_counted_on_a_simulated_rig_that_need_not_be_punctual(tmp_path):
    assert plan.build(rig(tmp_path)).params[0]["late_limit_ticks"] == 0
    strict = rig(tmp_path, ('realtime = "prefer"', 'realtime = "require"'))
    assert plan.build(strict).params[0]["late_limit_ticks"] == 3


def test_without_compensation_no_model_is_needed(tmp_path):
    built = plan.build(rig(tmp_path, ('policy = "hybrid"', 'policy = "off"')))
    assert built.params[0]["friction_policy"][0] == Policy.OFF
    assert not built.model["n_segments"].any()


@pytest.mark.parametrize("policy", ["hybrid", "off"])
def test_the_proof_counts_on_what_the_law_counts_on(tmp_path, policy):
    """Without compensation the law has no model: the check counted on its friction all the same."""
    loaded = rig(tmp_path, ('policy = "hybrid"', f'policy = "{policy}"'))
    sure, params = examine(loaded).axes[0].guarantee, plan.build(loaded).params[0]
    held = holds_flicker(loaded.config.axis[0], sure, 1.0)
    assert (sure.floor_nm, sure.credited_rad, held) == (
        params["friction_floor_nm"][0],
        params["mass_rest_rad"][0],
        params["flicker_held"][0] == 1.0,
    )
    assert held == (policy != "off")


def test_a_model_of_another_rig_is_refused_with_both_names_and_the_remedy(tmp_path):
    other = rig(tmp_path, ('name = "mock"', 'name = "bench7"'))
    with pytest.raises(ModelError, match=r"'mock'.*'bench7'.*rtctl fit"):
        plan.build(other)


@pytest.mark.parametrize(
    ("rate", "stop", "hold", "lost"),
    [(100, 5, 20, 100), (500, 25, 20, 100), (1000, 50, 20, 100), (2000, 50, 40, 200), (4000, 50, 80, 400),
     (10000, 50, 200, 1000)],
)  # fmt: skip
def test_a_ramp_is_never_longer_and_a_renderers_silence_never_shorter_than_at_1_khz(
    tmp_path, rate, stop, hold, lost
):
    p = plan.build(rig(tmp_path, ("rate_hz = 1000.0", f"rate_hz = {rate}.0"), ("= 60.0", "= 5.0"))).params[0]
    assert (p["stop_ticks"], p["target_hold_ticks"], p["target_stop_ticks"]) == (stop, hold, lost)
