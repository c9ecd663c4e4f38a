"""Described boards that only measure, are slower than the loop, start over after 360 degrees, or answer only
when asked.
"""

import math
import os
import select
import struct
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from described_wire import Wire, options
from hardware import rig

from hw import registry
from hw.interface import AskedBackend, BackendError, LinkFault, LinkLost
from hw.serial.backend import SerialCore
from hw.serial.checksums import KINDS, checksum
from hw.serial.described_backend import DescribedBackend
from hw.serial.described_options import DescribedOptions
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config

FORCE = {"channel": "force", "type": "i16", "offset": 2, "unit": "mN", "scale": 5.0}
SENSOR = {
    "port": "/dev/x",
    "baud": 115200,
    "sample": {"sync": [1, 2], "length": 6, "checksum": "crc16-xmodem", "field": [FORCE]},
}


def made(table, **context):
    valid = DescribedOptions.model_validate(table, context=context).model_dump(mode="json")
    return DescribedBackend(valid, rig())


def sealed(body, tail=b""):
    value = checksum(KINDS["crc16-xmodem"], np.frombuffer(body, np.uint8), 0, len(body))
    return body + value.to_bytes(2, "little") + tail


def test_a_board_that_measures_only_a_force_is_a_device():
    wire = Wire(SENSOR)
    assert (wire.backend.provides, wire.backend.consumes) == ({"force"}, frozenset())
    wire.tick["position_rad"] = 7.0
    wire.feed(sealed(struct.pack("<BBh", 1, 2, -300)))
    assert wire.tick["force_n"][0, 0] == pytest.approx(-1.5)
    assert (wire.count, wire.tick["position_rad"][0, 0]) == (1, 7.0), (
        "what it does not measure it leaves alone"
    )
    assert wire.backend._stop_packet() == b""


def test_a_board_that_measures_nothing_is_refused():
    sample = {**SENSOR["sample"], "field": [{"channel": "sequence", "type": "u16", "offset": 2}]}
    with pytest.raises(ValueError, match="nothing is measured"):
        made({**SENSOR, "sample": sample})


def test_the_bit_rate_is_judged_by_the_boards_own_rate():
    slow = {**SENSOR, "baud": 9600}
    with pytest.raises(
        BackendError, match=r"baud 9600 is too slow for a sample of 6 bytes, 1000 times a second"
    ):
        made(slow)
    assert made(slow, device_rate_hz=100.0)
    assert made({**slow, "rate_hz": 100.0})
    with pytest.raises(
        BackendError, match=r"4000 times a second: they need at least 266667; .*lower the device's rate_hz"
    ):
        made({**SENSOR, "rate_hz": 4000.0})


def test_the_rate_of_the_device_table_reaches_its_options(tmp_path):
    text = (
        Path(shipped_config("mock.toml"))
        .read_text()
        .replace('kind = "mock"', 'kind = "mock"\nchannels = ["position", "current", "current_command"]', 1)
    )
    field = '{ channel = "force", type = "i16", offset = 2, unit = "mN" }'
    text += f"""
[[device]]
kind = "serial-described"
rate_hz = 100
max_age_ticks = 10
[device.options]
port = "/dev/x"
baud = 9600
[device.options.sample]
sync = [1, 2]
length = 6
checksum = "crc16-xmodem"
field = [{field}]
"""
    (tmp_path / "rig.toml").write_text(text)
    assert load(tmp_path / "rig.toml").more_options[0]["rate_hz"] == 100.0


@pytest.mark.parametrize(
    ("kind", "wrap_at", "unit", "scale"),
    [
        ("u16", 360.0, "deg", 0.01),
        ("f32", 360.0, "deg", 1.0),
        ("u16", 4000.0, "counts", 1.0),
        ("i32", 45.0, "deg", -1e-4),
    ],
)
def test_an_angle_is_followed_over_any_modulus(kind, wrap_at, unit, scale):
    table = options()
    position = next(field for field in table["sample"]["field"] if field["channel"] == "position")
    position |= {"type": kind, "wrap_at": wrap_at, "unit": unit, "scale": scale}
    wire = Wire(table)
    turn = wrap_at * (math.pi / 180 if unit == "deg" else 2 * math.pi / 160_000)
    true, seen = np.cumsum(np.sin(np.arange(400) / 40) * 0.4 * turn), []
    for angle in true:
        wire.measured["position_rad"] = angle
        seen.append(float(wire.feed(wire.frame())["position_rad"][0, 0]))
    assert np.asarray(seen) - seen[0] == pytest.approx(
        true - true[0], abs=2 * abs(scale) * turn / wrap_at + 1e-6 * turn
    )
    assert np.ptp(true) > 10 * turn


