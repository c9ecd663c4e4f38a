"""Lines of text, bent and cut, into the backend of boards that print; and that the fuzzer finds what it is
there to find.
"""

import random

import lines_fuzzer
import pytest

from hw.serial import lines_codec


@pytest.mark.parametrize("kind", lines_fuzzer.KINDS)
@pytest.mark.parametrize("count", [1000, pytest.param(100_000, marks=pytest.mark.volume)])
def test_no_line_raises_and_only_whole_ones_are_samples(kind, count):
    assert lines_fuzzer.run(kind, count, random.Random(7)) > count / 4


def test_the_fuzzer_finds_a_checksum_that_is_not_looked_at(monkeypatch):
    monkeypatch.setattr(lines_codec, "nmea", lambda text: 0)
    with pytest.raises(AssertionError):
        lines_fuzzer.run("nmea", 1000, random.Random(7))


def test_the_fuzzer_finds_a_number_that_is_none(monkeypatch):
    real = lines_codec._number

    def _lenient(cell, decimals, *, whole):
        return float("nan") if cell == b"nan" else real(cell, decimals, whole=whole)

    monkeypatch.setattr(lines_codec, "_number", _lenient)
    monkeypatch.setattr("hw.serial.lines_sample.math", type("Finite", (), {"isfinite": lambda value: True}))
    with pytest.raises(AssertionError):
        lines_fuzzer.run("none", 1000, random.Random(7))
