"""What a test pulse measured becomes an event and a file when ARMING ends, passed or refused."""

import math

import numpy as np
import pytest

from rtctl.cli.events import line
from rtctl.control.vocabulary import State
from rtctl.host.exchange.events import EventDetector
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.host.exchange.timing_watch import TimingWatch
from rtctl.host.flight_recorder import FlightRecorder
from rtctl.rig_file import measured_timing as timing
from rtctl.tick import new_ticks

RIG = RigDescription(
    name="r", axes=(AxisDescription("a", {}), AxisDescription("b", {})), rate_hz=500.0, devices_sha256="d"
)


def rows(states, ages=None, delay=(1.5, math.nan)):
    ticks = new_ticks(len(states), 2)
    ticks["state"], ticks["tick"] = states, np.arange(len(states))
    ticks["sample_age_ticks"] = 0 if ages is None else ages
    for name, value in {
        "delay_ticks": delay,
        "lag_ticks": (0.5, math.nan),
        "gain": (1.1, math.nan),
        "offset_nm": (-0.02, math.nan),
    }.items():
        ticks[f"arming_{name}"] = value
    return ticks


IDLE, ARMING, ACTIVE, STOPPING = (
    int(state) for state in (State.IDLE, State.ARMING, State.ACTIVE, State.STOPPING)
)


@pytest.mark.parametrize("after", [ACTIVE, STOPPING])
def test_an_arming_that_ends_is_told_once_in_the_tick_it_ends(after):
    watch = TimingWatch(RIG)
    ((row, found),) = watch.changes(rows([IDLE, ARMING, ARMING, after, after]))
    assert row == 3
    assert found == {
        "axis": "a", "motion": "rotary", "delay_s": 3e-3, "lag_s": 1e-3, "gain": 1.1, "offset_nm": -0.02,
        "sample_period_s": pytest.approx(2e-3),
    }  # fmt: skip
    assert watch.changes(rows([after])) == []


def test_batches_may_part_it_and_nothing_measured_is_nothing_told():
    watch = TimingWatch(RIG)
    assert watch.changes(rows([IDLE, ARMING])) == []
    assert len(watch.changes(rows([ACTIVE]))) == 1
    assert TimingWatch(RIG).changes(rows([ARMING, ACTIVE], delay=(math.nan, math.nan))) == []


def test_the_period_of_samples_leaves_out_the_times_without_a_device():
    watch = TimingWatch(RIG)
    watch.changes(rows([IDLE] * 6, [0, 1, 0, 1, 0, 1]))
    watch.changes(rows([IDLE] * 5, [3, 4, 5, 6, 7]))
    ((_, found),) = watch.changes(rows([ARMING, ACTIVE], [0, 1]))
    assert found["sample_period_s"] == pytest.approx(4e-3)


def test_the_event_is_readable_and_comes_after_the_change_of_state():
    events = EventDetector(RIG).detect(rows([IDLE, ARMING, ACTIVE]))
    assert [event["event"] for event in events] == ["state", "state", "state", "measured"]
    text = line(events[-1])
    assert (
        "axis a: torque at least 3 ms late (lag 1), current 1.1 of what was sent, -0.02 N m off; a sample "
        "every 2 ms" in text
    )


def test_the_flight_recorder_keeps_the_file_beside_the_log(tmp_path):
    recorder = FlightRecorder(tmp_path, RIG)
    recorder.observe(rows([IDLE, ARMING, STOPPING]))
    recorder.close()
    kept = timing.read(tmp_path, "d")
    assert list(kept) == ["a"]
    assert (kept["a"].delay_s, kept["a"].gain) == (3e-3, 1.1)
    assert kept["a"].date.startswith("20")


def test_a_number_that_could_not_be_read_again_is_not_kept(tmp_path):
    recorder = FlightRecorder(tmp_path, RIG)
    recorder.observe(rows([IDLE, ARMING, STOPPING], delay=(1e9, math.nan)))
    recorder.close()
    assert timing.read(tmp_path, "d") == {}
