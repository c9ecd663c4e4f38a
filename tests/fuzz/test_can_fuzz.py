"""A short run of the CAN fuzzer in every test; `make fuzz` runs ten million inputs per decoder."""

import random

import pytest
from can_fuzzer import decoders, run

from hw.can import moteus


@pytest.mark.parametrize("name", decoders())
def test_no_bytes_make_a_decoder_raise(name):
    run(name, 3000, random.Random(7))


def test_the_fuzzer_notices_a_decoder_that_raises(monkeypatch):
    monkeypatch.setattr(moteus, "parse_reply", lambda data: {}[data[0]])
    with pytest.raises(KeyError):
        run("moteus", 3000, random.Random(7))
