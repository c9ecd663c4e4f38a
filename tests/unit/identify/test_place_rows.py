"""What identify keeps place by place, the slow turn each way, and what fit makes of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from identified import SMALL, Kept, run, variant

from rtctl.cli import fit_places
from rtctl.errors import DataError
from rtctl.friction import artefact
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.point_reader import read_points
from rtctl.identify.measurement_order import tasks
from rtctl.identify.place_rows import places_csv, rows_of
from rtctl.identify.tick_readings import Measurement

TURN = 2 * math.pi


def measurement(first, torque, v=0.5, x=1.0):
    return Measurement(torque, v, 0.0, 0.0, (0.0, 0.0, 0.0), 25.0, x, 1e-3 * (first + 50), first, 100)


def test_measurements_without_a_gap_are_of_one_place():
    rows = rows_of(1, [measurement(0, 0.3), measurement(100, 0.32, x=1.05), measurement(900, 0.4, x=2.0)])
    assert [row[3] for row in rows] == [2, 1]
    assert rows[0][1] == pytest.approx(0.31)
    assert rows[0][4:] == pytest.approx((1.025, 0.5 * 0.2))
    assert rows_of(-1, [measurement(0, 0.3)]) == []  # pulled along: no friction
    assert len(rows_of(1, [measurement(0, 0.3, v=0.0), measurement(100, 0.3, v=0.0)])) == 2  # break-aways


class Swept(Kept):
    def lacks_sweep(self):
        return True

    def swept(self, rows):
        self.rows = rows


def test_a_slow_turn_each_way_shows_the_ripple_of_the_gear(tmp_path):
    settings = replace(SMALL, sweep_rad_s=0.4)
    store = Swept(task.name for task in tasks(settings))  # all else is measured already
    run(variant(tmp_path), settings, store)
    table = np.array(store.rows)
    for way in (1, -1):
        there = table[table[:, 2] == way]
        assert np.ptp(there[:, 4]) > 0.9 * TURN
        assert (there[:, 1] * way > 0.1).all()


def write(path, rows):
    path.write_text(places_csv(rows, "mock", "0" * 64))
    return path


def sweep_rows(shift=0.0):
    x = np.linspace(0, TURN, 400)
    noise = np.random.default_rng(1).normal(0, 1e-3, (2, 400))
    ripple = 0.02 * np.sin(TURN / 0.5 * (x - shift))
    return [
        (way * 0.1, way * 0.3 - pushed + one, way, 1, place, 0.0)
        for way, off in ((1, noise[0]), (-1, noise[1]))
        for place, pushed, one in zip(x, ripple, off, strict=True)
    ]


def test_fit_learns_places_and_sweep_and_tells_where_an_index_has_moved(tmp_path, capsys):
    rng = np.random.default_rng(2)
    rows = [
        (way * v, way * (0.3 + 0.05 * v) * (1 + 0.2 * math.cos(x)), way, 5, x, 0.0)
        for way in (1, -1)
        for v in np.geomspace(0.01, 2, 9)
        for x in rng.uniform(0, TURN, 12)
    ]
    places, sweep = write(tmp_path / "places.csv", rows), write(tmp_path / "sweep.csv", sweep_rows())
    model = fit_points(read_points(places), rig="mock", c=10.0, epsilon_nm=0.03)
    found, told, body = fit_places.learn(model, fit_places.read(places, sweep, "rotary", TURN), 0.5)
    assert found.conservative.orders.tolist() == [1]
    assert body["places"]["orders"] >= 1
    assert any("by speed alone" in line for line in told)
    artefact.save(found, tmp_path / "m.json")
    fit_places.tell_shift(tmp_path / "m.json", write(tmp_path / "moved.csv", sweep_rows(0.12)), err=False)
    assert "friction.place_shift_rad = 0.12" in capsys.readouterr().out
    one_way = write(tmp_path / "one.csv", sweep_rows()[:400])
    with pytest.raises(DataError, match="one direction only"):
        fit_places.read(None, one_way, "rotary", TURN)
    artefact.save(model, tmp_path / "plain.json")
    with pytest.raises(DataError, match="no conservative part"):
        fit_places.tell_shift(tmp_path / "plain.json", sweep, err=False)
