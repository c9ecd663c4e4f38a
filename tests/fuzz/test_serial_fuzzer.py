"""The serial fuzzer, short; and that it finds what it is there to find."""

import numpy as np
import pytest
import serial_fuzzer

from hw.serial import checksums


@pytest.mark.parametrize("name", checksums.KINDS)
def test_the_second_algorithm_agrees_with_the_one_that_is_held_to_the_catalogue(name):
    kind, data = checksums.KINDS[name], np.random.default_rng(1).integers(0, 256, 300, np.uint8)
    for stop in (1, 9, 300):
        assert serial_fuzzer.slow_checksum(kind, data, 0, stop) == checksums.checksum(kind, data, 0, stop)


def test_nothing_wrong_gets_through_the_packet_decoder():
    counts = serial_fuzzer.run_packets(200_000, 1)
    assert counts["let_through"] > 10_000, "the mutations must leave some packets whole"
    assert (counts["wrong_checksum"], counts["not_canonical"]) == (0, 0)


@pytest.mark.parametrize("name", ["sum8", "crc16-ccitt", "crc32"])
def test_nothing_wrong_gets_through_a_described_decoder(name):
    counts = serial_fuzzer.run_frames(100_000, 1, name)
    assert counts["let_through"] > 5_000
    assert (counts["wrong_checksum"], counts["not_finite"]) == (0, 0)


def test_a_decoder_that_lets_damage_through_is_reported():
    good = {"let_through": 5, "wrong_checksum": 0, "not_canonical": 0}
    assert serial_fuzzer.failures({"a": good, "b": {**good, "wrong_checksum": 1}}) == ["b"]