def test_an_angle_beyond_its_range_is_a_device_fault_and_never_a_sample():
    table = options()
    position = next(field for field in table["sample"]["field"] if field["channel"] == "position")
    position |= {"type": "f32", "wrap_at": 360.0, "unit": "deg"}
    wire = Wire(table)
    wire.feed(wire.frame())
    before = float(wire.tick["position_rad"][0, 0])
    frame = bytearray(wire.frame())
    frame[4:8] = struct.pack("<f", 1e20)
    crc = checksum(KINDS["crc16-ccitt"], np.frombuffer(frame, np.uint8), 2, 20)
    frame[20:22] = crc.to_bytes(2, "little")
    wire.feed(bytes(frame))
    assert (wire.count, wire.faults) == (1, LinkFault.DEVICE)
    assert wire.tick["position_rad"][0, 0] == before


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"wrap_at": 360.0, "wrap_bits": 12}, "in place of wrap_bits, not"),
        ({"wrap_at": 0.0}, "wrap_at"),
    ],
)
def test_a_modulus_that_makes_no_sense_is_refused(change, said):
    field = {"channel": "position", "type": "u16", "offset": 2, "unit": "deg", **change}
    with pytest.raises(ValueError, match=said):
        made({**SENSOR, "sample": {**SENSOR["sample"], "field": [field]}})


def test_a_command_whose_zero_cannot_be_said_is_refused():
    field = {"channel": "torque", "type": "u8", "offset": 2, "unit": "N m", "zero": 300.0}
    command = {"sync": [3], "length": 5, "checksum": "crc16-xmodem", "field": [field]}
    with pytest.raises(ValueError, match="a command of 0 cannot be sent"):
        made({**SENSOR, "command": command})


def test_bytes_behind_the_checksum_are_part_of_the_frame():
    sample = {**SENSOR["sample"], "length": 7, "tail": [3]}
    wire = Wire({**SENSOR, "sample": sample})
    body = struct.pack("<BBh", 1, 2, 200)
    wire.feed(sealed(body, b"\4"))
    assert wire.count == 0
    wire.feed(sealed(body, b"\3"))
    assert wire.count == 1
    assert wire.frame()[-1] == 3


def test_a_poll_goes_out_behind_every_command_and_by_itself():
    wire = Wire({**SENSOR, "poll": [9, 9]})
    assert (wire.sent(), wire.backend.asks) == (b"\t\t", True)
    driven = Wire(options(poll=[9, 9]))
    assert driven.sent()[:2] == b"\x55\xaa"
    assert driven.sent()[10:] == b"\t\t"
    assert not Wire().backend.asks


def test_a_drive_is_switched_on_once_and_off_while_not_armed():
    wire = Wire(options(command__enter=[0xFC], command__idle=[0xFD], poll=[9]))
    sent = []
    for enabled in (0, 1, 1, 0, 1):
        wire.tick["enabled"], wire.tick["current_command_a"] = enabled, 0.25
        sent.append(wire.sent())
    assert [len(one) for one in sent] == [2, 2, 11, 2, 2]
    assert [one[0] for one in sent] == [0xFD, 0xFC, 0x55, 0xFD, 0xFC]
    assert wire.backend._stop_packet() == b"\xfd" * 3
    with pytest.raises(ValueError, match="enter needs idle"):
        made(options(command__enter=[0xFC]))


