"""200,000 random replies of each maker's devices: read as the maker's own library reads them, and nothing
else of them.

`makers/readings.json` holds digests of what the libraries read (`makers/make_readings.py`); makers/README.md
says which.
"""

import json
from pathlib import Path

import makers_read
import pytest
from makers import random_frames
from makers.readings import NOTHING, digest

MADE = json.loads((Path(__file__).parent / "makers" / "readings.json").read_text())
SAMPLES = random_frames.CHUNK // 10
"""Fewest frames of a chunk that are samples: a test of damage only would pass with a reader that reads
nothing."""


def compare(name, chunks):
    make, kind = makers_read.READERS[name]
    read = make()
    for k in chunks:
        readings = [read(frame) for frame in random_frames.chunk(kind, k)]
        assert digest(readings) == MADE["readings"][name]["digests"][k], f"chunk {k} of {name}"
        assert sum(one != NOTHING for one in readings) > SAMPLES


@pytest.mark.parametrize("name", MADE["readings"])
def test_a_thousand_random_replies_are_read_as_the_makers_library_reads_them(name):
    compare(name, range(1))


@pytest.mark.volume
@pytest.mark.parametrize("name", MADE["readings"])
def test_all_random_replies_are_read_as_the_makers_library_reads_them(name):
    assert random_frames.CHUNKS * random_frames.CHUNK >= 200_000
    compare(name, range(random_frames.CHUNKS))


@pytest.mark.parametrize("name", MADE["readings"])
def test_a_reader_that_takes_one_frame_more_is_noticed(name, monkeypatch):
    make, kind = makers_read.READERS[name]
    once = []

    def _lenient():
        read = make()

        def _read(frame):
            found = read(frame)
            if found == NOTHING and not once:
                once.append(frame)
                return b"a sample"
            return found

        return _read

    monkeypatch.setitem(makers_read.READERS, name, (_lenient, kind))
    with pytest.raises(AssertionError, match="chunk 0"):
        compare(name, range(1))
