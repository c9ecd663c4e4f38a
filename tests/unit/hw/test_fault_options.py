"""Schedules of faults: what is refused, and how it is said."""

import json

import pytest
from pydantic import ValidationError

from hw.fault_options import load_schedule, read_faults
from hw.playback.options import PlaybackOptions
from hw.simulators.mock_options import MockOptions

GOOD = {"channel": "position", "kind": "jump", "at_tick": 5, "for_ticks": 1, "value": 0.1}


def changed(**changes):
    return {key: value for key, value in {**GOOD, **changes}.items() if value is not ...}


BAD = [
    (changed(channel="postion"), "no channel 'postion'; there are: actuator, current, estop"),
    (changed(kind="jmup"), "position has no kind 'jmup'; it has: nan, inf, jump"),
    (changed(kind=...), "kind: kind is missing"),
    (changed(channel=3), "channel: must be text in quotes, not 3"),
    (changed(value=...), "value: position jump needs one, -1e+06 to 1e+06 rad"),
    (changed(value=2e6), "value: 2000000.0 of position jump: must be -1e+06 to 1e+06 rad"),
    (changed(value=float("nan")), "value: nan of position jump"),
    (changed(value="0.1"), "value: must be a number from -1000000000000 to 1000000000000, not '0.1'"),
    (changed(kind="nan"), "value: 0.1 of position nan: it has none"),
    (changed(at_s=1.0), "at_tick: give one of at_s and at_tick"),
    (changed(at_tick=...), "at_tick: give one of at_s and at_tick"),
    (changed(for_ticks=...), "for_ticks: give one of for_s and for_ticks; 0 is for ever"),
    (changed(for_s=1.0), "for_ticks: give one of for_s and for_ticks; 0 is for ever"),
    (changed(every_s=1.0, every_ticks=1), "every_ticks: give one of every_s and every_ticks, or neither"),
    (changed(for_ticks=0, every_s=1.0), "cannot come again"),
    (changed(at_tick=-1), "at_tick: must be a whole number from 0 to 1e+15, not -1"),
    (changed(at_tick=1.5), "at_tick: must be a whole number from 0 to"),
    (changed(at_tick=..., at_s=float("inf")), "at_s: must be a finite number from 0"),
    (changed(for_ticks=..., for_s=-0.1), "for_s: must be a number from 0 to 1000000000, not -0.1"),
    (changed(probability=1.01), "probability: must be a number from 0 to 1, not 1.01"),
    (changed(axis=-1), "axis: must be a whole number from 0"),
    (changed(axis=2), "axis: 2 is not there; must be below 2"),
    (changed(channel="force", kind="nan", value=..., axis=3), "axis: 3 is not there; must be below 3"),
    (changed(length=3), "length: unknown key; there are at_s"),
    (changed(channel="loop", kind="stall", value=1.0), "nothing stalls on a virtual clock"),
]


@pytest.mark.parametrize(("table", "text"), BAD)
def test_a_bad_fault_is_refused_with_key_value_and_bound(table, text):
    with pytest.raises(ValueError) as refused:
        read_faults([GOOD, table], {"n_axes": 2, "clock": "virtual"})
    assert str(refused.value).startswith("fault[1]")
    assert text in str(refused.value)


def test_all_that_is_wrong_with_one_fault_is_told_at_once():
    table = changed(at_s=1.0, for_ticks=..., kind="jmup", axis=99, probability=2.0, length=3)
    with pytest.raises(ValueError) as refused:
        read_faults([table])
    for text in (
        "give one of at_s and at_tick",
        "give one of for_s and for_ticks",
        "no kind 'jmup'",
        "axis: ",
        "probability: ",
        "length: ",
    ):
        assert text in str(refused.value)
    assert str(refused.value).count("axis: ") == 1, "a bound is told once"


def test_a_good_fault_passes_with_its_default_value():
    (fault,) = read_faults([changed(kind="out_of_range", value=...)])
    assert fault["value"] == 1e6
    assert fault["probability"] == 1.0
    assert read_faults([fault]) == [fault], "the dump is a schedule again"


def test_too_many_faults_are_refused():
    assert len(read_faults([GOOD] * 32)) == 32
    with pytest.raises(ValueError, match="at most 32"):
        read_faults([GOOD] * 33)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "[[fault]]\nchannel = 'link'\nkind = 'drop'\nat_s = 1",
            "fault[0].for_ticks: give one of for_s and for_ticks; 0 is for ever",
        ),
        ("[[fualt]]\n", "fault: fault is missing"),
        ("[[fault]]\n= 1", "not a TOML file"),
        ("fault = []", "fault: needs at least one"),
        (b"\xff\xfe", "not a TOML file"),
    ],
)
def test_a_bad_file_is_named(tmp_path, text, said):
    path = tmp_path / "bad.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ValueError) as refused:
        load_schedule(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert said in str(refused.value)


def test_all_faults_of_a_file_are_told_at_once(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text("[[fault]]\nchannel = 'link'\n[[fault]]\nchannel = 'link'\nkind = 'x'\n")
    with pytest.raises(ValueError, match=r"fault\[0\]\.kind.*fault\[1\]\.kind"):
        load_schedule(path)
    line = "{channel = 'current', kind = 'offset', at_s = 1, at_tick = 3, value = 1e9, foo = 1, axis = 9}"
    path.write_text(f"fault = [{line}]")
    with pytest.raises(ValueError) as refused:
        load_schedule(path)
    for key in ("axis", "at_tick", "for_ticks", "value", "foo"):
        assert f"fault[0].{key}: " in str(refused.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"absent\.toml: cannot read the faults: No such file"):
        load_schedule(tmp_path / "absent.toml")


def test_the_mock_takes_a_file_beside_the_rig_file_or_the_tables(tmp_path):
    (tmp_path / "faults.toml").write_text(
        "[[fault]]\nchannel = 'position'\nkind = 'jump'\nat_tick = 5\nfor_ticks = 1\nvalue = 0.1\n"
    )
    from_file = MockOptions.model_validate({"faults": "faults.toml"}, context={"folder": tmp_path})
    assert from_file == MockOptions.model_validate({"faults": [GOOD]})
    dump = json.loads(json.dumps(from_file.model_dump(mode="json")))
    assert MockOptions.model_validate(dump) == from_file


@pytest.mark.parametrize("bits", [-1, 7, 33, 12.0])
def test_a_width_no_counter_has_is_refused(bits):
    with pytest.raises(ValidationError, match="encoder_bits"):
        MockOptions.model_validate({"axis": [{"encoder_bits": bits}]})


def test_a_playback_has_no_actuator_to_break(tmp_path):
    (tmp_path / "log.csv").write_text("x\n0\n0\n")
    table = {"file": "log.csv", "rate_hz": 1000.0, "axis": [{"position": {"column": "x"}}]}
    dead = {"channel": "actuator", "kind": "dead", "at_tick": 1, "for_ticks": 0}
    with pytest.raises(
        ValidationError, match=r"\[1\]\.channel: 'actuator': a log has only position, current"
    ):
        PlaybackOptions.model_validate({**table, "faults": [GOOD, dead]}, context={"folder": tmp_path})
    PlaybackOptions.model_validate({**table, "faults": [GOOD]}, context={"folder": tmp_path})
