"""The shipped rig files of CAN devices, a DBC in place of a field map, and what is refused."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from hw import registry
from hw.can import dbc
from hw.can.board_options import BoardOptions
from hw.interface import BackendError, Rig
from rtctl.errors import ConfigError
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config

DBC = """VERSION ""

BU_: HOST BOARD

BO_ 257 Encoder: 8 BOARD
 SG_ Counts : 0|16@1+ (1,0) [0|0] "" HOST
 SG_ Current : 23|16@0- (0.001,0) [0|0] "A" HOST

BO_ 512 Command: 4 HOST
 SG_ Wanted : 0|16@1- (0.001,0) [0|0] "A" BOARD
 SG_ Enable : 16|1@1+ (1,0) [0|0] "" BOARD
"""
SIGNALS = [
    {"channel": "position", "message": "Encoder", "signal": "Counts", "unit": "count", "wrap": True},
    {"channel": "current", "message": "Encoder", "signal": "Current"},
    {"channel": "current_command", "message": "Command", "signal": "Wanted"},
    {"channel": "enable", "message": "Command", "signal": "Enable"},
]


def rig():
    return Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.full(1, 4096.0), np.eye(3)[:1])


@pytest.mark.parametrize("name", ["odrive", "moteus", "cia402", "board"])
def test_the_shipped_rig_files_are_valid_and_say_the_load_of_their_bus(name):
    loaded = load(shipped_config(f"can-{name}.toml"))
    ((_, lines),) = loaded.device_report()
    assert lines[0][0] == "bus load at worst"
    assert registry.create(loaded.config.device[0].kind, loaded.options, loaded.config.hardware())


@pytest.mark.parametrize("rate_hz", ["9000.0", "20000"])
def test_a_rig_file_that_cannot_fit_on_its_bus_is_refused_with_the_numbers(tmp_path, rate_hz):
    text = (
        Path(shipped_config("can-odrive.toml"))
        .read_text()
        .replace("rate_hz = 1000.0", f"rate_hz = {rate_hz}")
    )
    (tmp_path / "rig.toml").write_text(text)
    with pytest.raises(ConfigError) as refused:
        load(tmp_path / "rig.toml")
    (line,) = [line for line in refused.value.faults if "% of the bus" in line]
    assert "device[0].options" in line
    assert "lower [loop] rate_hz" in line


def test_a_missing_axis_table_is_refused(tmp_path):
    data = tomllib.loads(Path(shipped_config("can-odrive.toml")).read_text())["device"][0]["options"]
    model = registry.options_model("odrive")
    with pytest.raises(ValueError, match=r"1 .* tables for 2 axes"):
        model.model_validate(data, context={"n_axes": 2})


def board(tmp_path, signals=SIGNALS, text=DBC):
    (tmp_path / "board.dbc").write_text(text)
    options = {"bus": {"channel": "can0"}, "dbc": "board.dbc", "signal": signals}
    return BoardOptions.model_validate(options, context={"folder": tmp_path, "rate_hz": 1000.0})


def test_a_dbc_becomes_plain_frames_that_need_the_file_no_more(tmp_path):
    valid = board(tmp_path)
    dumped = valid.model_dump(mode="json")
    assert dumped["dbc"] is None
    receive, send = dumped["receive"][0], dumped["send"][0]
    assert (receive["id"], receive["length"], send["id"], send["length"]) == (257, 8, 512, 4)
    assert (
        receive["field"][1] | {"order": "big", "start_bit": 23, "scale": 0.001, "unit": "A"}
        == receive["field"][1]
    )
    assert BoardOptions.model_validate(dumped).model_dump(mode="json") == dumped
    backend = registry.create("can", dumped, rig())
    assert backend.provides == {"position", "current"}
    assert backend.consumes == {"current_command"}


def test_a_signal_of_a_dbc_is_sent_the_constant_that_it_is_given(tmp_path):
    enable = {"channel": "constant", "message": "Command", "signal": "Enable", "value": 1.0}
    (sent,) = board(tmp_path, [*SIGNALS[:3], enable]).send
    assert [(field.channel, field.value) for field in sent.field][-1] == ("constant", 1.0)


@pytest.mark.parametrize(
    ("unit", "shown"),
    [("rpm", "rpm"), ("1/min", "rpm"), ("deg/s", "deg/s"), ("rev/s", "turn/s"), ("counts/s", "count/s")],
)
def test_a_dbc_signal_of_a_speed_brings_its_unit(tmp_path, unit, shown):
    text = DBC.replace("BO_ 512", f' SG_ Speed : 32|16@1- (0.5,0) [0|0] "{unit}" HOST\n\nBO_ 512').replace(
        "HOST\n\n SG_", "HOST\n SG_"
    )
    signals = [*SIGNALS, {"channel": "velocity", "message": "Encoder", "signal": "Speed"}]
    dumped = board(tmp_path, signals, text).model_dump(mode="json")
    field = dumped["receive"][0]["field"][2]
    assert (field["channel"], field["unit"], field["scale"]) == ("velocity", shown, 0.5)
    assert registry.create("can", dumped, rig()).provides == {"position", "velocity", "current"}


def test_velocity_units_of_cia402_are_given_for_every_axis_or_none():
    model, wire = registry.options_model("cia402"), {"channel": "can0"}
    axes = [{"node": 1, "velocity_units": 4096.0}, {"node": 2, "velocity_units": 10.0}]
    assert len(model.model_validate({"bus": wire, "axis": axes}).frames(500.0)) == 10
    with pytest.raises(ValueError, match="velocity_units"):
        model.model_validate({"bus": wire, "axis": [axes[0], {"node": 2}]})


@pytest.mark.parametrize(("units", "claimed"), [(4096.0, {0x281}), (0.0, set())])
def test_a_cia402_drive_claims_the_identifier_of_its_velocity_only_where_it_sends_one(units, claimed):
    options = {"bus": {"channel": "can0"}, "axis": [{"node": 1, "velocity_units": units}]}
    found = registry.options_model("cia402").model_validate(options).identifiers()
    assert found & {0x281} == claimed


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"signal": "Nothing"}, "has no signal 'Nothing'; it has Counts, Current"),
        ({"message": "Nothing"}, "no message 'Nothing'; it has Command, Encoder"),
        ({"channel": "speed"}, "no channel 'speed'"),
        ({"shift": 3}, "unknown key"),
        ({"unit": "inch"}, "unit"),
        ({"channel": "velocity", "unit": "rad"}, "unit"),
    ],
)
def test_a_dbc_signal_at_fault_is_named(tmp_path, change, text):
    with pytest.raises(ValueError, match=text):
        board(tmp_path, [{**SIGNALS[0], **change}, *SIGNALS[1:]])


def test_a_file_that_is_no_dbc_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"board\.dbc: cannot read the DBC file"):
        board(tmp_path, text="not a database")


@pytest.mark.filterwarnings("ignore:.*odxtools:DeprecationWarning")
def test_a_description_of_diagnostics_is_no_description_of_frames(tmp_path):
    path = tmp_path / "board.cdd"
    path.write_text("<CANDELA><ECUDOC><ECU><VAR/></ECU></ECUDOC></CANDELA>")
    with pytest.raises(BackendError, match=r"board\.cdd: describes diagnostics"):
        dbc.load(path)


FIELD = {"channel": "position", "start_bit": 0, "bits": 16, "unit": "count"}


def sends(field):
    """A board that is sent a command, and this."""
    command = {"channel": "torque", "byte": 0, "bits": 16, "type": "int", "unit": "mNm"}
    return {"receive": [{"id": 1, "field": [FIELD]}], "send": [{"id": 2, "field": [command, field]}]}


def three_of_one_identifier(*select):
    """Frames of which the first is told by a number, and both others by the same."""
    heat, current = {**FIELD, "channel": "temperature", "unit": "degC"}, {**FIELD, "channel": "current"}
    first = {"id": 1, "select": [{"value": 7, "bits": 8, "byte": 7}], "field": [FIELD]}
    others = [{"id": 1, "select": select, "field": [one]} for one in (heat, {**current, "unit": "A"})]
    return {"receive": [first, *others]}


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"receive": [{"id": 0x800, "field": [FIELD]}]}, "0x800 needs extended = true"),
        ({"receive": [{"id": 1, "length": 2, "field": [{**FIELD, "start_bit": 8}]}]}, "does not fit"),
        ({"receive": [{"id": 1, "field": [{**FIELD, "unit": "A"}]}]}, "unit 'A' of position: one of rad"),
        ({"receive": [{"id": 1, "field": [FIELD, FIELD]}]}, "given twice: position of axis 0"),
        ({"receive": [{"id": 1, "required": False, "field": [FIELD]}]}, "at least one received frame"),
        ({"receive": [{"id": 1, "length": 16, "field": [FIELD]}]}, "need bus.fd = true"),
        ({"receive": [{"id": 1, "length": 9, "field": [FIELD]}]}, "a frame has one of"),
        (
            {"receive": [{"id": 1, "checksum": {"kind": "xor8", "byte": 8}, "field": [FIELD]}]},
            "outside the frame",
        ),
        (
            {"receive": [{"id": 1, "field": [{**FIELD, "type": "float", "bits": 32, "wrap": True}]}]},
            "wrap is for",
        ),
        (
            {"receive": [{"id": 1, "counter": {"byte": 4, "bits": 32, "type": "float"}, "field": [FIELD]}]},
            "counter of id 0x1: type uint or int",
        ),
        (sends({"channel": "counter", "byte": 4, "bits": 8, "type": "int"}), "counter: type uint, scale 1"),
        (sends({"channel": "counter", "byte": 4, "bits": 8, "scale": 2.0}), "counter: type uint, scale 1"),
        (sends({"channel": "enable", "byte": 4, "bits": 1, "type": "int"}), "enable: 1 bits of type int .*"),
        (three_of_one_identifier({"value": 1, "bits": 8, "byte": 7}), "id 0x1 is received twice"),
        (three_of_one_identifier(), "id 0x1 is received twice"),
    ],
)
def test_impossible_boards_are_refused_with_the_reason(change, text):
    with pytest.raises(ValueError, match=text):
        BoardOptions.model_validate({"bus": {"channel": "can0"}, **change})


def test_a_field_of_an_axis_the_rig_has_not_is_refused():
    options = {"bus": {"channel": "can0"}, "receive": [{"id": 1, "field": [{**FIELD, "axis": 1}]}]}
    valid = BoardOptions.model_validate(options).model_dump(mode="json")
    with pytest.raises(BackendError, match="names axis 1; there are 0 to 0"):
        registry.create("can", valid, rig())


@pytest.mark.parametrize("missing", ["socketcan", "slcan", "nonsense"])
def test_a_bus_that_cannot_be_opened_is_named_with_the_remedy(missing, tmp_path):
    bus = {"interface": missing, "channel": str(tmp_path / "tty") if missing == "slcan" else "can77"}
    options = registry.options_model("odrive").model_validate({"bus": bus, "axis": [{"node": 1}]})
    backend = registry.create("odrive", options.model_dump(mode="json"), rig())
    with pytest.raises(
        BackendError, match=r"no CAN: 'sudo modprobe|no such interface|cannot be opened|no such port"
    ):
        backend.open()
    backend.stop()
    backend.close()
