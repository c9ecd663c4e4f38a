"""What the watch over the friction forgets, and the load that it takes off: joints that hardly slide, gears
that are loaded.
"""

import math

import numpy as np
from test_drift import RATE_HZ, arrays, watch

from rtctl.friction.drift_deployed import deployed
from rtctl.friction.drift_sliding import Rows
from rtctl.friction.drift_strokes import COLUMNS, KEPT_STROKES, Strokes, unpacked
from rtctl.friction.drift_watch import RigWatch
from rtctl.friction.load import Load
from rtctl.rig_file.friction_tables import DriftTable
from tests.drifting_joint import Joint, ticks_of

RARE = ((0.009, 1.3),)
"""Strokes that are mostly presliding."""


def test_sliding_that_is_rare_in_the_motion_is_forgotten_with_the_motion():
    by, strokes = deployed(*arrays(), 0), {}
    for moved in (5, 60, 500):
        kept = strokes[moved] = Strokes(200)
        for k in range(120):
            v = np.full(5, 0.3 if k % 2 else -0.3)
            kept.add(Rows(0 * v, v, 0 * v, np.sign(v) * by.dry_nm(v), 0 * v, np.full(5, k)), by, moved)
    assert strokes[5].rows == 200
    assert strokes[60].rows < 200  # two windows of motion: 400 rows of it, and never fewer than these
    assert len(strokes[60].table) == len(strokes[500].table) == 2 * KEPT_STROKES
    again = Strokes(200)
    again.take_up(strokes[5].table)
    v = np.full(5, 0.3)
    for k in range(3):
        again.add(Rows(0 * v, v, 0 * v, np.sign(v) * by.dry_nm(v), 0 * v, np.full(5, k)), by, 300)
    assert len(again.table) == 2 * KEPT_STROKES


def test_strokes_of_the_direction_that_slides_seldom_are_kept_too():
    by, seldom = deployed(*arrays(), 0), Strokes(200)
    for k in range(80):
        v = np.full(5, 0.3 if k % 4 else -0.3)
        seldom.add(Rows(0 * v, v, 0 * v, np.sign(v) * by.dry_nm(v), 0 * v, np.full(5, k)), by, 500)
    forward = unpacked(seldom.table)[0][:, 0, 1] > 0.0
    assert forward.sum() == (~forward).sum() == KEPT_STROKES


def test_a_joint_that_hardly_slides_is_told_of_a_tenth_within_a_minute_of_motion():
    (rows,) = ticks_of([Joint(sines=RARE, later=1.1, later_s=150.0)], 240.0)
    rig, moved_s, told_s = watch(), 0.0, math.inf
    for k in range(0, len(rows), 400):
        rig.follow(rows[k : k + 400])
        if k >= 150.0 * RATE_HZ:
            moved_s += float((np.abs(rows["velocity_rad_s"][k : k + 400]) > 0.03).mean())
            told_s = min(told_s, moved_s) if rig.axes[0].warning else told_s
        else:
            assert rig.axes[0].warning == ""
        if moved_s >= 60.0:
            break
    axis = rig.axes[0]
    assert axis.strokes.rows < 20 * axis.rate_hz  # of 60 s of motion
    assert told_s < 50.0
    assert abs(axis.found.factor - 1.1) < 0.02


def test_a_joint_that_moves_without_sliding_is_not_told_by_what_it_was_before():
    """Nothing is seen of its friction any more: a factor of minutes ago, with its interval, passed for the
    present one.
    """
    sliding, short = ticks_of([Joint(factor=1.12), Joint(sines=((0.006, 1.3),), factor=0.7)], 120.0)
    short["tick"] += len(sliding)
    rig = watch()
    (axis,) = rig.axes
    rig.follow(sliding)
    assert abs(axis.found.factor - 1.12) < 0.02
    for k in range(0, len(short), 400):
        rig.follow(short[k : k + 400])
    assert axis.found is None
    assert axis.warning, "nothing says that it is gone"
    assert axis.strokes.rows == 0


def test_a_joint_that_is_turned_one_way_only_is_not_told_by_what_it_was_before():
    """Friction and an offset of the sensor are the same thing there, and the strokes back are forgotten after
    a window of sliding.
    """
    to_and_fro, on = ticks_of([Joint(factor=1.12), Joint(sines=((60.0, 0.0008),), factor=0.7)], 50.0)
    on["tick"] += len(to_and_fro)
    rig = watch()
    (axis,) = rig.axes
    rig.follow(to_and_fro)
    assert abs(axis.found.factor - 1.12) < 0.02
    assert axis.warning
    rig.follow(on)
    assert axis.found is None
    assert axis.warning, "nothing says that it is gone"


def loaded(rows, load):
    """The rows as they are in a gear whose friction grows by what the model says; the hand takes it, against
    a motor of .4 N m.
    """
    motor, hand, v = rows["motor_torque_nm"], rows["hand_torque_nm"], rows["velocity_rad_s"]
    motor += 0.4
    hand -= 0.4
    outside = hand.copy()
    for _ in range(40):
        outside = hand + np.sign(v) * load.added_nm(np.abs(v), outside, motor)
    hand[:] = outside
    return rows


def test_a_load_that_the_model_knows_is_no_drift():
    (rows,) = ticks_of([Joint(factor=1.0)], 40.0)
    params, model = arrays()
    model = model.copy()
    load = Load(0.05, 0.2, 0.05, 0.1, 0.0, 0.0, 0.3, 1.3, 2.5, 0.0)
    load.fill(model[0])
    rows = loaded(rows, load)
    known, unknown = RigWatch(params, model, [DriftTable()]), watch()
    for rig in (known, unknown):
        rig.follow(rows)
        rig.look()
    assert abs(known.axes[0].found.factor - 1.0) < 0.02
    assert known.axes[0].warning == ""
    assert unknown.axes[0].found.factor > 1.2


def test_a_row_whose_bristles_are_late_behind_the_curve_is_left_out():
    params, model = arrays()
    by = deployed(params, model, 0)
    u = np.array([0.05, 0.05, 0.05, 0.5, 0.5])
    # to .05 rad/s out of rest and out of .5 rad/s within a presliding length; at even speed; fast, as a hand
    # turns
    a = np.array([0.05**2, 0.05**2 - 0.5**2, 0.0, 0.0, 0.0]) / (2 * by.presliding_rad)
    a[3:] = 3.0, -3.0
    for way in (1.0, -1.0):
        strokes, still = Strokes(200), np.zeros(20)
        v, a_way = np.repeat(way * u, 4), np.repeat(way * a, 4)
        strokes.add(Rows(np.arange(20.0), v, a_way, still, still, np.repeat(np.arange(5), 4)), by)
        strokes.begin_session()
        inertia_nm = strokes.table[:, 3:].reshape(3, -1)[:, 2 * COLUMNS + COLUMNS - 1] / 4
        np.testing.assert_allclose(inertia_nm, by.inertia_kgm2 * way * a[2:])
