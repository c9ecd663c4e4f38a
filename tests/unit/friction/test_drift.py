"""The watch over the friction (docs/theory.md 5.9): factor and offset from ordinary motion, on joints whose
factor is known.
"""

import math
from functools import cache

import numpy as np
import pytest

from rtctl.check.law_plan import build
from rtctl.control.friction_curve import branch_magnitude
from rtctl.control.jit import records
from rtctl.control.vocabulary import State
from rtctl.friction import drift_state as state
from rtctl.friction.drift_deployed import deployed
from rtctl.friction.drift_sliding import bell
from rtctl.friction.drift_strokes import STROKES
from rtctl.friction.drift_watch import RigWatch
from rtctl.rig_file.config import load
from rtctl.rig_file.friction_tables import DriftTable
from tests.drifting_joint import PEOPLE, SHORT, Joint, ticks_of

RATE_HZ = 400.0


@cache
def plan():
    return build(load("configs/mock.toml"))


def arrays():
    params = plan().params.copy()
    params["period_s"] = 1 / RATE_HZ
    return params, plan().model


def watch(**keys):
    return RigWatch(*arrays(), [DriftTable(**keys)])


def over(rows, batch=200, **keys):
    """The one axis after these ticks, in batches."""
    rig = watch(**keys)
    for k in range(0, len(rows), batch):
        rig.follow(rows[k : k + batch])
    rig.look()
    return rig.axes[0]


TRUTHS = (0.7, 0.9, 0.95, 1.0, 1.1, 1.3)


def test_the_factor_of_a_lugre_joint_is_found_and_lies_in_its_interval():
    for truth, rows in zip(TRUTHS, ticks_of([Joint(factor=k) for k in TRUTHS], 32.0), strict=True):
        found = over(rows).found
        assert abs(found.factor - truth) < 0.015
        assert abs(found.factor - truth) < 2 * found.factor_error < 0.04


def test_each_direction_and_the_offset_are_told_with_what_motion_leaves_open():
    symmetric, backward = ticks_of([Joint(offset=0.02), Joint(backward=1.3)], 40.0)
    found = over(symmetric).found
    assert abs(found.offset_nm - 0.02) < 2 * found.offset_error_nm < 0.06
    for factor, error in ((found.forward, found.forward_error), (found.backward, found.backward_error)):
        assert abs(factor - 1.0) < 2 * error
    assert over(next(ticks_of([Joint(backward=1.1)], 40.0))).warning == "", "not told from an offset"
    found = over(backward).found
    assert found.backward > found.forward + 0.05
    assert abs(found.factor - 1.15) < 0.03


def test_ten_percent_are_told_within_a_minute_of_motion_and_no_change_is_not():
    joints = [
        Joint(sines=sines, elements=8 * (i % 3 > 0), later=(0.9, 1.1, None)[i % 3], later_s=28.0)
        for i, sines in enumerate(PEOPLE + PEOPLE[1:4])
    ]
    for joint, rows in zip(joints, ticks_of(joints, 92.0), strict=True):
        rig, moved_s = watch(), 0.0
        for k in range(0, len(rows), 100):
            rig.follow(rows[k : k + 100])
            if k >= 28.0 * RATE_HZ:
                moved_s += float((np.abs(rows["velocity_rad_s"][k : k + 100]) > 0.03).mean()) * 100 / RATE_HZ
            else:
                assert rig.axes[0].warning == ""
            if moved_s >= 60.0:
                break
        axis = rig.axes[0]
        assert bool(axis.warning) == (joint.later is not None), joint
        assert abs(axis.found.factor - (joint.later or 1.0)) < 0.02, joint


def test_strokes_that_are_short_against_the_bristles_say_nothing():
    for rows in ticks_of(
        [Joint(sines=SHORT, factor=k, elements=n) for k in (0.7, 1.0) for n in (0, 8)], 60.0
    ):
        axis = over(rows)
        assert axis.found is None
        assert axis.warning == axis.stopped == ""


