"""The watch over the friction where the model and the encoder know the place: a hand that works at one place,
a gear's ripple.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_drift import arrays, watch

from rtctl.control.jit import records
from rtctl.control.place_friction import conservative_torque, curve_and_place
from rtctl.control.vocabulary import PlaceUse
from rtctl.friction import artefact
from rtctl.friction.drift_deployed import deployed
from rtctl.friction.drift_place import of_conservative, of_place
from rtctl.friction.drift_recorded import over_ticks, told
from rtctl.friction.drift_watch import RigWatch
from rtctl.friction.guarantee import guarantee
from rtctl.rig_file.config import load
from rtctl.rig_file.friction_tables import DriftTable
from tests.drifting_joint import Joint, ticks_of

SHIPPED = Path("configs/friction/mock-places.json")
SHIFT_RAD = -0.7


@pytest.fixture(scope="module")
def placed():
    """The law's arrays with waves of .2 of the friction over the turn and a ripple of .03 N m, whose 0 is
    `SHIFT_RAD` off the encoder's.
    """
    params, model = arrays()
    params, model = params.copy(), model.copy()
    row = model[0]
    row["place_turns_per_rad"], row["place_orders"] = 1 / (2 * math.pi), 1
    row["place_coefficient"][:, :, :2] = (
        0.2 * row["coefficient"][:, : row["place_coefficient"].shape[1], None]
    )
    per_rad = 0.3
    row["conservative_per_rad"] = per_rad
    cells = len(row["conservative"])
    edge = 0.03 * np.sin(2 * np.pi * np.arange(cells + 1) / cells)
    row["conservative"][:, 0], row["conservative"][:, 1] = edge[:-1], np.diff(edge)
    params["place_kind"], params["place_shift_rad"] = PlaceUse.SEEN, SHIFT_RAD
    params["conservative_judged"] = 1
    return params, model


def test_arrays_say_what_the_law_says(placed):
    (row,) = placed[1]
    v, x = np.linspace(0, 2.5, 40), np.linspace(-9, 9, 40)
    record = records(placed[1])
    for way in (0, 1):
        law = [curve_and_place(record[0], way, *pair)[1] for pair in zip(v, x, strict=True)]
        np.testing.assert_allclose(of_place(row, way, v, x), law, atol=1e-12)
    np.testing.assert_allclose(
        of_conservative(row, x), [conservative_torque(record[0], one) for one in x], atol=1e-12
    )
    plain = arrays()[1][0]
    assert not of_place(plain, 0, v, x).any()
    assert not of_conservative(plain, x).any()


def at_their_place(rows, placed, factor):
    """The rows as a joint gives them whose dry friction at every place is `factor` of the model's by place,
    with its ripple.
    """
    by, v, x = deployed(*placed, 0), rows["velocity_rad_s"][:, 0], rows["position_rad"][:, 0]
    there = x - SHIFT_RAD
    more = 0.2 * (np.cos(there) + np.sin(there)) * (by.dry_nm(v) + by.viscous_nms_rad(v) * np.abs(v))
    rows["hand_torque_nm"][:, 0] += np.sign(v) * factor * more - 0.03 * np.sin(0.6 * np.pi * there)
    return rows


def seen(rows, params, model):
    rig = RigWatch(params, model, [DriftTable()])
    rig.follow(rows)
    rig.look()
    return rig.axes[0]


@pytest.mark.parametrize("factor", [0.9, 1.0, 1.1])
def test_a_hand_at_one_place_is_told_the_factor_of_the_model_by_place(placed, factor):
    joint = Joint(factor=factor, sines=((0.25, 0.5), (0.03, 1.3)))
    (rows,) = ticks_of([joint], 40.0)
    rows["place_trust"] = 1.0
    axis = seen(at_their_place(rows, placed, factor), *placed)
    assert abs(axis.found.factor - factor) < 0.012
    # what the place pushes with is no offset of the sensor
    assert abs(axis.found.offset_nm - joint.offset) < 0.01
    assert bool(axis.warning) == (factor != 1.0)
    assert axis.found.place_trust == told(axis)["place_trust"] == 1.0
    rows["place_trust"] = 0.0  # a place that the law does not trust: by speed alone
    by_speed = seen(rows, *placed).found
    assert abs(by_speed.factor - factor) > 0.05
    assert by_speed.place_trust == 0.0


def test_a_place_is_gone_by_as_far_as_it_is_trusted_and_what_is_left_is_in_the_doubt(placed):
    (rows,) = ticks_of([Joint(sines=((0.25, 0.5), (0.03, 1.3)))], 90.0)
    rows = at_their_place(rows, placed, 1.0)
    # learned while it is watched
    rows["place_trust"][:, 0] = np.clip(np.arange(len(rows)) / len(rows) * 3 - 1, 0, 1)
    params = placed[0].copy()
    params["friction_sliding_doubt_nm"], params["friction_place_doubt_nm"] = 0.06, 0.006
    rig, found = RigWatch(params, placed[1], [DriftTable()]), []
    (axis,) = rig.axes
    for k in range(0, len(rows), 800):
        rig.follow(rows[k : k + 800])
        if axis.found is not None:
            found.append((axis.found.place_trust, axis.found.factor))
            doubt_nm = axis.by.doubt_of_sliding_nm(axis.found.place_trust)
            assert doubt_nm == pytest.approx(0.06 - 0.054 * axis.found.place_trust)
    trust, factor = np.array(found).T
    assert (np.diff(trust) > -1e-9).all()
    assert trust[0] == 0.0
    assert trust[-1] > 0.99
    assert abs(factor[-1] - 1.0) < 0.012 < abs(factor[0] - 1.0)
    assert (np.abs(factor - 1.0) < (1.02 - trust) * abs(factor[0] - 1.0) + 0.02).all()


def test_a_recording_of_before_the_trust_was_told_goes_by_what_was_given(placed):
    (rows,) = ticks_of([Joint(sines=((0.25, 0.5), (0.03, 1.3)))], 40.0)
    rows = at_their_place(rows, placed, 1.0)
    for use, trust in ((PlaceUse.GIVEN, 1.0), (PlaceUse.SEEN, 0.0)):
        params = placed[0].copy()
        params["place_kind"] = use
        (found,) = over_ticks(params, placed[1], ["joint"], [rows.copy()], DriftTable(), ["place_trust"])
        assert found["place_trust"] == trust
    (found,) = over_ticks(params, placed[1], ["joint"], [rows], DriftTable())
    assert found["place_trust"] == 0.0


def test_what_was_kept_by_another_place_is_of_another_joint(placed):
    here = deployed(*placed, 0).identity
    for name, value in (("place_kind", PlaceUse.OFF), ("place_shift_rad", 0.0)):
        params = placed[0].copy()
        params[name] = value
        assert deployed(params, placed[1], 0).identity != here
    assert watch().axes[0].by.place_shift_rad is None


def test_the_doubt_of_a_watch_by_place_is_not_that_of_its_places():
    axis = load("configs/mock-places.toml").config.axis[0]
    model = artefact.load(SHIPPED)
    places_nm = float(model.place_spread_nm.max())
    sure = guarantee(axis, model)
    assert sure.sliding_doubt_nm >= places_nm > 0.05
    assert sure.place_doubt_nm == pytest.approx(axis.friction.drift_nm + float(model.error_max_nm.max()))
    assert sure.doubt_nm >= places_nm  # what proofs rest on has the places in it
    plain = guarantee(axis, replace(model, place=None))
    assert plain.place_doubt_nm == plain.sliding_doubt_nm
