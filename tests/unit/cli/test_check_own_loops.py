"""Rows of `rtctl check` on current loops that overshoot, on gears with play (decision 0168), and on samples
that were measured in ticks."""

import pytest
from checked_rig import edited, learned, rows_of, writer

from rtctl.check.law_plan import build
from rtctl.check.stability_report import examine
from rtctl.check.verdict import Outcome
from rtctl.rig_file.config import load


@pytest.fixture
def rig(tmp_path):
    return writer(tmp_path, learned())


def drive(path, *lines):
    return edited(path, ("[axis.environment]", "\n".join(("[axis.drive]", *lines, "[axis.environment]"))))


def test_a_current_that_overshoots_costs_stiffness_and_the_watch_bears_no_more_than_declared(rig):
    loop = "current_loop_hz = 200.0"
    said = ("current_overshoot = 0.0", "", "current_overshoot = 0.16")
    first, plain, over = (load(drive(rig(k_c=30.0), loop, more)) for more in said)
    most = [examine(one).axes[0].sampled_data_k_max_nm_rad for one in (first, plain, over)]
    assert most == pytest.approx([44.0, 42.86, 32.77], abs=0.02)
    refused = rows_of(drive(rig(k_c=36.0), loop, "current_overshoot = 0.16"))["coupling, sampled and late"]
    assert "a current loop of 200 Hz that overshoots by 0.16 (rig file)" in refused.refusal
    late_s = 1 / (2 * 3.141592653589793 * 200)
    covered = [build(one).params["proof_delay_s"][0, 0] for one in (first, plain, over)]
    assert covered[0] > covered[1] + 0.03e-3 > 1.1 * late_s
    assert covered[2] == pytest.approx(late_s)
    limits = [build(one).params["current_overshoot_limit"][0, 0] for one in (first, plain, over)]
    assert limits == pytest.approx([0.05, 0.05, 0.1875])


def test_an_overshoot_is_of_the_coupling_alone_and_wants_its_lag(rig):
    loop = ("current_loop_hz = 200.0", "current_overshoot = 0.16")
    for silent in (("",), (loop[0], "current_overshoot = 0.0")):
        assert "current that overshoots" not in rows_of(drive(rig(k_c=30.0), *silent))
    for more, outcome in (({}, Outcome.PASS), ({"model": "model.json"}, Outcome.NOT_PROVED)):
        for said in (loop, loop[:1]):
            row = rows_of(drive(rig(k_c=30.0, **more), *said))["current that overshoots"]
            assert row.outcome is outcome
            assert ("rtctl probe --pulses" in row.meaning) == (said == loop[:1])
    row = rows_of(drive(rig(k_c=30.0), loop[1]))["current that overshoots"]
    assert row.outcome is Outcome.FAIL
    assert "drive.current_loop_hz" in row.refusal


def test_a_coupling_that_a_loop_of_first_order_bears_is_told_how_to_say_that_it_is_one(rig):
    loop = "current_loop_hz = 200.0"
    refused = [rows_of(drive(rig(k_c=k_c), loop))["coupling, sampled and late"] for k_c in (43.5, 44.5)]
    assert all(row.outcome is Outcome.FAIL for row in refused)
    assert ["passes with drive.current_overshoot = 0" in row.refusal for row in refused] == [True, False]
    row = rows_of(drive(rig(k_c=43.5), loop, "current_overshoot = 0.0"))["coupling, sampled and late"]
    assert row.outcome is Outcome.PASS


def test_what_the_damper_of_a_joint_proves_a_gear_with_play_does_not_have(rig):
    # .02 at the motor, .012 by the joint's damper: b_c + k_c T/2
    elastic = ("motor_share = 0.4", "joint_damping_nms_rad = 0.02")
    rows = [rows_of(drive(rig(k_c=k_c), *elastic))["elastic joint"] for k_c in (19.0, 25.0)]
    assert [row.outcome for row in rows] == [Outcome.PASS, Outcome.NOT_PROVED]
    assert "play of a gear that is 0.02" in rows[1].meaning


def test_samples_measured_in_ticks_are_as_many_at_another_rate(rig):
    slow = ("[axis.environment]", "[axis.measured]\nsample_ticks = 4\n[axis.environment]")
    assert (
        "750 at most, where measured.sample_ticks is to be measured anew"
        in rows_of(edited(rig(), slow))["fresh samples"].refusal
    )
