"""Columns as they are said: units that no column is read in, maps in a file that are none."""

import click
import pytest

from rtctl.cli.columns import tables
from rtctl.errors import ConfigError

ROLES = ("position", "torque", "velocity")


@pytest.mark.parametrize(
    ("column", "said"),
    [
        ("position=x:in", "in needs a scale: give 25.4 mm .:mm:25.4 behind"),
        ("position=x:inch", "give 25.4 mm"),
        ("position=x:cm", "give 10 mm"),
        ("velocity=v:um/s", "give 0.001 mm/s"),
        ("torque=F:lbf", "give 4.448222 N .:N:4.448222"),
        ("torque=F:daN", "give 10 N"),
        ("torque=F:%", "% needs a scale: give the unit that the column is read in"),
        ("torque=F:%:2.5", "% needs a scale"),
        ("torque=p:bar", "bar needs a scale"),
    ],
)
def test_a_unit_that_needs_a_scale_is_told_it(column, said):
    with pytest.raises(click.BadParameter, match=said):
        tables((column,), None, ROLES)


@pytest.mark.parametrize("name", ["in", "Axis 1::in the middle", "Load [%]", "F (lbf)"])
def test_a_name_is_none_of_them(name):
    assert tables((f"torque={name}",), None, ROLES)["torque"] == {"column": name}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('position = "angle"', "map.toml: position must be a table: .position., and below it column = NAME"),
        ('[[position]]\ncolumn = "angle"', "position must be a table"),
        ('[torque]\ncolumn = "F"\nunit = ["N"]', "map.toml: unit of torque must be text in quotes"),
    ],
)
def test_a_map_in_a_file_that_is_no_table_of_columns_is_told_what_is_wrong(tmp_path, text, said):
    (tmp_path / "map.toml").write_text(text)
    with pytest.raises(ConfigError, match=said):
        tables((), tmp_path / "map.toml", ROLES)
