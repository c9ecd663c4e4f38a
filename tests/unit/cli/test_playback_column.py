"""How `rtctl playback` is told a column."""

import pytest
from click.testing import CliRunner

from rtctl.cli.playback import _column, _warnings, command


@pytest.mark.parametrize("text", ["x:1:2:3", ":1", ":ms", "x:", "x:1,5", "x:mm:1,5", "x:0x1F"])
def test_a_column_that_cannot_be_read_is_wrong_usage(text):
    said = CliRunner().invoke(command, ["--position", text])
    assert (said.exit_code, "--position" in said.output) == (2, True)


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("angle", {"column": "angle"}),
        ("gauge_nm:-1:0.5", {"column": "gauge_nm", "scale": -1.0, "offset": 0.5}),
        ("Zeit [ms]:ms", {"column": "Zeit [ms]", "unit": "ms"}),
        ("Winkel:deg:-1", {"column": "Winkel", "unit": "deg", "scale": -1.0}),
        ("Axis 1::Torque", {"column": "Axis 1::Torque"}),
    ],
)
def test_a_column_says_its_unit_as_the_refusals_ask_for(text, column):
    assert _column(None, None, text) == column


def test_an_option_that_only_identify_has_is_told_as_its_own():
    told = _warnings(["the torque looks early (--torque-delay); lower --cutoff-hz", "--torque-delay"])
    assert [line.count("(--torque-delay: of `rtctl identify --log`") for line in told] == [0, 0, 1]
    assert len(_warnings(["lower --cutoff-hz"])) == 1
