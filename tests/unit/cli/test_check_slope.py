"""Rows that an outsider missed: a torque that may not be steep follows a stiff coupling only as fast as that;
energies in mJ.
"""

import numpy as np
import pytest
from checked_rig import DEFAULTS, RIG

from rtctl.check import stability_report
from rtctl.check.verdict import Outcome
from rtctl.check.verdicts_of_motion import late_spring
from rtctl.rig_file.config import load

NAME = "slope of the torque against the coupling"


def row_of(tmp_path, slope, **changes):
    """The row of the rig with this slope, N m/s, and the refusal of the file."""
    text = RIG.format(**{**DEFAULTS, "limit": 6.0, **changes})
    text = text.replace("torque_rate_nm_s = 200.0", f"torque_rate_nm_s = {slope}")
    (tmp_path / "rig.toml").write_text(text)
    report = stability_report.examine(load(tmp_path / "rig.toml"), telling=False)
    (found,) = [row for row in report.verdicts if row.name == NAME]
    return found, report.refusal()


@pytest.mark.parametrize(
    ("slope", "changes", "outcome"),
    [
        (360.0, {}, Outcome.PASS),
        (359.0, {"k_c": 80.0}, Outcome.NOT_PROVED),
        (200.0, {}, Outcome.NOT_PROVED),
        (20.0, {}, Outcome.FAIL),
        # spare damping pays for it
        (200.0, {"k_c": 36.0}, Outcome.PASS),
    ],
)
def test_a_slope_that_follows_up_to_the_velocity_limit_passes_and_a_quarter_of_it_is_asked(
    tmp_path, slope, changes, outcome
):
    found, refusal = row_of(tmp_path, slope, **changes)
    assert found.outcome == outcome
    assert (NAME in refusal or "torque_rate_nm_s" in refusal) == (outcome == Outcome.FAIL)


def test_what_a_refusal_names_is_not_refused(tmp_path):
    _, refusal = row_of(tmp_path, 20.0)
    assert "torque_rate_nm_s = 360 follows up to the limit, 90 is not refused" in refusal
    assert row_of(tmp_path, 90.0)[0].outcome == Outcome.NOT_PROVED


def fed(reach, ratio, steps=500):
    """Negative damping, in k_c M/R, of a spring of `reach` torque limits behind the slope that motion `ratio`
    times as fast as R/k_c meets: k_c = M = 1, w = 1.
    """
    slope, phase, torque = reach / ratio, 2 * np.pi / steps, np.zeros_like(reach)
    for _ in range(3):
        given = np.zeros_like(reach)
        for i in range(steps):
            wanted = -np.clip(reach * np.sin(i * phase), -1, 1)
            torque = torque + np.clip(wanted - torque, -slope * phase, slope * phase)
            given += torque * reach * np.cos(i * phase) * phase
    return given / (np.pi * reach**2) * slope


def test_the_bound_of_a_late_spring_is_above_every_swing_and_not_by_much():
    ratio = np.array([1.02, 1.1, 1.3, 1.6, 2.1, 3.0])
    reach = np.geomspace(0.3, 30, 60)
    most = fed(*np.meshgrid(reach, ratio)).max(axis=1)
    bound = np.array([late_spring(1.0, 1.0, 1.0, one) for one in ratio])
    assert np.all(most <= bound)
    assert np.all(most[2:] >= 0.8 * bound[2:])
    assert late_spring(60.0, 2.0, 200.0, 3.3) == 0.0


@pytest.mark.parametrize(
    ("told", "outcome"),
    [
        ("budget_j = 0.02", Outcome.PASS),
        ("budget_j = 20", Outcome.WARN),
        ("bank_j = 20", Outcome.WARN),
        ("renderer_store_j = 5", Outcome.WARN),
    ],
)
def test_energies_in_mj_are_told(tmp_path, told, outcome):
    (tmp_path / "rig.toml").write_text(f"{RIG.format(**DEFAULTS)}[passivity]\n{told}\n")
    rows = stability_report.examine(load(tmp_path / "rig.toml"), telling=False).verdicts
    assert [row.outcome for row in rows if row.name.startswith("energy that a hand may be given")] == [
        outcome
    ]
