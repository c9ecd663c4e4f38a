"""The watch over the friction where the model and the encoder know the place: a hand that works at one place, a gear's ripple."""

import math
from pathlib import Path

import numpy as np
import pytest
from test_drift import arrays, watch

from rtctl.control.jit import records
from rtctl.control.place_friction import conservative_torque, place_magnitude
from rtctl.control.vocabulary import PlaceUse
from rtctl.friction import artefact
from rtctl.friction.drift_deployed import deployed
from rtctl.friction.drift_place import of_conservative, of_place
from rtctl.friction.drift_watch import RigWatch
from rtctl.friction.guarantee import guarantee
from rtctl.rig_file.config import load
from rtctl.rig_file.friction_tables import DriftTable
from tests.drifting_joint import Joint, ticks_of

SHIPPED = Path("configs/friction/mock-places.json")
SHIFT_RAD = -0.7


@pytest.fixture(scope="module")
def placed():
    """The law's arrays with waves of .2 of the friction over the turn and a ripple of .03 N m, whose 0 is `SHIFT_RAD` off the encoder's."""
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
    params["place_kind"], params["place_shift_rad"] = PlaceUse.GIVEN, SHIFT_RAD
    return params, model


def test_arrays_say_what_the_law_says(placed):
    (row,) = placed[1]
    v, x = np.linspace(0, 2.5, 40), np.linspace(-9, 9, 40)
    record = records(placed[1])
    for way in (0, 1):
        law = [place_magnitude(record[0], way, *pair) for pair in zip(v, x, strict=True)]
        np.testing.assert_allclose(of_place(row, way, v, x), law, atol=1e-12)
    np.testing.assert_allclose(
        of_conservative(row, x), [conservative_torque(record[0], one) for one in x], atol=1e-12
    )
    plain = arrays()[1][0]
    assert not of_place(plain, 0, v, x).any()
    assert not of_conservative(plain, x).any()


def at_their_place(rows, placed, factor):
    """The rows as a joint gives them whose dry friction at every place is `factor` of the model's by place, with its ripple."""
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
    axis = seen(at_their_place(rows, placed, factor), *placed)
    assert abs(axis.found.factor - factor) < 0.012
    assert (
        abs(axis.found.offset_nm - joint.offset) < 0.01
    )  # what the place pushes with is no offset of the sensor
    assert bool(axis.warning) == (factor != 1.0)
    params = placed[0].copy()
    params["place_kind"] = PlaceUse.SEEN  # whose index the host does not know: by speed alone, as before
    by_speed = seen(rows, params, placed[1])
    assert abs(by_speed.found.factor - factor) > 0.05


def test_what_was_kept_by_another_place_is_of_another_joint(placed):
    here = deployed(*placed, 0).identity
    for name, value in (("place_kind", PlaceUse.SEEN), ("place_shift_rad", 0.0)):
        params = placed[0].copy()
        params[name] = value
        assert deployed(params, placed[1], 0).identity != here
    assert watch().axes[0].by.place_shift_rad is None


def test_the_doubt_of_a_watch_by_place_is_not_that_of_its_places():
    axis = load("configs/mock-places.toml").config.axis[0]
    model = artefact.load(SHIPPED)
    places_nm = float(model.place_spread_nm.max())
    by_place = guarantee(axis, model)
    by_speed = guarantee(
        axis.model_copy(update={"friction": axis.friction.model_copy(update={"place": "seen"})}), model
    )
    assert by_speed.sliding_doubt_nm >= places_nm > 0.05
    assert by_place.sliding_doubt_nm == pytest.approx(
        axis.friction.drift_nm + float(model.error_max_nm.max())
    )
    assert by_place.doubt_nm == by_speed.doubt_nm  # what proofs rest on is as it was
    assert by_place.floor_nm == by_speed.floor_nm
