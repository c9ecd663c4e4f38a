"""docs/config.md: every key of every model, with unit, bounds, default and meaning."""

import re
from pathlib import Path

import pytest

from hw import registry
from rtctl.rig_file.config import Config
from tests.documents import rig_file_keys as config_document
from tests.documents.rig_file_keys import unit

TEXT = (Path(__file__).parents[2] / "docs" / "config.md").read_text()
ROW = re.compile(r"^\| `(\w+)` \| (.*?) \| (.*) \| (.*?) \| (.*) \|$")


MODELS = {"rig file": Config} | {kind: registry.options_model(kind) for kind in registry.BUILT_IN}


def keys(schema):
    """Every (key, property) of a model and of those inside it."""
    for table in (schema, *schema.get("$defs", {}).values()):
        yield from table.get("properties", {}).items()


def rows():
    return [found for line in TEXT.splitlines() if (found := ROW.match(line.replace("\\|", "/")))]


def refers(one):
    """True for a key that holds a table of its own, which has a heading in place of a row."""
    return "$ref" in str(one)


@pytest.mark.parametrize("name", MODELS)
def test_every_key_has_a_row_and_a_meaning(name):
    shown = {found[1] for found in rows()}
    plain = [
        (key, one) for key, one in keys(MODELS[name].model_json_schema(by_alias=True)) if not refers(one)
    ]
    assert [key for key, one in plain if not one.get("description")] == [], "say what it means"
    assert {key for key, _ in plain} - shown == set()


@pytest.mark.parametrize("name", MODELS)
def test_every_number_has_both_bounds(name):
    def bare(one):
        numbers = [one, *one.get("anyOf", ())]
        return any(
            part.get("type") in ("number", "integer")
            and not (
                {"minimum", "exclusiveMinimum", "const"} & set(part) and {"maximum", "const"} & set(part)
            )
            and "enum" not in part
            for part in numbers
        )

    assert [key for key, one in keys(MODELS[name].model_json_schema(by_alias=True)) if bare(one)] == []


def test_no_cell_is_empty_but_that_of_the_unit():
    assert len(rows()) > 250
    assert [found[1] for found in rows() if not (found[3] and found[4] and found[5])] == []


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("stiffness_nm_rad", "N m/rad"),
        ("damping_nms_rad", "N m s/rad"),
        ("torque_rate_nm_s", "N m/s"),
        ("velocity_limit_rad_s", "rad/s"),
        ("inertia_kgm2", "kg m^2"),
        ("tare_s", "s"),
        ("renderer_power_w", "W"),
        ("gain", ""),
        ("name", ""),
        ("window", ""),
        ("axis", ""),
    ],
)
def test_units_are_read_off_the_names_of_the_keys(key, said):
    assert unit(key) == said


@pytest.mark.parametrize(
    "row",
    [
        "| `rate_hz` | Hz | 100 to 20000 | 1000 | control rate |",
        '| `clock` |  | "wall", "virtual" | "wall" |',
        "| `batch_ms` | ms | 1 to 1000 | none |",
        "| `inertia_kgm2` | kg m^2 | 1e-09 to 1000 | required |",
    ],
)
def test_a_row_says_what_the_model_says(row):
    assert row in config_document.rig_file()


def test_a_model_that_comes_again_is_linked_to_where_it_stands():
    options = config_document.device_options()
    assert options.count("| `load_limit` |") == 1
    assert options.count("Keys as in [`[device.options.bus]`](#deviceoptionsbus).") == 3
