"""The moment of the hand by every way a board of one's own reaches us: N m in the axes of the force, or no
sample.
"""

import math
import struct
from functools import partial

import described_wire
import lines_wire
import numpy as np
import pytest
import serial_wire
from board_frames import RIG
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from hw.can.board_backend import BoardBackend, ReceivedFrame
from hw.can.board_options import BoardOptions
from hw.can.sample import Sample
from hw.force import axes
from hw.force.options import RokubiOptions
from hw.interface import BackendError, LinkFault
from hw.serial.declared import state_packet_bytes
from hw.serial.described_options import DescribedOptions
from hw.serial.frame_backend import SerialBackend
from hw.serial.options import SerialOptions
from hw.simulators.serial_firmware import Board
from rtctl.tick import new_ticks

SIX = (1.5, -2.0, 0.25, 0.5, -0.125, 0.75)


# -- CAN ---------------------------------------------------------------------------------------------------
def can_options(unit="Nm", kind="float", scale=1.0, **more):
    def field(channel, axis, byte, unit):
        bits = 32 if kind == "float" else 16
        return {
            "channel": channel,
            "axis": axis,
            "byte": byte,
            "bits": bits,
            "type": kind,
            "unit": unit,
            **more,
        }

    step = 4 if kind == "float" else 2
    forces = [field("force", k, step * k, "N") for k in range(3)]
    moments = [{**field("moment", k, step * k, unit), "scale": scale} for k in range(3)]
    table = {"bus": {"interface": "virtual", "channel": "x", "fd": True}}
    frames = [{"id": 0x10 + k, "length": 3 * step, "field": one} for k, one in enumerate((forces, moments))]
    return BoardOptions.model_validate({**table, "receive": frames}).model_dump()


def test_a_can_sensor_gives_six_components_and_is_fresh_only_with_both_frames():
    options, sample = can_options(), Sample(1)
    assert BoardBackend(options, RIG).provides == {"force", "moment"}
    force, moment = (ReceivedFrame(table, RIG, sample) for table in options["receive"])
    force.handler(struct.pack("<3f", *SIX[:3]), 0, 12)
    assert sample.fresh != sample.needed
    moment.handler(struct.pack("<3f", *SIX[3:]), 0, 12)
    assert sample.fresh == sample.needed
    assert [*sample.force_n, *sample.moment_nm] == list(SIX)


def test_a_moment_of_a_can_board_may_be_in_millinewton_metres_and_turned():
    options, sample = can_options("mNm", "int", -0.5), Sample(1)
    _, moment = (ReceivedFrame(table, RIG, sample) for table in options["receive"])
    moment.handler(struct.pack("<3h", 1000, -2000, 4), 0, 6)
    assert list(sample.moment_nm) == pytest.approx([-0.5, 1.0, -0.002])


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_moment_of_a_can_board_that_is_no_number_has_not_come(wrong):
    options, sample = can_options(), Sample(1)
    _, moment = (ReceivedFrame(table, RIG, sample) for table in options["receive"])
    moment.handler(struct.pack("<3f", 0.0, 0.0, wrong), 0, 12)
    assert (sample.fresh, sample.counts["not_finite"], list(sample.moment_nm)) == (0, 1, [0.0] * 3)


def test_the_moment_of_a_can_board_is_taken_into_the_tick_with_its_sample():
    backend, tick = BoardBackend(can_options(), RIG), new_ticks()
    backend.bus = object()
    backend._bind(tick)
    backend.sample.moment_nm[1], backend.sample.force_n[2] = 0.5, 2.0
    backend.sample.fresh = backend.sample.needed
    assert backend.show()
    assert (tick["moment_nm"][0].tolist(), tick["force_n"][0].tolist()) == ([0.0, 0.5, 0.0], [0.0, 0.0, 2.0])


@pytest.mark.parametrize("wrong", [{"unit": "N"}, {"axis": 3}])
def test_a_moment_of_a_can_board_has_three_axes_and_its_own_units(wrong):
    field = {"channel": "moment", "axis": 0, "byte": 0, "bits": 16, "unit": "Nm", **wrong}
    table = {"bus": {"interface": "virtual", "channel": "x"}, "receive": [{"id": 1, "field": [field]}]}
    with pytest.raises((ValidationError, BackendError), match="moment"):
        BoardBackend(BoardOptions.model_validate(table).model_dump(), RIG)