def test_a_drive_that_has_let_go_is_taken_back_only_once_idle_has_been_sent():
    table = options(command__enter=[0xFC], command__idle=[0xFD])
    fault = next(field for field in table["sample"]["field"] if field["channel"] == "fault")
    free = next(k for k in range(8) if not any(f.get("mask", 0) >> k & 1 for f in table["sample"]["field"]))
    table["sample"]["field"].append({**fault, "channel": "enabled", "mask": 1 << free})
    wire = Wire(table)

    def exchange(enabled):
        wire.tick["enabled"], wire.tick["current_command_a"] = enabled, 0.1 * enabled
        wire.board.take(wire.sent())
        wire.feed(wire.frame())
        return wire.faults

    assert [exchange(on) for on in (0, 1, 1, 1, 0, 0)] == [0] * 6, (
        "switched off by the host it has let go of nothing"
    )
    assert [exchange(1) for _ in range(3)] == [0] * 3
    wire.board.hold()
    wire.feed(wire.frame())
    assert wire.faults == LinkFault.DEVICE
    assert [exchange(on) for on in (1, 1)] == [LinkFault.DEVICE] * 2
    assert [exchange(on) for on in (0, 0, 1, 1)] == [0] * 4
    assert wire.board.output[0] == pytest.approx(0.1)


def test_probe_asks_by_the_poll_and_sends_nothing_else():
    class Port(list):
        write = list.append

    for table, asked in [
        ({**SENSOR, "poll": [9, 9]}, [b"\t\t"]),
        (options(poll=[9]), [b"\t"]),
        (options(), []),
    ]:
        backend = made(table)
        assert isinstance(backend, AskedBackend)
        with pytest.raises(LinkLost, match="not open"):
            backend.ask()
        backend._port = Port()
        backend.ask()
        assert backend._port == asked


def test_the_stop_of_a_board_comes_behind_commands_of_zero():
    packet = Wire(options(stop=[[7], [8]])).backend._stop_packet()
    assert packet[-2:] == b"\7\x08"
    assert len(packet) == 8 * 10 + 2, "eight commands, a quarter of the count apart"
    assert Wire({**SENSOR, "stop": [[7]]}).backend._stop_packet() == b"\7"


def test_a_board_is_started_and_asked_until_it_is_heard(monkeypatch):
    master, slave = os.openpty()
    heard = bytearray()

    class Told(DescribedBackend):
        """Its board answers the third question."""

        def _take_in(self, n):
            super()._take_in(n)
            if select.select([master], [], [], 0)[0]:
                heard.extend(os.read(master, 100))
                if heard.count(b"?") == 3:
                    os.write(master, sealed(struct.pack("<BBh", 1, 2, 1)))

    table = {**SENSOR, "port": os.ttyname(slave), "start": [[0x21]], "poll": [0x3F], "open_timeout_s": 30.0}
    backend = Told(DescribedOptions.model_validate(table).model_dump(mode="json"), rig())
    monkeypatch.setattr("hw.serial.asking.ASK_AGAIN_S", 0.01)
    backend.open()
    assert bytes(heard[:6]) == b"!?" * 3
    backend.close()
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize(("output_hz", "fits"), [(1000, False), (100, True)])
def test_the_bit_rate_of_an_optoforce_is_judged_by_its_own_rate(output_hz, fits):
    given = {"port": "/dev/x", "baud": 115200, "counts_per_n": [100.0] * 3, "output_hz": output_hz}
    valid = registry.options_model("optoforce").model_validate(given).model_dump(mode="json")
    if fits:
        assert registry.create("optoforce", valid, rig()).provides == {"force"}
    else:
        with pytest.raises(
            BackendError, match="baud 115200 is too slow for a sample of 16 bytes, 1000 times"
        ):
            registry.create("optoforce", valid, rig())


def test_a_stop_that_cannot_be_made_leaves_no_open_port(monkeypatch):
    closed = []
    port = SimpleNamespace(fd=-1, close=lambda: closed.append(True))
    monkeypatch.setattr("hw.serial.backend.Port", lambda *_: port)
    backend = SerialCore(
        {"port": "/dev/null", "baud": 9600, "open_timeout_s": 1.0, "reopen_timeout_s": 1.0}, rig(1)
    )
    with pytest.raises(NotImplementedError):  # of a board without one; or Ctrl-C while it is compiled
        backend.open()
    assert closed == [True]
