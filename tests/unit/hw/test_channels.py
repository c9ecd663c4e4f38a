"""One table of channels: what is said of each elsewhere follows from it, for a channel that is not there yet, too."""

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
from hw.mock.options import MockOptions
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


NEW = '''
import sys
import numpy as np
from hw import channels
from hw.channels import READINGS, Reading
source = open(channels.__file__).read()
row = 'Reading("supply", "supply_v", "axis", "V", "voltage", oldest_s=1.0, rank=7, number=11, optional=True),'
source = source.replace(')\\n"""In the order of the tick."""', f"    {row}\\n)", 1)
assert row in source
exec(compile(source, channels.__file__, "exec"), vars(channels))

from hw.fault_options import FaultOptions
from hw.fault_script import SampleScript
from hw.interface import Rig
from hw.can.sample import Sample
from hw import rig
from rtctl.config_devices import MAX_AGE_S
from rtctl.tick import FIELD, json_schema, new_ticks

assert MAX_AGE_S["supply"] == 1.0
assert rig.READ_ORDER[-1] == "supply"
assert FIELD["supply_v"].shape == "axis" and "supply_v" in json_schema(2)["required"]
assert len(Sample(3).of["supply"]) == 3

ones = np.ones(2)
hardware = Rig(2, 1e-3, ones, ones, ones, 1000.0 * ones, np.zeros((2, 3)))
faults = [
    dict(channel="supply", kind="frozen", at_tick=2, for_ticks=1, axis=1),
    dict(channel="link", kind="drop", at_tick=4, for_ticks=1),
]
tick = new_ticks(1, 2)
script = SampleScript([FaultOptions(**fault).model_dump() for fault in faults], hardware, 1)
script.bind(tick)
for k in range(6):
    tick["tick"], tick["sample_count"], tick["supply_v"] = k, k, [24.0 + k, 48.0 + k]
    script.after_read()
    print(*tick["supply_v"][0], int(tick["sample_count"][0]))
'''


def test_a_row_is_all_that_a_new_channel_needs():
    env = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-c", NEW]
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=250, check=False)
    assert done.returncode == 0, done.stderr
    told = np.array([[float(word) for word in line.split()] for line in done.stdout.splitlines()])
    # held by the second axis at tick 2; all of it dropped at tick 4
    assert told.tolist() == [[24, 48, 0], [25, 49, 1], [26, 49, 2], [27, 51, 3], [27, 51, 3], [29, 53, 5]]


def test_the_mock_refuses_faults_of_a_channel_that_it_has_not(monkeypatch):
    supply = channels.Reading("supply", "supply_v", "axis", "V", "", 1.0, 7, 11)
    monkeypatch.setitem(channels.READING, "supply", supply)
    monkeypatch.setitem(KINDS, ("supply", "nan"), KINDS["position", "nan"])
    fault = {"channel": "supply", "kind": "nan", "at_tick": 0, "for_ticks": 1}
    with pytest.raises(ValidationError, match="the mock rig has no sensor of 'supply'"):
        MockOptions.model_validate({"faults": [fault]})
