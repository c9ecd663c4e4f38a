"""An experiment that compares with compensation and without needs a rig file that compensates something."""

import pytest
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.cli.experiment import _require_help
from rtctl.errors import ConfigError, DataError
from rtctl.experiments import registry
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config

SHIPPED = shipped_config("serial.toml")
"""A real rig, of no friction model."""


def test_nobody_is_asked_to_stand_at_a_rig_that_compensates_nothing(tmp_path):
    asked = CliRunner().invoke(cli, ["experiment", "free-motion", str(SHIPPED), "--out", str(tmp_path / "e")])
    assert isinstance(asked.exception, ConfigError)
    assert "axis joint compensates no friction" in str(asked.exception)
    assert "emergency stop" not in asked.output


@pytest.mark.parametrize(
    ("changed", "helps"), [({}, True), ({"policy": "off"}, False), ({"model": ""}, False),
        ({"model": "", "policy": "observer"}, True)],
)  # fmt: skip
def test_help_is_a_model_or_an_observer_that_is_not_off(changed, helps):
    loaded = load(shipped_config("mock.toml"))
    axis = loaded.config.axis[0]
    friction = axis.friction.model_copy(update=changed)
    config = loaded.config.model_copy(update={"axis": (axis.model_copy(update={"friction": friction}),)})
    loaded = type(loaded)(**{**vars(loaded), "config": config})
    if helps:
        _require_help(loaded)
        return
    with pytest.raises(ConfigError, match="nothing to compare"):
        _require_help(loaded)


def test_what_an_experiment_says_on_a_carriage_is_in_its_units(tmp_path, monkeypatch):
    class Spoilt:
        hands_off = True

        @staticmethod
        def run(order):
            order.announce("nu-SVR is left out: below 0 at 0.5 rad/s")
            raise DataError("not a curve at 0.05 rad/s: -2 N m")

    monkeypatch.setitem(registry.EXPERIMENTS, "tracking", Spoilt)
    slide = str(shipped_config("mock-linear.toml"))
    words = ["experiment", "tracking", slide, "--simulate", "--out", str(tmp_path / "e")]
    asked = CliRunner().invoke(cli, words)
    assert str(asked.exception) == "not a curve at 50 mm/s: -2 N"
    assert "below 0 at 0.5 m/s" in asked.output
