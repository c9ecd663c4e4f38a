"""Devices of a rig file, read from made-up trees: present, permitted, set up."""

import json
import os

import pytest
from made_up_tree import look, put

from rtctl.host import machine_ports, machine_wiring

BUS = {
    "interface": "socketcan",
    "channel": "can0",
    "bitrate": 1_000_000,
    "fd": False,
    "data_bitrate": 5_000_000,
}


@pytest.fixture
def port(tmp_path):
    """A character device: /dev/null under the name of a USB adapter."""
    (tmp_path / "dev").mkdir()
    (tmp_path / "dev/ttyUSB0").symlink_to("/dev/null")
    return tmp_path


def test_a_port_that_is_there_may_be_used(port):
    (line,) = look(port, {"port": "/dev/ttyUSB0"})
    assert line.status == "ok"


def test_a_missing_port_fails_and_names_those_there_are(tmp_path):
    put(tmp_path, "dev/serial/by-id/usb-FTDI_1", "")
    (line,) = look(tmp_path, {"port": "/dev/serial/by-id/usb-FTDI_2"})
    assert line.status == "fail"
    assert "usb-FTDI_1" in line.found
    assert line.check == "device[0] 'drive'"


def test_a_file_in_place_of_a_port_fails(tmp_path):
    put(tmp_path, "dev/ttyUSB0", "")
    assert look(tmp_path, {"port": "/dev/ttyUSB0"})[0].status == "fail"


