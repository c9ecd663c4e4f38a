"""The tick record and what is generated from it."""

import json
import math

import jsonschema
import numpy as np
import pytest

from rtctl import tick
from rtctl.cli.json_text import json_text


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


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_non_finite_values_travel_as_null_in_json(value):
    ticks = tick.new_ticks(1, 2)
    floats = {field.name for field in tick.FIELDS if field.kind == "float"}
    for name in floats:
        ticks[name] = value
    body = {name: np.asarray(ticks[0][name]).tolist() for name in ticks.dtype.names}
    sent = json.loads(json_text(body), parse_constant=pytest.fail)
    jsonschema.validate(sent, tick.json_schema(2))
    nulls = {
        name
        for name, item in sent.items()
        if item is None or (isinstance(item, list) and set(item) == {None})
    }
    assert nulls == floats
    assert {"authority", "position_rad", "force_n"} <= floats, "a scalar, one per axis, one of three parts"


def test_what_is_counted_is_never_null():
    schema = tick.json_schema(2)["properties"]
    for field in tick.FIELDS:
        if field.kind != "float":
            null = None if field.shape == "scalar" else [None] * 2
            with pytest.raises(jsonschema.ValidationError):
                jsonschema.validate(null, schema[field.name])


SUFFIXES = {"N m": "_nm", "kg m^2": "_kgm2", "N m s/rad": "_nms_rad", "degC": "_c"}
"""Of units whose name in a field is not the unit with its slash and spaces written as underlines, in small
letters."""


def without_its_unit(field):
    """Whether a field that has a unit does not end in it, or one that has none seems to have one."""
    plain = field.unit.replace(" ", "_").replace("/", "_").lower()
    if field.unit == "1":
        return field.name.endswith(("_ns", "_s", "_rad", "_nm", "_n", "_a", "_j"))
    return not field.name.endswith(SUFFIXES.get(field.unit, f"_{plain}"))


def test_every_field_has_its_unit_in_its_name_or_is_a_count():
    assert not [(field.name, field.unit) for field in tick.FIELDS if without_its_unit(field)]


@pytest.mark.parametrize(
    ("name", "unit"),
    [("velocity_rad", "rad/s"), ("torque_applied", "N m"), ("period_ns", "1"), ("force_a", "N")],
)
def test_a_field_of_another_unit_is_noticed(name, unit):
    assert without_its_unit(tick.Field(name, "float", "axis", unit, "law", ""))


def test_the_command_prints_the_schema():
    from click.testing import CliRunner

    from rtctl.cli.schema import command

    result = CliRunner().invoke(command, ["--axes", "2"])
    assert result.exit_code == 0
    assert json.loads(result.output) == tick.json_schema(2)


def test_a_copy_of_records_has_their_bits_and_none_of_their_memory():
    rows = tick.new_ticks(5, 2)
    rows.view(np.uint8)[:] = np.arange(rows.nbytes) % 251  # no two fields alike, payloads of NaN too
    rows["force_n"] = np.nan
    for part in (rows, rows[1:3], rows[::2], rows[:0]):
        made = tick.copied(part)
        assert made.dtype == part.dtype
        assert made.tobytes() == part.tobytes()
        made["tick"] = 7  # a copy may be written
        assert not np.shares_memory(made, part)
        assert (part["tick"] != 7).all()
