"""A short run of the CAN fuzzer in every test; `make fuzz` runs ten million inputs per decoder."""

import random

import pytest
from can_fuzzer import decoders, run

from hw.can import fields, moteus, slcan


@pytest.mark.parametrize("name", decoders())
@pytest.mark.parametrize("count", [3000, pytest.param(200_000, marks=pytest.mark.volume)])
def test_no_bytes_make_a_decoder_raise_and_good_ones_are_taken(name, count):
    taken = run(name, count, random.Random(7))
    assert (taken > count / 15) == (name != "health")


def test_the_fuzzer_notices_a_decoder_that_raises(monkeypatch):
    monkeypatch.setattr(moteus, "parse_reply", lambda data: {}[data[0]])
    with pytest.raises(KeyError):
        run("moteus", 3000, random.Random(7))


def test_the_fuzzer_notices_a_checksum_that_is_wrong(monkeypatch):
    monkeypatch.setitem(fields.CHECKSUMS, "crc8_autosar", fields.CHECKSUMS["crc8_j1850"])
    with pytest.raises(AssertionError, match="wrong checksum"):
        run("board crc8_autosar", 3000, random.Random(7))


def test_the_fuzzer_notices_a_line_that_is_no_frame(monkeypatch):
    monkeypatch.setattr(slcan, "parse", lambda line, parse=slcan.parse: parse(line.replace(b"x", b"0")))
    with pytest.raises(AssertionError):
        run("slcan", 10_000, random.Random(7))