# -- described frames and lines ----------------------------------------------------------------------------
def described(kind="f32", unit="N m", scale=1.0):
    step = 4 if kind == "f32" else 2
    field = [
        {"channel": "force", "component": k, "type": kind, "offset": 2 + step * k, "unit": "N"}
        for k in range(3)
    ]
    field += [
        {
            "channel": "moment",
            "component": k,
            "type": kind,
            "offset": 2 + step * (3 + k),
            "unit": unit,
            "scale": scale,
        }
        for k in range(3)
    ]
    return {
        "port": "/dev/x",
        "sample": {
            "sync": [0xAA, 0x55],
            "length": 2 + 6 * step + 2,
            "checksum": "crc16-ccitt",
            "field": field,
        },
    }


def test_a_described_sensor_gives_six_components_and_its_simulated_board_sends_them():
    wire = described_wire.Wire(described())
    assert wire.backend.provides == {"force", "moment"}
    wire.measured["force_n"], wire.measured["moment_nm"] = SIX[:3], SIX[3:]
    tick = wire.feed(wire.frame())
    assert (wire.count, [*tick["force_n"][0], *tick["moment_nm"][0]]) == (1, list(SIX))


def test_a_described_moment_has_its_unit_scale_and_sign():
    wire = described_wire.Wire(described("i16", "mN m", -0.5))
    wire.measured["moment_nm"] = -0.5, 1.0, 0.002
    frame = wire.frame()
    assert struct.unpack_from("<3h", frame, 8) == (1000, -2000, -4)
    assert wire.feed(frame)["moment_nm"][0] == pytest.approx([-0.5, 1.0, 0.002])


@pytest.mark.parametrize("k", range(3))
def test_a_described_moment_that_is_no_number_is_a_fault_of_the_device(k):
    wire = described_wire.Wire(described())
    wire.feed(wire.frame())
    wire.measured["moment_nm"][0, k] = math.nan
    tick = wire.feed(wire.frame())
    assert (wire.count, wire.faults) == (1, LinkFault.DEVICE)
    assert (tick["moment_nm"] == 0).all()


def test_a_described_board_without_moments_leaves_them_alone():
    table = described()
    table["sample"]["field"] = table["sample"]["field"][:3]
    wire = described_wire.Wire(table)
    wire.tick["moment_nm"] = 7
    wire.feed(wire.frame())
    assert wire.count == 1
    assert (wire.tick["moment_nm"] == 7).all()


def test_a_component_of_a_moment_is_given_once():
    table = described()
    table["sample"]["field"][4]["component"] = 0
    with pytest.raises(ValidationError, match="'moment', component 0 is given twice"):
        DescribedOptions.model_validate(table)


def line_options():
    field = [{"channel": "force", "component": k, "column": k, "unit": "N"} for k in range(3)]
    field += [{"channel": "moment", "component": k, "column": 3 + k, "unit": "mN m"} for k in range(3)]
    return {"port": "/dev/x", "sample": {"columns": 6, "field": field}}


def test_a_line_of_six_numbers_is_force_and_moment():
    wire = lines_wire.Wire(line_options())
    wire.feed(b"1.5,-2.0,0.25,500,-125,750\n")
    assert wire.count == 1
    assert [*wire.tick["force_n"][0], *wire.tick["moment_nm"][0]] == list(SIX)
    wire.feed(b"1.5,-2.0,0.25,500,nan,750\n")
    assert (wire.count, wire.faults) == (1, LinkFault.DEVICE)


# -- rtctl-frame -------------------------------------------------------------------------------------------
class MomentWire(serial_wire.Wire):
    def __init__(self, *, moments=True, n_axes=1, velocity=False, **options):
        super().__init__(n_axes, velocity=velocity, **options)
        speed = self.board._counts_per_rad
        self.board = Board(n_axes, "SIM-0001", 1000, speed, moments=moments)


@pytest.mark.parametrize(("n_axes", "velocity"), [(1, False), (2, True)])
def test_a_boards_moment_is_in_newton_metres_beside_its_force(n_axes, velocity):
    channels = ["force", "moment", *(["velocity"] if velocity else [])]
    wire = MomentWire(n_axes=n_axes, velocity=velocity, channels=channels)
    wire.measured["force_n"], wire.measured["moment_nm"] = SIX[:3], SIX[3:]
    wire.measured["device_velocity_rad_s"] = 0.25
    packet = wire.packet()
    assert len(packet) == state_packet_bytes(n_axes, velocity=velocity, moment=True)
    tick = wire.feed(packet)
    assert (wire.count, wire.faults) == (1, 0)
    assert [*tick["force_n"][0], *tick["moment_nm"][0]] == pytest.approx(SIX)
    assert (tick["device_velocity_rad_s"][0] > 0.2).all() == velocity


