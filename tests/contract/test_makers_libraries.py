"""Every command frame as the makers' own libraries build it, byte by byte or with its reason; every reply
read alike.

`makers/vectors.json` holds their frames, with the versions they are of; `makers/make_vectors.py` makes it.
canopen is asked itself: it is installed for the CAN devices.
"""

import itertools
import json
import math
import re
import struct
from pathlib import Path

import canopen
import numpy as np
import pytest
from canopen.objectdictionary import ObjectDictionary, ODVariable
from canopen.objectdictionary.datatypes import INTEGER16, UNSIGNED16
from canopen.pdo.base import PdoMap
from canopen.profiles.p402 import State402

from hw.can import cia402, moteus, moteus_codec, odrive, odrive_codec, odrive_firmware
from hw.can.odrive_firmware import ERRORS_05, decode_version
from hw.can.sample import Sample
from hw.force import optoforce, rdt
from hw.interface import Rig

VECTORS = json.loads((Path(__file__).parent / "makers" / "vectors.json").read_text())
RIG = Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.full(1, 4096.0), np.eye(3)[:1])
AXIS = {"node": 5, "direction": 1, "shaft": "motor", "offset_rad": 0.0, "current_max_a": 20.0}
OPTIONS = {"feedback": "cyclic", "heartbeat_ms": 10.0, "temperature_ms": 100.0}


class Bus:
    """Remembers what is sent, as (command, data)."""

    class Frame:
        def __init__(self, can_id, length):
            self.id, self.buffer, self.offset, self.length = can_id, bytearray(length), 0, length

    def __init__(self):
        self.sent = []

    def outgoing(self, can_id, length):
        return self.Frame(can_id, length)

    def send(self, frame):
        self.sent.append((frame.id & 0x1F, bytes(frame.buffer).hex()))
        return True


def test_it_is_said_which_versions_the_frames_are_of():
    assert all(version[0].isdigit() for version in VECTORS["versions"].values())
    assert set(VECTORS["versions"]) == {"moteus", "odrive", "odrive-can", "cantools", "optoforce", "NetFT"}


def test_the_table_of_makers_names_the_versions_that_were_asked():
    here = Path(__file__).parent / "makers"
    kept = dict(line.split("==") for line in (here / "requirements.txt").read_text().split())
    readings = json.loads((here / "readings.json").read_text())["versions"]
    bota = json.loads((here / "bota.json").read_text())["version"]
    assert kept == VECTORS["versions"] | readings | {"bota-driver": bota}
    lines = (Path(__file__).parents[2] / "constraints.txt").read_text().splitlines()
    installed = dict(line.split("==") for line in lines if "==" in line)
    rows = [line for line in (here / "README.md").read_text().splitlines() if line.startswith("| ")]
    told = {}
    for row in rows[1:]:
        cells = [cell.strip() for cell in row.split("|")]
        told |= dict(zip(re.findall(r"`([^`]+)`", cells[2]), cells[3].split(", "), strict=True))
    known = installed | kept
    assert told == {name: known[name] for name in told}
    assert {*kept, "canopen", "cantools", "pyserial", "python-can"} == set(told)


# -- moteus ------------------------------------------------------------------------------------------------
def split(data, command):
    """A frame of moteus without its query and padding, and the registers that the query asks for by type."""
    whole = bytes.fromhex(data) if isinstance(data, str) else bytes(data)
    query, asked = whole[len(command) :].rstrip(b"\x50"), set()
    at = 0
    while at < len(query):
        head, at = query[at], at + 1
        assert 0x10 <= head <= 0x1F
        count = head & 3
        if not count:
            count, at = query[at], at + 1
        asked |= {(query[at] + k, head >> 2 & 3) for k in range(count)}
        at += 1
    return whole[: len(command)], asked


@pytest.mark.parametrize(
    "vector", VECTORS["moteus"]["commands"], ids=lambda v: f"{v['node']} {v['torque_nm']} N m"
)
def test_a_moteus_command_is_the_librarys_and_asks_for_the_same_registers(vector):
    frame = bytearray(moteus_codec.command_frame())
    moteus_codec.encode_command(frame, 0, vector["torque_nm"], 2.0, 0.01)
    command = moteus_codec.COMMAND + bytes(moteus_codec.COMMAND_FLOATS.size)
    theirs, ours = split(vector["data"], command), split(frame, command)
    assert ours == theirs, "the query's subframes are cut otherwise: 3 and 1 floats where theirs are 4"
    assert moteus_codec.command_id(vector["node"], vector["source"]) & 0x1FFF_FFFF == vector["id"]


