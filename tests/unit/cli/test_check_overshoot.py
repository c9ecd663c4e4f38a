"""`rtctl check` on a current loop of second order."""

import math

import pytest
from checked_rig import DEFAULTS, RIG, edited, rows_of

from rtctl.check.law_plan import build
from rtctl.check.stability_report import examine
from rtctl.check.verdict import Outcome
from rtctl.errors import ConfigError
from rtctl.rig_file.config import load

LATER_TICKS = (1.3 + 1.5 * 0.25) / (2 * math.pi * 200) / 1e-3
NAME = "current loop that overshoots"


def rig(folder, drive, measured=""):
    path = folder / "rig.toml"
    path.write_text(RIG.format(**(DEFAULTS | {"k_c": 10.0, "d": 0.5})))
    return edited(path, ("[axis.environment]", f"[axis.drive]\n{drive}\n{measured}\n[axis.environment]"))


def figures(*asked):
    return examine(load(rig(*asked))).axes[0]


def test_a_loop_that_overshoots_is_judged_as_later_and_stronger(tmp_path):
    plain = figures(tmp_path, "current_loop_hz = 200.0")
    one = figures(tmp_path, "current_loop_hz = 200.0\ncurrent_loop_overshoot = 0.25")
    assert (plain.delay_ticks, one.delay_ticks) == (0.5, pytest.approx(0.5 + LATER_TICKS))
    late = figures(tmp_path, "current_loop_hz = 200.0", f"[axis.measured]\ndelay_ticks = {0.5 + LATER_TICKS}")
    # as late, and 1.35 times as strong
    assert one.damping_needed_nms_rad == pytest.approx(1.35 * late.damping_needed_nms_rad, rel=0.01)
    assert one.sampled_data_k_max_nm_rad < late.sampled_data_k_max_nm_rad
    (row,) = [row for row in one.verdicts if row.name == NAME]
    assert row.outcome is Outcome.PASS
    assert row.figure == "1.33 ticks, x 1.35"
    assert NAME not in {row.name for row in plain.verdicts}


def test_what_was_measured_has_all_of_its_delay(tmp_path):
    drive, measured = (
        "current_loop_hz = 200.0\ncurrent_loop_overshoot = 0.25",
        "[axis.measured]\ndelay_ticks = {}",
    )
    assert figures(tmp_path, drive, measured.format(3.0)).delay_ticks == 3.0
    assert figures(tmp_path, drive, measured.format(1.0)).delay_ticks == pytest.approx(0.5 + LATER_TICKS)


def test_the_law_waits_as_long_and_its_proof_is_of_the_stronger_coupling(tmp_path):
    drive = "current_loop_hz = 200.0\ncurrent_loop_overshoot = {}"
    small, large = (build(load(rig(tmp_path, drive.format(share)))).params[0] for share in (0.0, 0.25))
    more = float(large["acting_delay_s"][0] - small["acting_delay_s"][0])
    assert more == pytest.approx(LATER_TICKS * 1e-3)
    assert large["proof_delay_s"][0] < small["proof_delay_s"][0]


def test_help_counts_on_the_delay_alone(tmp_path):
    path = rig(tmp_path, "current_loop_hz = 200.0\ncurrent_loop_overshoot = 0.25")
    help_ = ('policy = "hybrid"', 'policy = "observer"\npresliding_rad = 0.001\nobserver.gain = 0.5')
    row = rows_of(edited(path, help_))[NAME]
    assert row.outcome is Outcome.NOT_PROVED
    assert "the delay alone" in row.meaning


@pytest.mark.parametrize(
    "drive", ["current_loop_overshoot = 0.1", "current_loop_hz = 200.0\ncurrent_loop_overshoot = 0.5"]
)
def test_an_overshoot_of_no_loop_and_one_beyond_what_was_compared_are_refused(tmp_path, drive):
    with pytest.raises(ConfigError) as refused:
        load(rig(tmp_path, drive))
    assert "current_loop_overshoot" in str(refused.value.faults)
