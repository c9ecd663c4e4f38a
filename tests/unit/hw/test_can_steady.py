"""Compiled cycles of CAN devices do what Python's do, to the bit: samples, commands, floods, damage,
lines.
"""

import math
import os
import random
import struct

import numpy as np
import pytest
from can_buses import LineBus, PairBus
from can_pair import KINDS, Talker, identifiers, noise, settled

from hw.can import slcan
from hw.can.batch import STRIDE
from hw.can.bus import DRAIN_LIMIT, ERROR, EXTENDED, REMOTE
from hw.can.fields import CHECKSUMS
from hw.can.steady_line import next_line, put_line
from hw.interface import LinkFault, LinkLost
from hw.jit import JIT_DISABLED

LINES = [(*names, LineBus) for names in KINDS if names[1] != "moteus"]  # CAN FD is not for lines


def story(device, cycles, noisy):
    """Armed and disarmed, commands that are no numbers, damage and foreign frames: what was seen and sent in
    every cycle.
    """
    rng, told = np.random.default_rng(5), []
    known = identifiers(device.bus)
    for k in range(cycles):
        enabled = int(40 <= k < 150 or k >= 170)
        command = math.nan if k in (90, 91, 120) else 40.0 * math.sin(0.1 * k)
        more = noise(rng, known) if noisy else []
        seen, sent = device.cycle(enabled=enabled, current_a=command, torque_nm=0.1 * command, more=more)
        told.append((seen.tobytes(), sent))
    return told


@pytest.mark.parametrize("noisy", [False, True], ids=["quiet", "noisy"])
@pytest.mark.parametrize(("rig_file", "kind", "bus"), [*((*names, PairBus) for names in KINDS), *LINES])
def test_both_ways_see_and_send_the_same(pair, rig_file, kind, bus, noisy):
    one, other = (pair(rig_file, kind, compiled_half=half, bus=bus) for half in (False, True))
    plain, quick = story(one, 240, noisy), story(other, 240, noisy)
    for k, (a, b) in enumerate(zip(plain, quick, strict=True)):
        assert a == b, k
    assert one.backend.counts() == other.backend.counts()
    assert [word.text for word in one.backend.words()] == [word.text for word in other.backend.words()]
    assert one.backend.counts()["samples"] > 150
    assert other.left["write"] < (210 if noisy else 130), other.left


@pytest.mark.parametrize("checksum", CHECKSUMS)
def test_numbers_of_every_kind_are_read_and_written_to_the_bit(pair, checksum):
    names = ("can-board.toml", "can")
    one, other = (pair(*names, compiled_half=half, talker=Talker(checksum)) for half in (False, True))
    plain, quick = story(one, 300, noisy=True), story(other, 300, noisy=True)
    for k, (a, b) in enumerate(zip(plain, quick, strict=True)):
        assert a == b, k
    counts = one.backend.counts()
    assert counts == other.backend.counts()
    assert min(counts[name] for name in ("damaged", "not_newer", "not_finite")) > 2, counts
    assert counts["samples"] > 100
    assert other.left["write"] < 220, other.left


def test_the_velocity_of_a_cia402_drive_comes_along(pair):
    def fast(options):
        options["axis"][0]["velocity_units"] = 65536.0

    names = ("can-cia402.toml", "cia402")
    one, other = (pair(*names, compiled_half=half, change=fast) for half in (False, True))
    assert story(one, 200, noisy=False) == story(other, 200, noisy=False)
    assert "velocity" in other.backend.provides


@pytest.mark.parametrize("bus", [PairBus, LineBus])
def test_a_loop_that_stood_still_shows_nothing_old_both_ways(pair, bus):
    told = []
    for half in (False, True):
        device = pair("can-odrive.toml", "odrive", compiled_half=half, bus=bus)
        for k in range(60):
            device.tick["tick"] += 7 * (k == 30)
            seen, _ = device.cycle(enabled=1)
            told.append(seen.tobytes())
    assert told[:60] == told[60:]
    assert seen["sample_count"][0] < 62


def test_a_flood_is_taken_in_bounded_cycles_both_ways(pair):
    told = []
    for half in (False, True):
        device = settled(pair, "can-odrive.toml", "odrive", compiled_half=half)
        node = device.backend.drives[0].node << 5
        flood = [(node | 0x09, struct.pack("<ff", 0.01 * k, 0.0)) for k in range(DRAIN_LIMIT + 2)]
        device.sim.pass_time = lambda *_: []
        told += [device.cycle(enabled=1, more=more)[0].tobytes() for more in (flood, [], [])]
    assert told[:3] == told[3:]


