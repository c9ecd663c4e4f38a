"""A direct drive whose cogging is about as strong as its friction: with the motor off it rests, or creeps, on
the flanks of its detents.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from identified import SMALL, run
from test_light_joint import GIMBAL

from rtctl.identify.cogging import CELLS, Cogging, cogging_of
from rtctl.identify.place_rows import rows_of
from rtctl.rig_file.config import load
from rtctl.simulation.friction_truth import true_friction_nm

F_C_NM = 0.008


def ways_of(torque_nm, friction_nm, start_rad, way_rad, n=40_000):
    x = start_rad + np.linspace(0.0, way_rad, n)
    return (x, torque_nm(x) + friction_nm[0]), (x[::-1], torque_nm(x[::-1]) - friction_nm[1])


@pytest.mark.parametrize(("waves", "share"), [(1, 0.5), (7, 1.0), (24, 2.0)])
@pytest.mark.parametrize("way_rad", [2 * math.pi, 1.7])
def test_half_the_sum_of_both_ways_is_cogging(waves, share, way_rad):
    def wanted(x):
        return share * np.sin(waves * x + 0.3) + 0.05

    forward, backward = ways_of(wanted, (1.0, 0.8), -2.0, way_rad)
    whole = way_rad > 6
    found = cogging_of(forward, backward, 2 * math.pi, whole)
    x = np.linspace(-1.99, -2.01 + way_rad, 500)
    truth = wanted(x) - wanted(forward[0]).mean()
    assert np.abs(found.at(x) - truth).max() < 0.03 * share
    assert found.slope_nm_rad == pytest.approx(share * waves, rel=0.05)
    if whole:
        assert np.abs(found.at(x + 6 * math.pi) - truth).max() < 0.03 * share


def test_a_small_wave_and_a_difference_of_directions_are_no_cogging():
    small = ways_of(lambda x: 0.1 * np.sin(7 * x), (1.0, 0.5), 0.0, 2 * math.pi)
    assert not cogging_of(*small, 2 * math.pi, whole=True).matters
    apart = (
        ways_of(lambda x: np.sin(7 * x), (1.0, 1.0), 0.0, 3.0)[0],
        ways_of(np.sin, (1.0, 1.0), 4.0, 1.0)[1],
    )
    assert not cogging_of(*apart, 2 * math.pi, whole=False).matters
    assert Cogging.none().slope_nm_rad == 0.0
    assert CELLS >= 20 * 24


def cogging_rig(folder, share, waves):
    wave = f"[device.options.axis.waves]\nripple = [[{share * F_C_NM}, {waves}, 0.3]]\n"
    text = GIMBAL.replace("encoder_counts_per_rev = 16384", "encoder_counts_per_rev = 65536")
    (path := folder / "rig.toml").write_text(
        text.replace("[[device.options.hand]]", f"{wave}[[device.options.hand]]")
    )
    return path


@pytest.mark.parametrize(("share", "waves"), [(1.0, 7), (2.0, 3)])
def test_a_joint_that_cogs_as_much_as_it_rubs_is_identified(tmp_path, share, waves):
    path = cogging_rig(tmp_path, share, waves)
    settings = replace(SMALL, train_levels=3, test_levels=0, speed_min_rad_s=0.05, spots=6)
    kept = run(path, settings)
    assert not kept.skipped
    moving = [point for point in kept.points if point.target_rad_s]
    away = [abs(point.friction_torque_nm) for point in kept.points if not point.target_rad_s]
    true_nm = true_friction_nm(load(path), 0, np.array([point.velocity_rad_s for point in moving]))
    errors = np.abs([point.friction_torque_nm for point in moving]) - true_nm
    assert np.abs(errors).max() < 0.02 * F_C_NM
    assert away == pytest.approx([0.01, 0.01], rel=0.1), "without the hill that was climbed"
    ways = [
        rows_of(1, one)
        for point, one in zip(kept.points, kept.measurements, strict=True)
        if point.target_rad_s > 0
    ]
    cogging_nm = [row[1] for rows in ways for row in rows]
    assert np.ptp(cogging_nm) > 0.7 * F_C_NM * share, "rtctl fit --places --sweep takes it off itself"
    assert all(point.presliding_rad is None for point in kept.points), "bristles are bent already on a flank"


def test_over_a_part_of_a_turn_both_directions_together_are_right(tmp_path):
    """The mean of cogging over less than its period is no 0: it stays, with another sign in either
    direction.
    """
    path = cogging_rig(tmp_path, 1.0, 7)
    limit = "velocity_limit_rad_s = 30.0"
    path.write_text(
        path.read_text().replace(limit, f"{limit}\nposition_min_rad = -1.1\nposition_max_rad = 1.2")
    )
    kept = run(
        path,
        replace(SMALL, train_levels=3, test_levels=0, speed_min_rad_s=0.05, speed_max_rad_s=1.0, spots=6),
    )
    assert not kept.skipped
    moving = [point for point in kept.points if point.target_rad_s]
    true_nm = true_friction_nm(load(path), 0, np.array([point.velocity_rad_s for point in moving]))
    errors = np.abs([point.friction_torque_nm for point in moving]) - true_nm
    assert np.abs(errors).max() < 0.1 * F_C_NM
    assert np.abs(errors.reshape(-1, 2).mean(axis=1)).max() < 0.02 * F_C_NM