def test_a_port_of_another_group_fails_with_the_command_to_join_it(port, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    (line,) = look(port, {"port": "/dev/ttyUSB0"})
    assert line.status == "fail"
    assert "usermod -aG dialout" in line.fix


@pytest.mark.parametrize(("timer", "status"), [("1", "ok"), ("16", "warn")])
def test_the_latency_timer_of_the_ports_adapter_is_looked_at(port, timer, status):
    put(port, "sys/bus/usb-serial/devices/null/latency_timer", timer)
    lines = look(port, {"port": "/dev/ttyUSB0"})
    assert [line.status for line in lines] == ["ok", status]
    assert ("ATTR{latency_timer}" in lines[1].fix) == (status == "warn")


def test_without_a_rig_file_every_adapter_is_looked_at(tmp_path):
    put(tmp_path, "sys/bus/usb-serial/devices/ttyUSB1/latency_timer", "16")
    put(tmp_path, "sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "1")
    assert [line.status for line in machine_ports.usb_adapters(tmp_path)] == ["ok", "warn"]


def test_an_address_is_resolved_but_nothing_is_sent(tmp_path):
    (line,) = look(tmp_path, {"host": "127.0.0.1", "port": 49152})
    assert (line.status, "127.0.0.1" in line.found) == ("ok", True)


def test_an_address_that_cannot_be_reached_fails(tmp_path, monkeypatch):
    def _unknown(*_arguments, **_more):
        raise OSError(-2, "Name or service not known")

    monkeypatch.setattr("socket.getaddrinfo", _unknown)
    (line,) = look(tmp_path, {"host": "sensor.invalid"})
    assert line.status == "fail"
    assert "ip route get sensor.invalid" in line.fix


def can(root, *, flags="0x41", kind="280"):
    put(root, "sys/class/net/can0/type", kind)
    put(root, "sys/class/net/can0/flags", flags)


def answer(state="ERROR-ACTIVE", bitrate=1_000_000, data_bitrate=None, kind="can"):
    data = {"state": state, "bittiming": {"bitrate": bitrate}}
    if data_bitrate:
        data["data_bittiming"] = {"bitrate": data_bitrate}
    return lambda _command: json.dumps(
        [{"ifname": "can0", "linkinfo": {"info_kind": kind, "info_data": data}}]
    )


@pytest.mark.parametrize(
    ("ask", "bus", "status", "words"),
    [
        (answer(), {}, "ok", "1000000 bit/s, ERROR-ACTIVE"),
        (answer(bitrate=500_000), {}, "fail", "500000 bit/s, the rig file says 1000000"),
        (answer(state="ERROR-PASSIVE"), {}, "warn", "ERROR-PASSIVE"),
        (answer(state="BUS-OFF"), {}, "fail", "BUS-OFF"),
        (answer(), {"fd": True}, "fail", "no CAN FD"),
        (answer(data_bitrate=2_000_000), {"fd": True}, "fail", "2000000 bit/s"),
        (answer(data_bitrate=5_000_000), {"fd": True}, "ok", "ERROR-ACTIVE"),
        (answer(kind="vcan"), {}, "ok", "virtual"),
        (lambda _command: "", {}, "warn", "unknown"),
        (lambda _command: "[]", {}, "warn", "unknown"),
        (lambda _command: "[3]", {}, "warn", "unknown"),
    ],
)
def test_bit_rate_and_state_of_a_can_interface(tmp_path, ask, bus, status, words):
    can(tmp_path)
    (line,) = look(tmp_path, {"bus": {**BUS, **bus}}, ask)
    assert line.status == status
    assert words in line.found
    assert bool(line.fix) == (status != "ok")


def test_a_can_interface_that_is_down_missing_or_no_can_fails_with_the_commands(tmp_path):
    (line,) = look(tmp_path, {"bus": BUS})
    assert (line.status, "no CAN interface can0" in line.found) == ("fail", True)
    can(tmp_path, flags="0x40")
    (line,) = look(tmp_path, {"bus": {**BUS, "fd": True}})
    assert (line.status, "is down" in line.found) == ("fail", True)
    assert "type can bitrate 1000000 dbitrate 5000000 fd on" in line.fix
    can(tmp_path, kind="1")
    assert look(tmp_path, {"bus": BUS})[0].status == "fail"


def test_the_serial_port_of_a_can_adapter_is_a_port(port):
    (line,) = look(port, {"bus": {**BUS, "interface": "slcan", "channel": "/dev/ttyUSB0"}})
    assert line.status == "ok"
    (line,) = look(port, {"bus": {**BUS, "interface": "virtual", "channel": "x"}})
    assert line.status == "ok"


def test_a_device_without_wires_is_ok(tmp_path):
    assert [line.status for line in look(tmp_path, {"seed": 1})] == ["ok"]


def test_a_command_that_is_missing_or_fails_says_nothing():
    assert machine_wiring.run(["no-such-command-here"]) == ""
    assert machine_wiring.run(["false"]) == ""


# ---- devices of third parties: whatever their options call it
# --------------------------------------------------------
@pytest.mark.parametrize(
    ("options", "missing"),
    [
        ({"device": "/dev/ttyACM7"}, "no /dev/ttyACM7"),
        ({"link": {"path": "/dev/ttyACM7", "speed": 3}}, "no /dev/ttyACM7"),
        ({"ports": ["/dev/ttyACM7"]}, "no /dev/ttyACM7"),
        ({"motors": [{"tty": "/dev/ttyACM7"}]}, "no /dev/ttyACM7"),
        ({"usb": "0403:6014"}, "no USB device 0403:6014; there are 2341:0043:a1"),
        ({"usb_id": "2341:0043:B2"}, "no USB device 2341:0043:B2"),
        ({"vendor_id": 0x0403, "product_id": 0x6014}, "no USB device 0403:6014"),
        ({"vid": "0x403", "pid": "6014"}, "no USB device 0403:6014"),
        ({"channel": "can3"}, "no CAN interface can3; there are can0"),
        ({"can_interface": "vcan1"}, "no CAN interface vcan1"),
        ({"wire": {"interface": "socketcan", "channel": "can3", "bitrate": 500_000}},
            "no CAN interface can3; there are can0"),
    ],
)  # fmt: skip
def test_a_third_partys_device_that_is_not_there_is_named(tmp_path, options, missing):
    put(tmp_path, "sys/bus/usb/devices/1-1/idVendor", "2341")
    put(tmp_path, "sys/bus/usb/devices/1-1/idProduct", "0043")
    put(tmp_path, "sys/bus/usb/devices/1-1/serial", "A1")
    can(tmp_path)
    (line,) = look(tmp_path, options)
    assert (line.status, line.check) == ("fail", "device[0] 'drive'")
    assert missing in line.found
    assert line.fix


@pytest.mark.parametrize(
    "options",
    [
        {"usb": "2341:0043"},
        {"usb": "2341:0043:a1"},
        {"vendor_id": 0x2341, "product_id": 0x43},
        {"can": "can0"},
    ],
)
def test_a_third_partys_device_that_is_there_is_ok(tmp_path, options):
    for name, value in {
        "idVendor": "2341",
        "idProduct": "0043",
        "serial": "A1",
        "busnum": "1",
        "devnum": "5",
    }.items():
        put(tmp_path, f"sys/bus/usb/devices/1-1/{name}", value)
    can(tmp_path)
    assert [line.status for line in look(tmp_path, options)] == ["ok"]


def test_a_usb_device_of_another_user_fails_with_the_rule_that_opens_it(tmp_path, monkeypatch):
    for name, value in {"idVendor": "2341", "idProduct": "0043", "busnum": "1", "devnum": "5"}.items():
        put(tmp_path, f"sys/bus/usb/devices/1-1/{name}", value)
    put(tmp_path, "dev/bus/usb/001/005", "")
    monkeypatch.setattr(os, "access", lambda *_: False)
    (line,) = look(tmp_path, {"usb": "2341:0043"})
    assert line.status == "fail"
    assert 'ATTR{idVendor}=="2341"' in line.fix


def test_a_wire_that_two_keys_name_is_looked_at_once(port):
    assert len(look(port, {"port": "/dev/ttyUSB0", "spare": {"path": "/dev/ttyUSB0"}})) == 1


def test_a_real_device_that_names_no_wire_is_told_so_and_a_simulated_one_is_not(tmp_path):
    (line,) = machine_wiring.check(tmp_path, [("device[0] 'odd'", {"gain": 3})], real={"device[0] 'odd'"})
    assert (line.status, "port, host, bus or usb" in line.fix) == ("warn", True)
    (line,) = machine_wiring.check(tmp_path, [("device[0] 'odd'", {"gain": 3})])
    assert line.status == "ok"