@pytest.mark.parametrize("half", [False, True])
def test_what_a_flood_leaves_for_the_next_cycle_is_no_fresh_sample(pair, half):
    device = settled(pair, "can-odrive.toml", "odrive", compiled_half=half)
    node, before = device.backend.drives[0].node << 5, int(device.tick["sample_count"][0])
    sample = [(node | kind, bytes(8)) for kind in (0x09, 0x14)]
    device.sim.pass_time = lambda *_: []
    # nothing comes any more: what is left was sent before the loop stood still, however long that was
    counts = [
        int(device.cycle(enabled=1, more=more)[0]["sample_count"][0]) - before
        for more in (sample * (DRAIN_LIMIT // 2 + 1), [], sample)
    ]
    assert counts == [0, 0, 1]


def test_an_error_frame_of_the_controller_is_heard(pair):
    device = settled(pair, "can-odrive.toml", "odrive")
    seen, _ = device.cycle(enabled=1, more=[(ERROR | 0x040, bytes(8))])
    assert LinkFault(int(seen["link_faults"][0])) == LinkFault.LOST
    seen, _ = device.cycle(enabled=1, more=[(ERROR | 0x100, bytes(8))])
    assert seen["link_faults"][0] == 0


def test_a_device_of_which_nothing_comes_is_lost_both_ways(pair):
    told = []
    for half in (False, True):
        device = pair("can-moteus.toml", "moteus", compiled_half=half)
        for _ in range(20):
            device.cycle(enabled=1)
        device.sim.frame = lambda *_: []
        told.append([device.cycle(enabled=1)[0]["link_faults"][0] for _ in range(20)])
    assert told[0] == told[1]
    assert LinkFault(int(told[0][-1])) == LinkFault.LOST


def test_a_write_that_fails_is_left_to_python_which_says_why(pair):
    device = settled(pair, "can-odrive.toml", "odrive")
    device.bus.far.close()
    with pytest.raises(LinkLost, match="Broken pipe"):
        device.step("write")


def test_a_port_that_is_hung_up_is_left_to_python_which_says_so(pair):
    device = settled(pair, "can-odrive.toml", "odrive", bus=LineBus)
    os.close(device.bus.far)
    try:
        with pytest.raises(LinkLost, match="unplugged or reset"):
            device.step("read")
    finally:
        device.bus.far = os.open("/dev/null", os.O_RDWR)


def test_a_line_that_comes_in_pieces_around_frames_for_python_is_read_once(pair):
    device = settled(pair, "can-odrive.toml", "odrive", bus=LineBus)
    before, node = int(device.tick["sample_count"][0]), device.backend.drives[0].node << 5
    device.sim.pass_time, device.bus.tells = lambda *_: [], False
    iq, beat, angle = (b"t%03X8%s\r" % (node | kind, bytes(8).hex().encode()) for kind in (0x14, 0x01, 0x09))
    whole, seen = iq + beat + angle, []
    for cut in (0, 5, 20, 30, 45, 60):
        for part in (whole[:cut], whole[cut:]):
            device.bus._put(part)
            seen.append(int(device.cycle(enabled=1)[0]["sample_count"][0]))
    assert seen[-1] == before + 6
    assert device.bus.health.counts["damaged"] == 0


def test_lines_are_read_as_the_reader_of_lines_does():
    rng, frame, taken = random.Random(4), np.zeros(STRIDE, np.uint8), 0
    letters = b"tTrRzZ0123456789abcdefABCDEFxX_ +\x07\xff"
    for _ in range(6000 if not JIT_DISABLED else 2000):
        length = rng.randrange(9)
        line = bytearray(b"t%03X%d%s" % (rng.randrange(0x800), length, rng.randbytes(length).hex().encode()))
        if rng.random() < 0.3:
            line[:4] = b"T%08x" % rng.randrange(1 << 30)
        for _ in range(rng.choice((0, 0, 1, 2))):
            line[rng.randrange(len(line))] = rng.choice(letters)
        line = bytes(line if rng.random() < 0.8 else line[: rng.randrange(len(line) + 1)])
        used, is_frame = next_line(np.frombuffer(line + b"\rt1", np.uint8), 0, len(line) + 3, frame)
        found = slcan.parse(line)
        if is_frame:
            taken += 1
            can_id, size = slcan.HEAD.unpack_from(frame.tobytes())
            assert (used, found) == (len(line) + 1, (can_id, frame[8 : 8 + size].tobytes())), line
        else:
            assert used in (-1, len(line) + 1)
            assert used == -1 or line in (b"", b"z", b"Z")
    assert taken > 1000 if not JIT_DISABLED else taken > 300
    assert next_line(np.full(90, 48, np.uint8), 0, 80, frame)[0] == -1, "no end of line for too long"


@pytest.mark.parametrize(
    "can_id", [0x7FF, 0x0A5, EXTENDED | 0x1ABC_DEF0, REMOTE | 0x123, REMOTE | EXTENDED | 5]
)
def test_lines_are_written_as_the_writer_of_lines_does(can_id):
    frame, line = slcan.SlcanFrame(can_id, 3), np.zeros(64, np.uint8)
    frame.buffer[:] = b"\x09\xa0\xff"[: len(frame.buffer)]
    packet = np.zeros(STRIDE, np.uint8)
    packet[: 8 + len(frame.buffer)] = np.frombuffer(slcan.HEAD.pack(can_id, 3) + frame.buffer, np.uint8)
    size = put_line(packet, can_id, 3, line)
    assert line[:size].tobytes() == f"{frame.head}{frame.buffer.hex().upper()}\r".encode()
