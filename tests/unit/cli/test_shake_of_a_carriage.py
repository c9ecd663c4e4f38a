"""The speed up to which the shaking of a carriage counts as none, in the rows of `rtctl check`."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from hw.interface import Joint
from rtctl.check import stability_report, verdicts_of_admittance
from rtctl.check.verdict import Outcome, Subject
from rtctl.rig_file.config import load

SLIDE = Path(__file__).parents[3] / "configs" / "mock-linear.toml"


@pytest.mark.parametrize(("counts", "outcome"), [(20000, "PASS"), (2000, "NOT_PROVED"), (200, "FAIL")])
def test_a_carriage_may_shake_no_faster_than_a_joint_does_at_its_handle(tmp_path, counts, outcome):
    """.2 mm/s counts as none and 2 mm/s is felt: .002 and .02 rad/s at 10 cm."""
    path = tmp_path / "rig.toml"
    path.write_text(
        SLIDE.read_text().replace("encoder_counts_per_rev = 20000", f"encoder_counts_per_rev = {counts}")
    )
    axis = stability_report.examine(load(path)).axes[0]
    row = next(row for row in axis.verdicts if row.name == "steps of the encoder")
    assert (row.bound, row.outcome.name) == ("<= 0.2 mm/s", outcome)


def test_a_carriage_that_sticks_may_shake_no_faster_either(monkeypatch):
    loaded = load(SLIDE)
    figures, axis = stability_report.figures_alone(loaded, 0), loaded.config.axis[0]
    shaken = SimpleNamespace(
        stuck_radius=1.01, stuck_speed_rad_s=0.001, stuck_worst="hand", rest_damping_min_nms_rad=2.0
    )
    monkeypatch.setattr(verdicts_of_admittance, "found", lambda s: shaken)
    monkeypatch.setattr(verdicts_of_admittance, "_together", lambda s: "")
    subject = Subject(figures, axis, loaded.config.period_s, "here", Joint())
    (row,) = verdicts_of_admittance.stuck_joint(subject)
    assert row.bound == "<= 0.0002 rad/s"
    assert row.outcome in (Outcome.FAIL, Outcome.NOT_PROVED)
