"""One table of channels: what is said of each elsewhere follows from it, for a channel that is not there yet,
too.
"""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from hw import channels
from hw.channels import QUANTITIES, READINGS
from hw.fault_kinds import KINDS, Channel
from hw.interface import CHANNEL_FIELDS
from hw.simulators.mock_options import MockOptions
from rtctl.tick import FIELD, FIELDS

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("column", ["name", "field", "rank", "number"])
def test_no_two_channels_share_what_tells_them_apart(column):
    values = [getattr(reading, column) for reading in READINGS]
    assert len(set(values)) == len(values)


def test_every_channel_is_a_field_of_the_tick_that_devices_write():
    written = [field.name for field in FIELDS if field.writer == "backend"]
    assert written == ["sample_count", "link_faults", *(reading.field for reading in READINGS)]
    assert set(CHANNEL_FIELDS.values()) <= set(FIELD)


def test_every_quantity_can_be_read_wrongly_by_a_script():
    known = {channel for channel, _ in KINDS}
    assert {reading.name for reading in QUANTITIES} <= known
    assert len({int(channel) for channel in Channel}) == len(Channel.__members__)


NEW = """
from hw import channels
source = open(channels.__file__).read()
row = 'Reading("novelty", "novelty_v", "axis", "V", "", oldest_s=1.0, rank=99, number=99, optional=True),'
before = ')\\n\"\"\"In the order of the tick.\"\"\"'
assert before in source
exec(compile(source.replace(before, row + before), channels.__file__, "exec"), vars(channels))

import numpy as np
from hw import rig
from hw.can.sample import Sample
from hw.fault_options import FaultOptions
from hw.fault_script import SampleScript
from hw.interface import Rig
from rtctl.rig_file.devices import MAX_AGE_S
from rtctl.tick import FIELD, json_schema, new_ticks

assert MAX_AGE_S["novelty"] == 1.0
assert rig.READ_ORDER[-1] == "novelty"
assert FIELD["novelty_v"].shape == "axis" and "novelty_v" in json_schema(2)["required"]
assert len(Sample(3).of["novelty"]) == 3

ones = np.ones(2)
hardware = Rig(2, 1e-3, ones, ones, ones, 1000.0 * ones, np.zeros((2, 3)))
faults = [
    dict(channel="novelty", kind="frozen", at_tick=2, for_ticks=1, axis=1),
    dict(channel="link", kind="drop", at_tick=4, for_ticks=1),
    dict(channel="novelty", kind="offset", at_tick=6, for_ticks=1, value=0.5),
    dict(channel="novelty", kind="out_of_range", at_tick=7, for_ticks=1, axis=0),
    dict(channel="novelty", kind="nan", at_tick=8, for_ticks=1, axis=0),
]
tick = new_ticks(1, 2)
script = SampleScript([FaultOptions(**fault).model_dump() for fault in faults], hardware, 1)
script.bind(tick)
for k in range(9):
    tick["tick"], tick["sample_count"], tick["novelty_v"] = k, k, [24.0 + k, 48.0 + k]
    script.after_read()
    print(*tick["novelty_v"][0], int(tick["sample_count"][0]))
"""

SHOWN = [
    [24, 48, 0],
    [25, 49, 1],
    [26, 49, 2],  # the second axis frozen
    [27, 51, 3],
    [27, 51, 3],  # nothing arrives
    [29, 53, 5],
    [30.5, 54.5, 6],
    [1e6, 55, 7],
    [math.nan, 56, 8],
]


def test_a_row_is_all_that_a_new_channel_needs():
    env = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-c", NEW]
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=250, check=False)
    assert done.returncode == 0, done.stderr
    told = [[float(word) for word in line.split()] for line in done.stdout.splitlines()]
    np.testing.assert_array_equal(told, SHOWN)


def test_the_mock_refuses_faults_of_a_channel_that_it_has_not(monkeypatch):
    novelty = channels.Reading("novelty", "novelty_v", "axis", "V", "", 1.0, 99, 99)
    monkeypatch.setitem(channels.READING, "novelty", novelty)
    monkeypatch.setitem(KINDS, ("novelty", "nan"), KINDS["position", "nan"])
    fault = {"channel": "novelty", "kind": "nan", "at_tick": 0, "for_ticks": 1}
    with pytest.raises(ValidationError, match="the mock rig has no sensor of 'novelty'"):
        MockOptions.model_validate({"faults": [fault]})
