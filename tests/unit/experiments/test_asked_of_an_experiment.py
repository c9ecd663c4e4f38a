"""What an experiment is asked for: points of its own axis, options of its own, and a hand that moves until it
stops."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli.experiment import command
from rtctl.errors import DataError
from rtctl.experiments import models, virtual
from rtctl.experiments.order import Order
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"


def test_points_of_an_axis_of_the_other_motion_are_refused(tmp_path):
    points = tmp_path / "points.csv"
    rows = [f"{way * v},{way * (4 + v)}" for way in (1, -1) for v in np.linspace(0.01, 0.2, 12)]
    points.write_text("\n".join(["velocity_m_s,friction_torque_n", *rows]) + "\n")
    order = Order(load(CONFIGS / "mock.toml"), points=points)
    for ask in (models.points_of, models.climb):
        with pytest.raises(DataError, match=r"points\.csv: is of a linear axis"):
            ask(order)


@pytest.mark.parametrize("option", ["--case", "--model"])
def test_an_option_of_another_experiment_is_wrong_usage(tmp_path, option):
    given = ["spring", str(CONFIGS / "mock.toml"), "--simulate", "--out", str(tmp_path / "report")]
    told = CliRunner().invoke(command, [*given, option, "nu-SVR, RBF"])
    assert told.exit_code == 2
    assert "belong to point-to-point and tracking, not to spring" in told.output


@pytest.mark.parametrize(("armed_s", "ends_s"), [(1.7, 5.0), (5.0, 7.0), (7.3, 9.0)])
def test_a_hand_stops_where_its_motion_began_and_never_before_the_rig_is_armed(armed_s, ends_s):
    rig = SimpleNamespace(time_s=armed_s, plant_params={"hand_start_s": np.array([[1.0]])})
    assert virtual.stroke_ends_s(rig, virtual.FAST_SINE) == ends_s