def damage(rows, kind):
    at = np.arange(len(rows)) % 700 < 40
    if kind == "not a number":
        rows["motor_torque_nm"][at] = math.nan
    elif kind == "a fault":
        rows["faults"][at], rows["hand_torque_nm"][at] = 1, 5.0
    elif kind == "old samples":
        rows["sample_age_ticks"][at] = np.maximum(np.arange(len(rows)) % 700, 3)[at]
        rows["position_rad"][at] = 0.0
    elif kind == "not active":
        rows["state"][at], rows["motor_torque_nm"][at] = State.IDLE, 0.0
    elif kind == "missed":
        return rows[~at]
    return rows


@pytest.mark.parametrize("kind", ["not a number", "a fault", "old samples", "not active", "missed"])
def test_what_is_no_sample_of_the_motion_is_left_out(kind):
    (rows,) = ticks_of([Joint(factor=0.9)], 60.0)
    assert abs(over(damage(rows, kind)).found.factor - 0.9) < 0.015


def test_a_tare_begins_an_offset_of_its_own():
    (rows,) = ticks_of([Joint(factor=1.0)], 40.0)
    half = len(rows) // 2
    rows["hand_torque_nm"][half:] += 0.06
    rows["state"][half - 100 : half] = State.IDLE
    found = over(rows).found
    assert abs(found.factor - 1.0) < 0.015
    assert abs(found.offset_nm - 0.068) < 2 * found.offset_error_nm


def test_it_makes_no_difference_in_which_batches_the_ticks_come():
    (rows,) = ticks_of([Joint(factor=1.1)], 30.0)
    found = [over(rows, batch).found for batch in (1, 37, 5000)]
    assert np.ptp([one.factor for one in found]) < 2e-3


def test_memory_is_bounded_and_old_motion_is_forgotten():
    (rows,) = ticks_of([Joint(factor=0.8, later=1.0, later_s=40.0)], 110.0)
    axis = over(rows)
    assert abs(axis.found.factor - 1.0) < 0.015
    assert axis.warning == ""
    assert axis.found.seconds < 25.5
    assert len(axis.strokes.table) <= STROKES


def test_the_rig_is_stopped_where_the_whole_interval_is_below_the_compensation_and_only_there():
    weak, less, strong = ticks_of([Joint(factor=k) for k in (0.85, 0.95, 1.2)], 40.0)
    assert "stopped" in over(weak).stopped
    assert over(weak, stop=False).stopped == ""
    assert over(less).stopped == over(strong).stopped == ""
    weak["compensation"] = 0.3  # .3 of the feed-forward is below what is left of the friction
    assert over(weak).stopped == ""


def test_a_model_that_is_in_doubt_where_the_joint_may_stick_hides_no_drift_of_its_sliding():
    (rows,) = ticks_of([Joint(factor=0.91)], 40.0)
    params, model = arrays()
    params["friction_floor_nm"] = 0.0  # so doubtful that nothing is sure
    for doubt_nm, told in ((0.0, False), (0.05, False), (0.012, True)):
        params["friction_sliding_doubt_nm"] = doubt_nm  # 0: not known
        rig = RigWatch(params, model, [DriftTable()])
        rig.follow(rows)
        assert bool(rig.axes[0].warning) == told, doubt_nm
        assert rig.axes[0].stopped == "", "the STOP goes by the floor"


def test_a_rig_is_armed_again_after_a_stop_and_stopped_for_what_it_shows_then():
    (rows,) = ticks_of([Joint(factor=0.85)], 60.0)
    half = len(rows) // 2
    rows["state"][half - 100 : half] = State.IDLE
    rig = watch()
    rig.follow(rows[:half])
    assert rig.axes[0].stopped
    rig.follow(rows[half : half + round(5 * RATE_HZ)])
    assert rig.axes[0].warning
    assert rig.axes[0].stopped == "", "five seconds are too few"
    rig.follow(rows[half + round(5 * RATE_HZ) :])
    assert rig.axes[0].stopped


def test_a_rig_without_model_or_force_sensor_is_not_watched():
    params, model = arrays()
    assert RigWatch(params, np.zeros_like(model), [DriftTable()]).axes == [None]
    params["force_used"] = 0
    assert RigWatch(params, model, [DriftTable()]).axes == [None]
    assert watch(watch=False).axes == [None]


