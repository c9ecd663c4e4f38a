"""The tick record and what is generated from it."""

import json

import jsonschema
import numpy as np
import pytest

from rtctl import tick


@pytest.mark.parametrize("n_axes", [1, 2, 8])
def test_the_dtype_is_whole_words_and_axis_fields_have_the_axis_dimension(n_axes):
    dtype = tick.tick_dtype(n_axes)
    assert dtype.itemsize % 8 == 0
    for field in tick.FIELDS:
        shape = dtype.fields[field.name][0].shape
        assert shape == {"scalar": (), "axis": (n_axes,), "xyz": (3,)}[field.shape]


def test_the_seal_is_the_last_word():
    assert tick.FIELDS[-1].name == "seal"
    assert tick.tick_dtype(2).fields["seal"][1] == tick.tick_dtype(2).itemsize - 8


def test_no_axes_is_refused():
    with pytest.raises(ValueError, match="n_axes"):
        tick.tick_dtype(0)


def test_the_json_schema_accepts_a_tick_and_refuses_a_wrong_one():
    schema = tick.json_schema(2)
    jsonschema.Draft202012Validator.check_schema(schema)
    row = tick.new_ticks(1, 2)[0]
    body = {name: np.asarray(row[name]).tolist() for name in row.dtype.names}
    jsonschema.validate(body, schema)
    for bad in (
        {**body, "extra": 1},
        {**body, "position_rad": [0.0]},
        {k: v for k, v in body.items() if k != "tick"},
    ):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(bad, schema)


def test_non_finite_values_travel_as_null_in_json():
    body = {field.name: None for field in tick.FIELDS if field.kind == "float" and field.shape == "scalar"}
    for name, value in body.items():
        jsonschema.validate(value, tick.json_schema()["properties"][name])


def test_every_field_has_a_unit_in_its_name_or_is_a_count():
    units = ("_ns", "_rad", "_rad_s", "_a", "_n", "_c", "_nm", "_nms_rad", "_j")
    for field in tick.FIELDS:
        if field.unit != "1":
            assert field.name.endswith(units), field.name


def test_the_command_prints_the_schema():
    from click.testing import CliRunner

    from rtctl.cli.schema import command

    result = CliRunner().invoke(command, ["--axes", "2"])
    assert result.exit_code == 0
    assert json.loads(result.output) == tick.json_schema(2)