@pytest.mark.parametrize("vector", VECTORS["moteus"]["stops"], ids=lambda v: f"{v['node']}")
def test_a_moteus_stop_is_the_librarys(vector):
    assert split(moteus_codec.stop_frame(), moteus_codec.STOP) == split(vector["data"], moteus_codec.STOP)
    assert moteus_codec.command_id(vector["node"], vector["source"]) & 0x1FFF_FFFF == vector["id"]


@pytest.mark.parametrize("vector", VECTORS["moteus"]["identities"], ids=lambda v: f"{v['node']}")
def test_a_moteus_is_asked_who_it_is_as_by_the_library(vector, monkeypatch):
    sample, bus = Sample(1), Bus()
    axis = moteus.MoteusAxis(
        {**AXIS, "node": vector["node"]}, {"source": 0, "time_to_live_ms": 10.0}, RIG, 0, sample
    )
    monkeypatch.setattr(moteus, "wait_for", lambda *_: True)
    axis.set_up(bus)
    asked = bytes.fromhex(bus.sent[0][1])
    assert asked.rstrip(b"\x50") == bytes.fromhex(vector["data"]).rstrip(b"\x50")


@pytest.mark.parametrize("vector", VECTORS["moteus"]["replies"], ids=lambda v: f"mode {v['read'][0]}")
def test_a_moteus_reply_is_read_as_the_library_reads_it(vector):
    data = bytes.fromhex(vector["data"])
    assert moteus_codec.decode_reply(data, 0, len(data)) == tuple(vector["read"])


# -- ODrive ------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("version", ["0.5.6", "0.6.10"])
def test_an_odrives_commands_are_those_of_its_dbc_without_the_bytes_that_say_nothing(version):
    known = VECTORS["odrive"][version]
    axis = odrive.OdriveAxis(AXIS, OPTIONS, RIG, 0, Sample(1))
    bus = Bus()
    axis.make_frames(bus)
    axis.write(bus, 0.0, True)
    axis.handlers()[odrive_codec.can_id(5, odrive_codec.HEARTBEAT)](
        struct.pack("<IBBBB", 0, 8, 0, 0, 0), 0, 8
    )
    for torque in known["torques"]:
        axis.write(bus, torque["torque_nm"], True)
    axis.stop(bus)
    wanted = [known["torque_control"], known["clear"], known["closed_loop"]]
    zero = known["torques"][0]
    wanted += [zero, *known["torques"], zero, known["idle"]]
    assert len(bus.sent) == len(wanted)
    for (command, data), theirs in zip(bus.sent, wanted, strict=True):
        assert command == theirs["command"]
        assert theirs["data"].ljust(16, "0") == data.ljust(16, "0")
        assert len(data) in (2, 8, 16), (
            "1 byte of Clear_Errors (Identify: no), 4 of one number: 40 us less on the bus"
        )


def test_command_6_is_what_makes_the_firmwares_differ():
    old, new = (VECTORS["odrive"][version]["commands"] for version in ("0.5.6", "0.6.10"))
    assert old["Set_Axis_Node_ID"] == new["Address"] == odrive_codec.ADDRESS
    assert new["Get_Version"] == odrive_codec.GET_VERSION
    assert odrive_codec.GET_VERSION not in old.values()
    shared = (
        "Heartbeat",
        "Set_Axis_State",
        "Get_Encoder_Estimates",
        "Set_Controller_Mode",
        "Set_Input_Torque",
        "Get_Iq",
    )
    for name in (*shared, "Clear_Errors"):
        assert old[name] == new[name]


@pytest.mark.parametrize("version", ["0.5.6", "0.6.10"])
def test_an_odrives_frames_are_read_as_its_dbc_says(version):
    known, sample = VECTORS["odrive"][version], Sample(1)
    axis = odrive.OdriveAxis(AXIS, OPTIONS, RIG, 0, sample)

    def hear(name):
        data = bytes.fromhex(known[name]["data"])
        axis.handlers()[odrive_codec.can_id(5, known[name]["command"])](data, 0, len(data))

    for name in ("estimates", "iq", "heartbeat"):
        hear(name)
    assert sample.position_rad[0] == pytest.approx(-12.25 * 2 * math.pi)
    assert sample.velocity_rad_s[0] == pytest.approx(0.5 * 2 * math.pi)
    assert sample.current_a[0] == -1.75
    assert (axis.state, axis.error) == (8, 0x40 if version == "0.5.6" else 0x20)
    if version == "0.6.10":
        hear("temperature")
        hear("address")
        assert sample.temperature_c[0] == 41.5
        assert axis.identity == bytes([1, 2, 3, 4, 5, 6])
        assert decode_version(bytes.fromhex(known["version"]["data"]), 0, 8) == (0, 6, 10)


