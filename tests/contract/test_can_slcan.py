"""slcan adapters behind ptys: our reader and python-can's, the same frames, garbage, hang-ups."""

import os
import pty
import random
import select
import threading
import tty

import can
import pytest
from hardware import rig
from patience import until
from slcan_wire import SlcanWire

from hw import registry
from hw.can import slcan
from hw.can.bus import EXTENDED, REMOTE, wait_for
from hw.can.open_bus import open_bus
from hw.can.options import BusOptions, OdriveOptions
from hw.interface import BackendError, LinkLost
from hw.simulators.can_device import TORQUE_CONSTANT_NM_A, DriveSim, make_drives
from hw.simulators.can_plant import Inertia
from rtctl.control.jit import records
from rtctl.tick import new_ticks


@pytest.fixture
def wire():
    made = SlcanWire()
    yield made
    made.close()


def options(wire, **more):
    arguments = {"sleep_after_open": 0.0}
    return BusOptions(interface="slcan", channel=wire.ports[0], arguments=arguments, **more).model_dump()


def peer(wire):
    return can.Bus(
        interface="slcan",
        channel=wire.ports[1],
        bitrate=1_000_000,
        sleep_after_open=0,
        timeout=0.0,
        ignore_config=True,
    )


@pytest.mark.parametrize(
    ("line", "frame"),
    [
        (b"t1232ABCD", (0x123, b"\xab\xcd")),
        (b"t7FF0", (0x7FF, b"")),
        (b"T1ABCDEF01FF", (0x1ABCDEF0 | EXTENDED, b"\xff")),
        (b"r1238", (0x123 | REMOTE, b"")),
        (b"t1231AB00FF", (0x123, b"\xab")),  # with a time stamp
        (b"t1232abcd", (0x123, b"\xab\xcd")),
    ],
)
def test_lines_are_frames(line, frame):
    assert slcan.parse(line) == frame


@pytest.mark.parametrize(
    "line",
    [b"", b"t", b"t123", b"t1239", b"t1232AB", b"t1232ABCDE", b"t8000", b"tXYZ0", b"t12_1AA", b"t+121AA",
        b"t0x11AA", b"T0X1ABCDE1AA", b"x1230", b"t1232AB D", b"t123\xb20", b"T20000000" + b"0"],
)  # fmt: skip
def test_anything_else_is_none(line):
    assert slcan.parse(line) is None


def test_no_bytes_make_the_parser_raise_or_invent_a_frame():
    rng, alphabet = random.Random(5), b"tTrRzZ0123456789abcdefABCDEFxX_ +\x07\xff"
    for _ in range(30_000):
        line = bytes(rng.choice(alphabet) for _ in range(rng.randint(0, 30)))
        found = slcan.parse(line)
        if found is not None:
            letter = "R" if found[0] & REMOTE else "T"
            assert line[:1].decode().upper() == letter
            assert len(found[1]) <= 8


@pytest.mark.parametrize("raw", [True, False], ids=["ours", "python-can's"])
def test_frames_go_both_ways_and_only_those_asked_for_arrive(wire, raw):
    bus, seen = open_bus(options(wire, raw=raw)), []
    bus.subscribe(
        {0x101: lambda buffer, offset, length: seen.append(bytes(buffer[offset : offset + length]))}
    )
    with peer(wire) as other:
        for k in range(20):
            other.send(can.Message(arbitration_id=0x101, data=[k, 1], is_extended_id=False))
            other.send(can.Message(arbitration_id=0x102, data=[k, 2], is_extended_id=False))
        assert wait_for(bus, lambda: len(seen) == 20, 5.0)
        assert seen == [bytes([k, 1]) for k in range(20)]
        out = bus.outgoing(0x55 | EXTENDED, 3)
        out.buffer[out.offset : out.offset + 3] = b"abc"
        assert bus.send(out)
        heard = other.recv(2.0)
        while heard is None or heard.arbitration_id != 0x55:
            heard = other.recv(2.0)
        assert (bytes(heard.data), heard.is_extended_id) == (b"abc", True)
        bus.close()


def test_garbage_is_counted_and_the_frames_around_it_arrive(wire):
    bus, seen = open_bus(options(wire)), []
    bus.subscribe(
        {0x101: lambda buffer, offset, length: seen.append(bytes(buffer[offset : offset + length]))}
    )
    wire.say(0, b"t10112")
    wire.say(0, b"2\rt101z\r\xff\xfe\rt1011ZZ\r" + b"x" * 100 + b"\rt101133\r")
    assert wait_for(bus, lambda: len(seen) == 2, 2.0)
    assert seen == [b"\x22", b"\x33"]
    assert bus.health.counts["damaged"] >= 4
    bus.close()