def test_the_curve_for_arrays_is_that_of_the_law():
    by = deployed(*arrays(), 0)
    v = np.concatenate([np.linspace(-2.2, 2.2, 801), by.model["knot_rad_s"][0, 0, :5]])
    record = records(by.model)[0]
    law = [branch_magnitude(record, int(one < 0), abs(one)) for one in v]
    assert np.allclose(by.dry_nm(v) + by.viscous_nms_rad(v) * np.abs(v), law, rtol=0, atol=1e-14)


def test_the_least_factor_is_where_feed_forward_meets_friction():
    by = deployed(*arrays(), 0)
    assert by.least_factor(0.0) == 0.0
    k = by.least_factor()
    v = np.linspace(by.speed_min_rad_s, by.speed_max_rad_s, 4001)
    left = k * by.dry_nm(v) + by.viscous_nms_rad(v) * v - np.minimum(0.95 * by.dry_nm(v), by.cap_nm)
    assert left.min() == pytest.approx(0.0, abs=2e-4)


def test_the_bell_gives_back_a_parabola_and_keeps_15_hz_at_half_the_power():
    kernel, half = bell(200.0), (len(bell(200.0)) - 1) // 2
    t = np.arange(-half, half + 1) / 200.0
    assert np.allclose((0.3 + 2.0 * t) @ kernel, [0.3, 2.0, 0.0], atol=1e-9)
    assert (4.0 * t**2) @ kernel[:, 2] == pytest.approx(8.0)
    gain = np.cos(2 * np.pi * 15.0 * t) @ kernel[:, 0]
    assert gain == pytest.approx(math.sqrt(0.5), abs=0.01)


# -- kept from run to run


def kept(tmp_path, axis, devices="d"):
    state.write(tmp_path, devices, {"joint": state.packed(axis)})
    return state.read(tmp_path, devices)


def test_a_restart_goes_on_where_the_run_ended(tmp_path):
    first, more = ticks_of([Joint(factor=0.88, offset=0.0), Joint(factor=0.88, offset=0.03)], 40.0)
    before, after = over(first), watch().axes[0]
    assert state.restore(after, kept(tmp_path, before)["joint"])
    assert after.found.factor == pytest.approx(before.found.factor, abs=1e-9)
    assert after.warning == before.warning != ""
    assert after.stopped == "", "nothing is stopped for what an earlier run saw"
    rig = watch()
    state.restore(rig.axes[0], kept(tmp_path, before)["joint"])
    rig.follow(more[: round(5 * RATE_HZ)])
    assert rig.axes[0].strokes.session > before.strokes.session
    assert abs(rig.axes[0].found.factor - 0.88) < 0.015, "zeros differ from run to run"


def test_what_is_kept_of_another_model_or_of_other_devices_is_not_used(tmp_path):
    (rows,) = ticks_of([Joint(factor=0.88)], 40.0)
    whole = kept(tmp_path, over(rows))
    assert state.read(tmp_path, "other devices") == {}
    params, model = arrays()
    params["inertia_kgm2"] *= 1.01
    assert not state.restore(RigWatch(params, model, [DriftTable()]).axes[0], whole["joint"])
    params, model = arrays()
    other = model.copy()
    other["coefficient"] *= 1.001
    assert not state.restore(RigWatch(params, other, [DriftTable()]).axes[0], whole["joint"])


def test_a_damaged_file_says_nothing(tmp_path):
    (rows,) = ticks_of([Joint()], 40.0)
    whole = kept(tmp_path, over(rows))["joint"]
    draw = np.random.default_rng(3)
    for _ in range(200):
        table = np.array(whole["strokes"])
        at = tuple(draw.integers(table.shape))
        table[at] = draw.choice([math.nan, math.inf, -1.0, 1e300, 0.5, -table[at] - 1.0])
        axis = watch().axes[0]
        if state.restore(axis, {**whole, "strokes": table.tolist()}):
            assert axis.found is None or np.isfinite(list(vars(axis.found).values())).all()
    for wrong in (
        None,
        [],
        {},
        "x",
        {**whole, "strokes": [[1.0]]},
        {**whole, "strokes": "x"},
        {**whole, "identity": 1},
    ):
        assert not state.restore(watch().axes[0], wrong)
    (tmp_path / state.NAME).write_bytes(b"{")
    assert state.read(tmp_path, "d") == {}
