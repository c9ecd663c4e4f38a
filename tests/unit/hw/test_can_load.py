"""Bits on the wire: the published worst cases, and real stuffing never above them."""

import random

import pytest

from hw.can import load
from hw.can.board_options import BoardOptions
from hw.can.load import Traffic
from hw.can.options import Cia402Options, MoteusOptions, OdriveOptions

BUS = {"channel": "can0"}


@pytest.mark.parametrize(
    ("length", "extended", "bits"), [(8, False, 135), (8, True, 160), (0, False, 55), (0, True, 80)]
)
def test_the_published_worst_cases(length, extended, bits):
    assert load.classic_bits(length, extended=extended) == bits


def test_an_unstuffed_frame_of_8_bytes_has_111_bits():
    assert load.classic_bits(8, stuffed=False) == 111


def _crc15(bits):
    crc = 0
    for bit in bits:
        crc = crc << 1 ^ (0x4599 if (crc >> 14 & 1) ^ bit else 0)
        crc &= 0x7FFF
    return [crc >> k & 1 for k in range(14, -1, -1)]


def _stuffed(bits):
    out, run, last = 0, 0, None
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        out += 1
        if run == 5:
            out, last, run = out + 1, 1 - bit, 1
    return out


def _wire_bits(identifier, data):
    """Bits of a real standard frame with its pause."""
    head = [0, *(identifier >> k & 1 for k in range(10, -1, -1)), 0, 0, 0]
    body = [
        *(len(data) >> k & 1 for k in range(3, -1, -1)),
        *(byte >> k & 1 for byte in data for k in range(7, -1, -1)),
    ]
    bits = head + body
    return _stuffed(bits + _crc15(bits)) + 13


def test_no_real_frame_is_longer_than_the_worst_case():
    rng = random.Random(3)
    for _ in range(2000):
        data = bytes(
            rng.choice((0, 0xFF, 0x0F, 0x1F, 0xC1, rng.randrange(256))) for _ in range(rng.randint(0, 8))
        )
        bits = _wire_bits(rng.randrange(0x800), data)
        assert load.classic_bits(len(data), stuffed=False) <= bits <= load.classic_bits(len(data))


def test_fd_lengths_round_up():
    assert [load.fd_length(n) for n in (0, 8, 9, 33, 64)] == [0, 8, 12, 48, 64]
    nominal, data = load.fd_bits(48)
    assert nominal == 17 + 4 + 12
    assert data == 389 + 97 + 25 + 7 + 1


def test_a_faster_data_phase_shortens_only_the_data():
    frame = Traffic("x", 48, 1000.0, fd=True)
    slow, fast = load.frame_s(frame, 1_000_000, 1_000_000), load.frame_s(frame, 1_000_000, 5_000_000)
    nominal, data = load.fd_bits(48)
    assert slow == pytest.approx((nominal + data) / 1e6)
    assert fast == pytest.approx((nominal + data / 5) / 1e6)


def test_two_odrives_at_1_khz_fit_and_three_do_not():
    def options(n):
        return {"bus": BUS, "axis": [{"node": k} for k in range(n)], "heartbeat_ms": 20.0}

    valid = OdriveOptions.model_validate(options(2), context={"rate_hz": 1000.0, "n_axes": 2})
    assert valid.load(1000.0).share == pytest.approx(0.75, abs=0.02)
    with pytest.raises(
        ValueError, match=r"112 % of the bus at 1 Mbit/s, at most 90 %.*lower \[loop\] rate_hz"
    ):
        OdriveOptions.model_validate(options(3), context={"rate_hz": 1000.0, "n_axes": 3})


@pytest.mark.parametrize(
    ("model", "options"),
    [
        (MoteusOptions, {"bus": {**BUS, "fd": True}, "axis": [{"node": 1}]}),
        (Cia402Options, {"bus": BUS, "axis": [{"node": 1}]}),
        (
            BoardOptions,
            {
                "bus": BUS,
                "receive": [
                    {"id": 1, "field": [{"channel": "position", "start_bit": 0, "bits": 16, "unit": "count"}]}
                ],
                "send": [
                    {
                        "id": 2,
                        "field": [
                            {"channel": "torque", "start_bit": 0, "bits": 16, "type": "int", "unit": "mNm"}
                        ],
                    }
                ],
            },
        ),
    ],
)
def test_every_kind_is_refused_at_a_rate_its_bus_cannot_carry(model, options):
    assert model.model_validate(options, context={"rate_hz": 1000.0}).report(1000.0)
    with pytest.raises(ValueError, match=r"% of the bus"):
        model.model_validate(options, context={"rate_hz": 10_000.0})


def test_a_life_longer_than_ten_periods_is_refused():
    options = {"bus": {**BUS, "fd": True}, "axis": [{"node": 1}], "time_to_live_ms": 50.0}
    with pytest.raises(ValueError, match=r"time_to_live_ms 50 must be at most 10: 10 periods"):
        MoteusOptions.model_validate(options, context={"rate_hz": 1000.0})


def test_a_life_shorter_than_two_periods_is_refused():
    options = {"bus": {**BUS, "fd": True}, "axis": [{"node": 1}]}
    with pytest.raises(ValueError, match=r"time_to_live_ms 10 must be at least 20, 2 periods"):
        MoteusOptions.model_validate(options, context={"rate_hz": 100.0})
    assert MoteusOptions.model_validate(options, context={"rate_hz": 200.0})
