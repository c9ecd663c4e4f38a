"""Rows that are others again, to the last digit, are found, named and counted once."""

import re
from dataclasses import replace

import numpy as np
import pytest
from dirty_changes import rows_of
from dirty_logs import write
from moved_joint import CLEAN, Joint, simulate

from rtctl.errors import DataError
from rtctl.friction.logs.copied_rows import copies_in
from rtctl.friction.logs.log_input import Gearing, options_of
from rtctl.friction.logs.log_points import checked
from rtctl.friction.logs.other_programs import read_mapped

COLUMNS = {"position": {"column": "x"}, "hand_torque": {"column": "hand"}}
LOG = simulate(replace(CLEAN["hand, 100 Hz"], seconds=30.0))
ROWS = np.arange(len(LOG.time))


def joined(*rows):
    at = np.concatenate(rows)
    return replace(rows_of(LOG, at), time=np.arange(len(at)) * LOG.step)


def found(folder, *logs):
    files = [write(log, folder / f"{k}.csv") for k, log in enumerate(logs)]
    return checked([options_of(file, COLUMNS, None) for file in files], Gearing())


def half_width(one, name):
    each = one.fit.symmetric.parameters[name]
    return each.high - each.low


def test_a_log_that_stands_twice_or_has_a_part_pasted_is_as_sure_as_it_is_once(tmp_path):
    once = found(tmp_path, LOG)
    assert not any("others again" in one for one in once.warnings)
    for log, first, last, of in (
        (joined(ROWS, ROWS), 3001, 6000, 1),
        (joined(ROWS, ROWS[500:1500]), 3001, 4000, 501),
        (joined(ROWS[:2000], ROWS[500:1500], ROWS[2000:]), 2001, 3000, 501),
    ):
        twice = found(tmp_path, log)
        told = next(one for one in twice.warnings if "others again" in one)
        assert f"{last - first + 1} rows are others again" in told
        assert f"rows {first} to {last} those from row {of} on" in told
        for name in ("inertia_kgm2", "viscous_nms_rad", "coulomb_nm"):
            assert half_width(twice, name) == pytest.approx(half_width(once, name), rel=0.12)


def test_a_log_of_which_a_part_is_in_another_counts_it_once_and_one_that_is_wholly_in_it_is_refused(tmp_path):
    once = found(tmp_path, LOG)
    # its place begins anew: what a copy shares is how it goes on
    shifted = replace(LOG, position=LOG.position + 0.731)
    with pytest.raises(DataError, match=r"1\.csv: its rows are in .*0\.csv, too"):
        found(tmp_path, LOG, rows_of(shifted, slice(500, 2000)))
    both = found(tmp_path, rows_of(LOG, slice(0, 2000)), rows_of(shifted, slice(500, 3000)))
    assert any("rows 1 to 1500 those from row 501 on of" in one for one in both.warnings)
    assert half_width(both, "inertia_kgm2") == pytest.approx(half_width(once, "inertia_kgm2"), rel=0.3)


def test_laps_of_a_simulation_without_noise_are_told(tmp_path):
    still = Joint(sines=((0.4, 0.5), (0.15, 1.0), (0.06, 2.5)), hand_noise=0.0, motor_noise=0.0)
    log = simulate(replace(still, rate_hz=100.0, counts=1e9, seconds=21.0))
    laps = found(tmp_path, rows_of(log, slice(100, None)))
    told = next(one for one in laps.warnings if "others again" in one)
    assert re.search("laps of a simulation.*every interval is too narrow", told)
    assert laps.fit.symmetric.parameters["inertia_kgm2"].value == pytest.approx(0.012, rel=0.02)


def test_a_joint_at_rest_and_a_torque_that_is_commanded_lap_for_lap_are_no_copies():
    rest = np.round(np.sin(np.minimum(np.arange(2000), 300) / 50), 3)
    command = np.tile(np.random.default_rng(1).normal(size=500), 4)
    moved = np.cumsum(np.random.default_rng(2).normal(size=2000))
    one = np.zeros(2000, int)
    assert not copies_in(rest[:, None], rest, one, 100).again.any()
    assert not copies_in(command[:, None], moved, one, 100).again.any()
    assert copies_in(command[:, None], np.tile(moved[:500], 4), one, 100).again.sum() == 1500


@pytest.mark.parametrize("average", ["speed", "file"])
def test_rows_of_points_that_are_in_two_files_are_counted_once(tmp_path, average):
    rng = np.random.default_rng(3)
    speed = np.abs(rng.normal(1.0, 0.05, 2000)) * np.repeat([1, 1], 1000)
    table = np.column_stack([speed, 0.1 + 0.05 * speed + rng.normal(0, 0.01, 2000)])
    both = table if average == "file" else np.concatenate([table, -table[::-1]])
    tables = {"velocity": {"column": "v"}, "torque": {"column": "t"}}
    text = {"delimiter": None, "decimal": None}

    def read(*parts):
        files = [tmp_path / f"{k}.csv" for k in range(len(parts))]
        for file, part in zip(files, parts, strict=True):
            np.savetxt(file, part, delimiter=",", header="v,t", comments="", fmt="%.9g")
        return read_mapped(files, tables, average, text)

    with pytest.raises(DataError, match=r"1\.csv: its rows are in .*0\.csv, too"):
        read(both, both[300:1700])
    points, notes = read(both[:1500], both[1000:])
    assert any("500 rows are others again" in one for one in notes)
    assert np.nansum(points.count) == pytest.approx(len(both), rel=0.02)


def test_a_file_of_points_that_another_holds_is_refused_and_a_few_equal_points_are_not(tmp_path):
    speed = np.geomspace(0.01, 2.0, 20)
    points = np.column_stack(
        [np.r_[speed, -speed], np.r_[speed, -speed] * 0.05 + np.sign(np.r_[speed, -speed])]
    )
    tables = {"velocity": {"column": "v"}, "torque": {"column": "t"}}

    def read(*parts):
        files = [tmp_path / f"{k}.csv" for k in range(len(parts))]
        for file, part in zip(files, parts, strict=True):
            np.savetxt(file, part, delimiter=",", header="v,t", comments="", fmt="%.9g")
        return read_mapped(files, tables, "none", {"delimiter": None, "decimal": None})[0]

    with pytest.raises(DataError, match=r"0\.csv: its rows are in .*1\.csv, too"):
        read(points[5:30], points)
    with pytest.raises(DataError, match=r"1\.csv: its rows are in .*0\.csv, too"):
        read(points, points[::-1])
    assert len(read(points[:22], points[18:]).direction) == 44
