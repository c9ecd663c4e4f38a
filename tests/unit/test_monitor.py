from types import SimpleNamespace

import pytest
from test_client import RIG, rows

from rtctl.cli import monitor
from rtctl.client.samples import rig_state
from rtctl.errors import NoReplyError
from rtctl.host.samples import state_samples

HELLO = {"rig": "mock", "rate_hz": 1000.0, "version": "0", "axes": [{"name": "base"}, {"name": "tip"}]}
LATENCY = {"p50": 3.0, "p99": 40.0, "p99.9": 50.0, "max": 60.0}
HEALTH = {"wakeup_us": LATENCY, "cycle_us": LATENCY, "measured_rate_hz": 999.9, "waiver": True}


@pytest.fixture
def sample():
    return rig_state(state_samples(rows(1), RIG, 0, 0)[0])


class Silent:
    lost = 0

    def __init__(self):
        self.waits = []

    def receive(self, timeout_s):
        self.waits.append(timeout_s)
        monitor.time.now += timeout_s * 0.999  # a poll may end a little early

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


@pytest.fixture
def clock(monkeypatch):
    clock = SimpleNamespace(now=100.0)
    clock.monotonic = lambda: clock.now
    monkeypatch.setattr(monitor, "time", clock)
    return clock


def test_the_end_of_the_time_asked_for_is_no_silence(clock):
    stream = Silent()
    assert list(monitor._samples(SimpleNamespace(states=lambda: stream), clock.now + 0.5)) == []
    assert stream.waits[0] == pytest.approx(0.5)


def test_silence_before_the_end_means_that_the_daemon_is_gone(clock):
    with pytest.raises(NoReplyError, match="ended"):
        list(monitor._samples(SimpleNamespace(states=Silent), clock.now + 60))


def test_the_table_names_state_faults_axes_latency_and_losses(sample):
    text = "\n".join(monitor.table(HELLO, sample, HEALTH, 7))
    for part in ("FAULT", "STALE, JUMP", "base", "tip", "0.1429", "40.0", "999.9", "WAIVER", "lost here 7"):
        assert part in text
    assert "wait" in "\n".join(monitor.table(HELLO, sample, None, 0))


def test_a_line_is_one_line(sample):
    text = monitor.line(sample, HEALTH, 7)
    assert "\n" not in text
    assert "faults=STALE,JUMP" in text
    assert "3.0/40.0" in text


def test_json_has_names_for_numbers_and_null_for_what_is_not_finite(sample):
    plain = monitor._plain(sample)
    assert (plain["state"], plain["faults"]) == ("FAULT", ["STALE", "JUMP"])
    assert monitor._finite([1.0, float("nan"), [float("inf")]]) == [1.0, None, [None]]


def test_a_warning_of_the_daemon_is_shown_and_is_no_fault(sample):
    warning = {"name": "TEMPERATURE", "axis": "tip", "text": "axis tip: friction was learned at 22-31 degC"}
    health = {**HEALTH, "warnings": [warning]}
    assert "WARNING: axis tip: friction was learned at 22-31 degC" in monitor.table(HELLO, sample, health, 0)
    assert monitor.line(sample, health, 0).endswith(" warning=TEMPERATURE:tip")
    assert "WARNING" not in "".join(monitor.table(HELLO, sample, HEALTH, 0))


def test_a_log_or_recording_the_disk_refuses_is_shown(sample):
    health = {**HEALTH, "log": {"broken": None}, "recording": {"broken": "no space left"}}
    text = "\n".join(monitor.table(HELLO, sample, health, 0))
    assert "RECORDING BROKEN: no space left" in text
    assert "EVENT LOG" not in text
    assert "recording=BROKEN" in monitor.line(sample, health, 0)
    assert "BROKEN" not in monitor.line(sample, {**HEALTH, "log": {"broken": None}, "recording": None}, 0)
    assert "log=BROKEN" in monitor.line(sample, {**HEALTH, "log": {"broken": "full"}}, 0)
