"""A board that drops commands which are not newer than the one before obeys a stop, whatever it saw last."""

import pytest
from board_frames import SENT, opened
from described_wire import OPTIONS, Wire

from hw.stop_sequence import stop_numbers


def newer(numbers, last, span):
    """Numbers that such a board takes, in their order."""
    taken = []
    for number in numbers:
        if 0 < (number - last) % span < span / 2:
            last = number
            taken.append(number)
    return taken


@pytest.mark.parametrize("bits", [2, 4, 8, 16])
def test_from_any_number_one_is_newer_and_a_new_count_is_newer_than_the_last(bits):
    span = 1 << bits
    numbers = stop_numbers(span)
    for last in range(0, span, max(1, span // 256)):
        taken = newer(numbers, last, span)
        assert taken, last
        assert newer([0], taken[-1], span), "a daemon that begins to count is heard"
        assert len(newer(numbers * 2, last, span)) >= 5


@pytest.mark.parametrize("last", [0, 1, 100, 20_000, 32_768, 50_000, 65_535])
def test_the_default_stop_of_a_described_board_is_newer_and_commands_after_it_are(monkeypatch, last):
    command, sent = OPTIONS["command"], []
    size = command["length"]
    field = next(field for field in command["field"] if field["channel"] == "sequence")
    assert field["type"] == "u16"
    wire, span = Wire(), 1 << 16

    def count(frame):
        return int.from_bytes(frame[field["offset"] :][:2], "little")

    monkeypatch.setattr("hw.serial.backend.send_once", lambda _path, _baud, packet: sent.append(packet))
    wire.backend.stop()  # makes it, as opening does
    wire.backend.link["command_sequence"] = last
    wire.backend.stop()
    frames = [sent[0][k : k + size] for k in range(0, len(sent[0]), size)]
    assert all(frame[4:8] == bytes(4) for frame in frames), "disabled, no current"
    taken = newer([count(frame) for frame in frames], last, span)
    assert len(taken) >= 5
    assert newer([count(wire.sent())], taken[-1], span), "it is not deaf to the daemon afterwards"


@pytest.mark.parametrize("last", range(0, 16, 3))
def test_a_stop_of_a_can_board_is_newer_from_a_process_that_never_heard_its_count(monkeypatch, last):
    fields = [{**field, "bits": 4} if field["channel"] == "counter" else field for field in SENT["field"]]
    backend, bus, tick = opened(monkeypatch, send=[{**SENT, "field": fields}])
    del bus.sent[:]
    backend.stop()
    assert all(frame[:5] == bytes(5) for frame in bus.sent)
    taken = newer([frame[5] & 15 for frame in bus.sent], last, 16)
    assert taken
    del bus.sent[:]
    backend.write(tick)
    assert newer([bus.sent[0][5] & 15], taken[-1], 16)


@pytest.mark.parametrize("more", [{}, {"idle": [0] * 8}], ids=["zeros", "idle"])
def test_a_can_board_that_heard_no_stop_obeys_the_commands_after_a_re_plug(monkeypatch, more):
    fields = [{**field, "bits": 8} if field["channel"] == "counter" else field for field in SENT["field"]]
    backend, bus, tick = opened(monkeypatch, send=[{**SENT, **more, "field": fields}])
    tick["enabled"] = 1
    for last in range(0, 256, 15):
        while bus.sent[-1][5] != last or not bus.sent[-1][4]:
            backend.write(tick)
        backend.stop()  # what the loop does at a loss: nobody hears it
        backend.close()
        del bus.sent[:]
        backend.open()
        at_open = newer([frame[5] for frame in bus.sent if not more], last, 256)
        assert at_open or more
        del bus.sent[:]
        backend.write(tick)
        assert newer([bus.sent[0][5]], (at_open or [last])[-1], 256)
