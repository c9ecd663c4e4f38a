"""Faults of rig files in plain words: file and line, key, value, bound, and what was probably meant."""

import copy
import itertools
import tomllib

import pytest
from pydantic import ValidationError

from hw import registry
from hw.plain_words import explain
from rtctl.errors import ConfigError
from rtctl.rig_file.config import Config, load
from rtctl.rig_file.toml_lines import TomlLines
from rtctl.simulation.shipped_files import shipped

GOOD = shipped("configs/mock.toml").read_text()
LIBRARY = (
    "Input should",
    "Value error",
    "valid",
    "Extra inputs",
    "Field required",
    "String should",
    "ype=",
    "pydantic",
)
WRONG = ("x", -1e30, True, [], {}, [{}], float("nan"), 1.5, None)


def told(tmp_path, text):
    (tmp_path / "friction").mkdir(exist_ok=True)
    (tmp_path / "friction/mock.json").write_bytes(shipped("configs/friction/mock.json").read_bytes())
    file = tmp_path / "rig.toml"
    file.write_text(text)
    with pytest.raises(ConfigError) as refused:
        load(file)
    return [line.removeprefix(str(file)) for line in refused.value.faults] or [str(refused.value)]


def line_of(text, piece):
    return text[: text.index(piece)].count("\n") + 1


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("[[axis]]", "[axis]", "axis: [axis] must be [[axis]], with two brackets: there may be several"),
        ("[loop]", "[[loop]]", "loop: [[loop]] must be [loop], with one bracket: there is one only"),
        ("inertia_kgm2 =", "inertia_kgm =", "axis[0].inertia_kgm: unknown key; did you mean inertia_kgm2?"),
        ("inertia_kgm2 = 0.012", 'inertia_kgm2 = "big"', "must be a number from 1e-09 to 1000, not 'big'"),
        ("gear_ratio = 80.0", "gear_ratio = 0", "axis[0].gear_ratio: must be a number from"),
        (
            'clock = "wall"',
            'clock = "vitrual"',
            "must be 'wall' or 'virtual', not 'vitrual'; did you mean virtual?",
        ),
        (
            'name = "mock"',
            'name = "my rig"',
            "must be a letter, then at most 31 letters, digits, - or _, not 'my rig'",
        ),
        ("[0.0, 0.1, 0.0]", "[0.0, 0.1]", "axis[0].lever_m: must have 3 entries, has 2"),
        ("[axis.velocity]", "[axis.velcity]", "axis[0].velcity: unknown key; did you mean velocity?"),
        ("schema = 1", "schema = 2", "schema: must be 1, not 2"),
        ('kind = "mock"', 'kind = "mokc"', "device[0].kind: no backend 'mokc'; there are:"),
        (
            "window = 16",
            "window = 1.5",
            "axis[0].velocity.window: must be a whole number from 2 to 64, not 1.5",
        ),
    ],
)
def test_the_usual_mistakes_are_told_with_line_key_value_and_remedy(tmp_path, before, after, said):
    assert before in GOOD
    text = GOOD.replace(before, after, 1)
    lines = told(tmp_path, text)
    fitting = [line for line in lines if said in line]
    assert fitting, lines
    assert fitting[0].startswith(f":{line_of(text, after)}: ")


def test_what_is_missing_is_told_with_its_meaning_and_bounds(tmp_path):
    (line,) = told(tmp_path, GOOD.replace("torque_limit_nm = 2.0", ""))
    assert line.startswith(
        f":{line_of(GOOD, '[[axis]]')}: axis[0].torque_limit_nm: torque_limit_nm is missing: "
    )
    assert "(a number from" in line


def test_a_table_that_is_missing_is_told_with_its_brackets_and_where_to_take_one_from(tmp_path):
    rig, axis, device = told(tmp_path, "schema = 1\n")
    assert "rig is missing: a table [rig] with the rig's name; `" in rig
    assert "init` copies a whole rig file" in rig
    assert axis.endswith("axis is missing: a table [[axis]] for each axis")
    assert device.endswith("device is missing: a table [[device]] for each device")


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('"wall"', "wall", "not a TOML file: no value; text needs quotes: clock = wall"),
        ("[loop]", "[loop", "not a TOML file: Expected ']' at the end of a table declaration: [loop"),
        ("[loop]", "[rig]", "not a TOML file: Cannot declare ('rig',) twice: [rig]"),
    ],
)
def test_a_file_that_is_no_toml_is_told_with_its_line(tmp_path, before, after, said):
    (line,) = told(tmp_path, GOOD.replace(before, after, 1))
    assert said in line


def mutations(data, path=()):
    """Every key of the tables, replaced by something wrong."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in items:
        yield from ((*path, key, wrong) for wrong in WRONG)
        if isinstance(value, dict | list) and value:
            yield from mutations(value, (*path, key))


@pytest.mark.parametrize(
    "name", ["mock", "can-odrive", "can-board", "serial-described", "playback", "drive-and-force-sensor"]
)
def test_no_sentence_of_the_library_reaches_a_person(name):
    data = tomllib.loads(shipped(f"configs/{name}.toml").read_text())
    data |= {
        "telemetry": {"batch_ms": 5.0},
        "gateway": {"port": 9860},
        "record": {"file_mb": 1.0},
        "view": {"port": 9000},
    }
    heard = set()
    for *path, last, wrong in mutations(data):
        made = copy.deepcopy(data)
        at = made
        for part in path:
            at = at[part]
        at[last] = wrong
        for model, given in [(Config, made), *options(made)]:
            try:
                model.model_validate(given, context={"folder": shipped("configs"), "n_axes": 1})
            except ValidationError as error:
                heard.update(f"{one.where}: {one.text}" for one in explain(error, model, given))
    assert len(heard) > 50
    assert [
        text for text, word in itertools.product(heard, LIBRARY) if word in text.replace("invalid", "")
    ] == []


def options(data):
    devices = data["device"] if isinstance(data["device"], list) else []
    for device in devices:
        if (
            isinstance(device, dict)
            and str(device.get("kind")) in registry.BUILT_IN
            and device.get("options") is not None
        ):
            yield registry.options_model(device["kind"]), device["options"]


def test_lines_of_keys_are_found_in_every_way_to_write_them():
    text = '''a = 1
"b c" = 2
long = """
[not.a.table]
x = 1
"""
many = [
  1,
  2, # ]
]
after = { y = "]" }
[t]  # [[u]]
k.l = 1
[[u]]
v = 1
[u.w]
x = 1
[[u]]
v = 2
[u.w]
[[u.z]]
q = 1
'''
    lines = TomlLines(text)
    assert tomllib.loads(text)["u"][1]["z"][0]["q"] == 1
    wanted = {
        ("a",): 1,
        ("b c",): 2,
        ("long",): 3,
        ("many", 1): 7,
        ("after", "y"): 11,
        ("t", "k", "l"): 13,
        ("t", "k"): 13,
    }
    wanted |= {("u", 0): 14, ("u", 0, "w", "x"): 17, ("u", 1, "v"): 19, ("u", 1, "z", 0, "q"): 22, ("u",): 14}
    assert {key: lines.of(key) for key in wanted} == wanted
    assert lines.of(("nothing",)) is None