def test_a_hang_up_is_a_lost_link_and_stays_one(wire):
    bus = open_bus(options(wire))
    bus.subscribe({})
    out = bus.outgoing(1, 0)
    wire.unplug(0)
    with pytest.raises(LinkLost):
        wait_for(bus, lambda: False, 5.0)
    with pytest.raises(LinkLost):
        bus.receive()
    with pytest.raises(LinkLost):
        bus.send(out)
    bus.close()


def test_a_bit_rate_the_protocol_has_not_is_named(wire):
    with pytest.raises(BackendError, match="bitrate 83000 is none of"):
        open_bus(options(wire, bitrate=83_000))
    with pytest.raises(BackendError, match="refused 'S7'"):
        open_bus(options(wire, bitrate=800_000))


def answers(backend):
    """Whether it opens; on a busy machine a drive may be silent for longer than a real one is."""
    try:
        backend.open()
    except BackendError as error:
        if not any(words in str(error) for words in ("within", "No SDO response")):
            raise
        return False
    return True


@pytest.mark.parametrize("kind", ["odrive", "cia402", "can"])
@pytest.mark.parametrize("raw", [True, False], ids=["ours", "python-can's"])
def test_drives_work_over_slcan(wire, kind, raw):
    import can_rows

    tables = {"odrive": can_rows.odrive_request, "cia402": can_rows.cia402, "can": can_rows.board}
    given = {**tables[kind](1, None), "bus": options(wire, raw=raw)}
    valid = registry.options_model(kind).model_validate(given).model_dump(mode="json")
    backend = registry.create(kind, valid, rig())
    with peer(wire) as bus:
        sim_kind = "odrive-request" if kind == "odrive" else kind
        sim = DriveSim(bus, make_drives(sim_kind, [1]), Inertia(1, TORQUE_CONSTANT_NM_A))
        sim.start()
        try:
            until(lambda: answers(backend))
            tick = records(new_ticks(1, 1))

            def cycle():
                backend.read(tick)
                backend.write(tick)
                tick["tick"] += 1
                return tick["sample_count"][0] >= 30

            until(cycle, "thirty samples")
            backend.close()
        finally:
            sim.stop()


def filled(bus):
    """Send until nothing more fits, not even after the kernel has moved what waits."""
    frame, refused = bus.outgoing(0x123, 7), 0
    while refused < 50:
        refused = 0 if bus.send(frame) else refused + 1
        select.select([], [], [], 1e-3 if refused else 0)


def frozen_adapter():
    """An ODrive behind an adapter that has frozen after `open`: nobody reads its line, which is full."""
    near, far = pty.openpty()
    tty.setraw(near)
    tty.setraw(far)
    given = BusOptions(interface="slcan", channel=os.ttyname(far)).model_dump()
    valid = OdriveOptions(bus=given, axis=[{"node": 1}]).model_dump(mode="json")
    backend = registry.create("odrive", valid, rig())
    backend.bus = open_bus(given)
    backend.drives[0].make_frames(backend.bus)
    filled(backend.bus)
    return backend, near, far


def test_a_line_that_nobody_reads_holds_up_neither_stop_nor_close():
    backend, near, far = frozen_adapter()
    backend.bus.discard = lambda: None  # as on a driver that cannot throw anything away
    health, before = backend.bus.health, backend.bus.health.counts["tx_refused"]
    ending = threading.Thread(target=lambda: (backend.stop(), backend.close()), daemon=True)
    ending.start()
    ending.join(60)
    assert not ending.is_alive()
    assert health.counts["tx_refused"] >= before + 4  # torque and state, by `stop` and by `close`
    os.close(near)
    os.close(far)


def test_a_stop_on_a_full_line_comes_before_what_was_queued():
    backend, near, far = frozen_adapter()
    backend.stop()
    stop, seen = [(1 << 5 | 0x0E, bytes(4)), (1 << 5 | 0x07, b"\x01\0\0\0")], b""

    def lines():
        """All that has come; the kernel moves it to this end a little later."""
        nonlocal seen
        seen += os.read(near, 4096) if select.select([near], [], [], 0.2)[0] else b""
        return [found for line in seen.split(b"\r") if (found := slcan.parse(line))]

    until(lambda: lines()[-2:] == stop, "the stop, and nothing after it")
    assert not select.select([near], [], [], 0.2)[0]
    backend.close()
    os.close(near)
    os.close(far)