def test_an_odrives_errors_have_the_makers_names():
    assert {str(bit): name for bit, name in odrive_firmware.ERRORS.items()} == VECTORS["odrive"]["errors"]
    assert {str(bit): name for bit, name in ERRORS_05.items()} == VECTORS["odrive"]["0.5.6"]["errors"]
    assert VECTORS["odrive"]["0.6.10"]["errors"].items() <= VECTORS["odrive"]["errors"].items()


# -- CiA 402 -----------------------------------------------------------------------------------------------
STATES = {
    "NOT READY TO SWITCH ON": cia402.NOT_READY, "SWITCH ON DISABLED": cia402.SWITCH_ON_DISABLED,
    "READY TO SWITCH ON": cia402.READY, "SWITCHED ON": cia402.SWITCHED_ON,
    "OPERATION ENABLED": cia402.ENABLED,
    "FAULT": cia402.FAULT, "FAULT REACTION ACTIVE": cia402.FAULT, "QUICK STOP ACTIVE": cia402.QUICK_STOP,
}  # fmt: skip


def test_every_statusword_is_the_state_that_canopen_names():
    for statusword in range(0x10000):
        theirs = [name for name, (mask, bits) in State402.SW_MASK.items() if statusword & mask == bits]
        assert cia402.drive_state(statusword) == (STATES[theirs[0]] if theirs else cia402.NOT_READY)


def test_the_way_up_is_canopens():
    way = ["SWITCH ON DISABLED", "READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED"]
    for before, after in itertools.pairwise(way):
        wanted = State402.TRANSITIONTABLE[before, after]
        assert cia402.controlword(STATES[before], True, 1) == wanted
    down = State402.TRANSITIONTABLE["OPERATION ENABLED", "READY TO SWITCH ON"]
    assert cia402.controlword(cia402.ENABLED, False, 1) == down
    assert cia402.FAULT_RESET == State402.CW_SWITCH_ON_DISABLED


@pytest.mark.parametrize(("control", "target"), [(0x0F, 500), (0x06, 0), (0x0F, -32768), (0x07, 32767)])
def test_the_rpdo_is_what_canopen_packs(control, target):
    known = ObjectDictionary()
    for index, kind in ((0x6040, UNSIGNED16), (0x6071, INTEGER16)):
        variable = ODVariable(f"{index:04X}", index)
        variable.data_type = kind
        known.add_object(variable)
    node = canopen.RemoteNode(5, known)
    pdo = PdoMap(node.rpdo, None, None)
    for index in (0x6040, 0x6071):
        pdo.add_variable(index)
    pdo["6040"].raw, pdo["6071"].raw = control, target
    assert bytes(pdo.data) == cia402.COMMAND.pack(control, target)


# -- force sensors -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("vector", VECTORS["optoforce"]["configurations"], ids=lambda v: f"{v['rate_hz']} Hz")
def test_an_optoforce_is_configured_as_its_library_does(vector):
    ours = optoforce.configure(vector["rate_hz"], vector["filter_hz"], zero=vector["zero"])
    assert ours.hex() == vector["data"]


@pytest.mark.parametrize("vector", VECTORS["optoforce"]["frames"], ids=lambda v: v["layout"])
def test_an_optoforce_frame_is_read_as_its_library_does(vector):
    data = bytes.fromhex(vector["data"])
    assert optoforce.intact(data)
    assert (optoforce.header(vector["layout"]), optoforce.length(vector["layout"])) == (data[:4], len(data))
    reading = optoforce.decode(data)
    assert (reading.mark, list(reading.force)) == (vector["count"], vector["counts"][:3])
    assert optoforce.encode(vector["layout"], vector["counts"], vector["count"], vector["status"]) == data


def test_rdt_asks_as_netft_does_and_reads_its_records():
    ours = {"stream": rdt.request(rdt.START_REALTIME), "stop": rdt.request(rdt.STOP)}
    for vector in VECTORS["rdt"]["requests"]:
        assert ours[vector["what"]].hex() == vector["data"]
    for vector in VECTORS["rdt"]["records"]:
        number, reading = rdt.decode(bytes.fromhex(vector["data"]))
        assert (number, list(reading.force)) == (vector["number"], vector["read"][:3])