@pytest.mark.parametrize("missing", ["the board says so", "it sends packets without"])
def test_a_moment_that_is_used_and_missing_is_a_fault_of_the_device(missing):
    wire = MomentWire(moments=missing == "the board says so", channels=["force", "moment"])
    wire.board.moment_missing = missing == "the board says so"
    wire.feed(wire.packet())
    assert wire.faults == LinkFault.DEVICE
    assert "MOMENT_MISSING" in wire.backend.words()[0].text


def test_boards_that_were_there_before_work_as_they_did():
    wire = MomentWire(moments=False, channels=["force"])
    wire.tick["moment_nm"] = 7
    packet = wire.packet()
    assert len(packet) == 45
    wire.feed(packet)
    assert (wire.count, wire.faults) == (1, 0)
    assert (wire.tick["moment_nm"] == 7).all()
    assert "MISSING" not in wire.backend.words()[0].text
    more = MomentWire(channels=["force"])
    more.feed(more.packet())
    assert (more.count, more.faults) == (1, 0), "a packet with moments, of which the rig file says nothing"


def test_a_line_that_cannot_carry_the_moments_is_refused():
    for channels, fits in ((["force"], True), (["force", "moment"], False)):
        options = SerialOptions.model_validate({"port": "/dev/x", "baud": 520_000, "channels": channels})
        made = partial(SerialBackend, options.model_dump(mode="json"), RIG)
        if fits:
            made()
        else:
            with pytest.raises(BackendError, match="too slow for a sample of 57 bytes"):
                made()


# -- turned and mirrored axes ------------------------------------------------------------------------------
VECTORS = st.lists(st.floats(-10, 10), min_size=3, max_size=3)


@given(st.lists(st.floats(-1, 1), min_size=9, max_size=9), VECTORS, VECTORS, st.booleans())
def test_a_moment_turns_with_its_force(entries, lever, force, mirrored):
    turn, _ = np.linalg.qr(np.reshape(entries, (3, 3)) + 2 * np.eye(3))
    turn = turn * (-1.0 if mirrored else 1.0)
    ours = axes.moment_matrix({"matrix": turn.tolist(), "moment_matrix": None})
    moment = np.cross(lever, force)
    assert np.array(ours) @ moment == pytest.approx(np.cross(turn @ lever, turn @ force), abs=1e-9)


MIRRORED = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]


def test_the_moments_of_a_sensor_follow_the_matrix_of_its_forces_unless_they_have_their_own():
    given = {"port": "/dev/null", "moments": True}
    dumped = RokubiOptions.model_validate({**given, "matrix": MIRRORED}).model_dump(mode="json")
    assert axes.moment_matrix(dumped) == [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]
    own = RokubiOptions.model_validate({**given, "matrix": MIRRORED, "moment_matrix": MIRRORED})
    assert axes.moment_matrix(own.model_dump(mode="json")) == MIRRORED


def test_forces_that_are_scaled_or_mixed_say_nothing_of_moments():
    scaled = [[2, 0, 0], [0, 1, 0], [0, 0, 1]]
    with pytest.raises(ValidationError, match="give moment_matrix"):
        RokubiOptions.model_validate({"port": "/dev/null", "moments": True, "matrix": scaled})
    RokubiOptions.model_validate({"port": "/dev/null", "matrix": scaled})
    with pytest.raises(BackendError, match="give moment_matrix"):
        axes.moment_matrix({"matrix": scaled, "moment_matrix": None})


def test_a_sensor_that_the_rig_does_not_use_is_no_word_of_a_board_without_it():
    wire = MomentWire(moments=False, channels=["force"])
    wire.board.temperature_missing = wire.board.force_missing = True
    wire.feed(wire.packet())
    said = wire.backend.words()[0].text
    assert "FORCE_MISSING" in said, "the rig uses it: what stopped it"
    assert "TEMPERATURE" not in said, "beside a fault it would be read as its cause"
