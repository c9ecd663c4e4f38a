"""What a core's clock did and how often its firmware took it, from recorded files and a counter that the test
fills.
"""

import math
import os
import struct

import pytest

from rtctl.host.exchange.late_core import Interruptions
from rtctl.host.exchange.late_counters import Counters, Reading, rise
from rtctl.host.exchange.late_ticks import LateTick
from rtctl.host.exchange.late_verdict import judge

MS = 1_000_000
LATE = LateTick(tick=7, woke_ns=0, late_ns=400_000, own_ns=0, phase="read")


def clocked(root, *, khz, changes, latency="500000", too_hot=0):
    """The /sys of a core 1 whose clock changes, as a laptop shows it."""
    for name, text in {
        "cpufreq/scaling_cur_freq": f"{khz}\n",
        "cpufreq/stats/total_trans": f"{changes}\n",
        "cpufreq/cpuinfo_transition_latency": f"{latency}\n",
        "thermal_throttle/core_throttle_count": f"{too_hot}\n",
    }.items():
        file = root / "sys/devices/system/cpu/cpu1" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)


def looked_twice(root, before, after):
    """What rose on the loop's core from one state of its clock to another."""
    counters = Counters(12, 1, root)
    clocked(root, **before)
    first = counters.look(0)
    clocked(root, **after)
    kept, second = counters.look(MS, late=False), counters.look(2 * MS)
    counters.close()
    assert kept.clock == first.clock, "the core is not asked while nothing is late"
    return rise(first, second, {})


def test_a_clock_that_was_slowed_down_by_heat_is_told(tmp_path):
    before = {"khz": 4_200_000, "changes": 90}
    found = looked_twice(tmp_path, before, {"khz": 1_400_000, "changes": 92, "too_hot": 1})
    assert found.slower == pytest.approx(2 / 3)
    assert (found.clock_change_ns, found.too_hot) == (1e6, True)
    assert judge(LATE, found, LATE.late_ns).text == "frequency change (heat)"


def test_how_long_a_change_takes_may_be_unknown(tmp_path):
    before = {"khz": 4_200_000, "changes": 90, "latency": "4294967295"}
    found = looked_twice(tmp_path, before, {**before, "changes": 95})
    assert math.isnan(found.clock_change_ns)
    assert (found.slower, found.too_hot) == (0, False)
    assert judge(LATE, found, LATE.late_ns).cause == "unknown"


def test_interruptions_by_the_firmware_are_counted_of_the_loops_core(tmp_path):
    folder = tmp_path / "sys/bus/event_source/devices/msr"
    (folder / "events").mkdir(parents=True)
    (folder / "type").write_text("9\n")
    (folder / "events/smi").write_text("event=0x04\n")
    asked = []

    def opened(attributes, core):
        asked.append((*struct.unpack_from("<IIQ", attributes), len(attributes), core))
        read, write = os.pipe()
        os.write(write, struct.pack("<QQ", 41, 43))
        os.close(write)
        return read

    smis = Interruptions(1, tmp_path, opened)
    assert asked == [(9, 128, 4, 128, 1)]
    assert [smis.count(), smis.count()] == [41, 43]
    assert math.isnan(smis.count()), "no more is told"
    smis.close()
    found = rise(Reading(0, smis=41), Reading(MS, smis=43), {})
    assert judge(LATE, found, LATE.late_ns).text == "SMI"


def test_where_nobody_counts_them_there_are_none(tmp_path):
    smis = Interruptions(0, tmp_path)
    assert math.isnan(smis.count())
    smis.close()
