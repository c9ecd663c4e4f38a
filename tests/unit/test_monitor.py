import json
import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
from test_client import RIG, rows

from rtctl.cli import monitor
from rtctl.cli.json_text import json_text
from rtctl.cli.monitor_text import Shown, line, table
from rtctl.client.samples import rig_state
from rtctl.control.vocabulary import Fault, State
from rtctl.host.exchange.samples import state_samples

HELLO = {"rig": "mock", "rate_hz": 1000.0, "version": "0", "axes": [{"name": "base"}, {"name": "tip"}]}
LATENCY = {"p50": 3.0, "p99": 40.0, "p99.9": 50.0, "max": 60.0}
HEALTH = {"wakeup_us": LATENCY, "cycle_us": LATENCY, "measured_rate_hz": 999.9, "waiver": True}


@pytest.fixture
def sample():
    return rig_state(state_samples(rows(1), RIG, 0, 0)[0])


class Line:
    """A stream by hand: what is put in comes out, and time goes by while it is waited for."""

    lost = 0

    def __init__(self, clock):
        self.clock, self.items, self.waits = clock, [], []

    def receive(self, timeout_s):
        if self.items:
            return self.items.pop(0)
        self.waits.append(timeout_s)
        self.clock.now += timeout_s * 0.999  # a poll may end a little early
        return None

    def close(self):
        pass


@pytest.fixture
def clock(monkeypatch):
    clock = SimpleNamespace(now=100.0)
    clock.monotonic = lambda: clock.now
    monkeypatch.setattr(monitor, "time", clock)
    return clock


class Client:
    def __init__(self, clock):
        self.states_, self.healths, self.told = Line(clock), Line(clock), Line(clock)
        self.greeted = 0

    def hello(self):
        self.greeted += 1
        return {**HELLO, "version": str(self.greeted)}

    def states(self):
        return self.states_

    def health(self):
        return self.healths

    def events(self):
        return self.told


@pytest.fixture
def client(clock):
    return Client(clock)


def sample_at(clock, session=7, state=State.ACTIVE, **fields):
    some = rows(1)
    some["state"], some["faults"], some["fault_first"] = state, 0, -1
    some["time_ns"] = round((clock.now - 0.002) * 1e9)
    for name, value in fields.items():
        some[name] = value
    rig = replace(RIG, session=session)
    return rig_state(state_samples(some, rig, 0, round(clock.now * 1e9))[0], clock.now)


def drawn(watch):
    return "\n".join(table(watch.hello, watch.shown()))


def test_a_rig_that_is_gone_is_no_data_within_half_a_second_and_its_age_grows(clock, client):
    watch = monitor.Watch(client)
    client.states_.items.append(sample_at(clock))
    assert watch.receive(0.1) is not None
    assert "state   ACTIVE" in drawn(watch)
    while clock.now < 100.49:
        watch.receive(0.1)
    assert "NO DATA for 0.5 s (was ACTIVE)" in drawn(watch)
    assert "state   ACTIVE" not in drawn(watch)
    assert line(HELLO, watch.shown()).split()[1:4] == ["NO_DATA", "silent_s=0.5", "was=ACTIVE"]
    clock.now += 3.0
    assert "NO DATA for 3.5 s" in drawn(watch)
    assert "age 3501" in drawn(watch)


def test_old_samples_of_a_daemon_that_stood_still_are_no_data_either(clock, client):
    watch = monitor.Watch(client)
    client.states_.items.append(sample_at(clock))
    clock.now += 2.0  # it waited in the queue
    watch.receive(0.1)
    assert watch.shown().no_data


def test_when_the_daemon_is_back_it_goes_on_and_greets_it_again(clock, client):
    watch = monitor.Watch(client)
    client.states_.items.append(sample_at(clock))
    watch.receive(0.1)
    clock.now += 5.0
    client.states_.items.append(sample_at(clock, session=8, state=State.IDLE))
    watch.receive(0.1)
    assert "state   IDLE" in drawn(watch)
    assert (watch.hello["version"], client.greeted) == ("2", 2)


def test_lines_say_at_once_that_data_cease_and_the_end_of_the_time_asked_for_is_kept(clock, client, capsys):
    watch = monitor.Watch(client)
    client.states_.items.append(sample_at(clock))
    monitor._show(watch, clock.now + 1.0)
    said = [text.split()[1] for text in capsys.readouterr().out.splitlines()]
    assert said == ["ACTIVE", "NO_DATA"]
    assert clock.now == pytest.approx(101.0, abs=0.01)


def test_json_says_that_there_are_no_data(clock, client, capsys):
    watch = monitor.Watch(client)
    client.states_.items.append(sample_at(clock))
    monitor._json(watch, clock.now + 1.0)
    first, *more = [json.loads(text) for text in capsys.readouterr().out.splitlines()]
    assert first["state"] == "ACTIVE"
    assert [set(one) for one in more] == [{"state", "no_data_s"}]
    assert 0.5 <= more[0]["no_data_s"] < 0.8


def test_a_latched_cause_is_shown_with_its_place_when_the_fault_is_gone(clock, client):
    watch = monitor.Watch(client)
    where = {"axis": "tip", "channel": None, "device": "device[0] 'drive'", "detail": "DC_BUS_UNDER_VOLTAGE"}
    client.told.items.append({"event": "fault", "name": "DEVICE", "text": "see its manual", **where})
    number = Fault.DEVICE.value.bit_length() - 1
    client.states_.items.append(sample_at(clock, state=State.FAULT, fault_first=number))
    watch.receive(0.1)
    text = "cause   DEVICE (axis tip, device[0] 'drive'): DC_BUS_UNDER_VOLTAGE: the drive or sensor reports"
    assert text in drawn(watch)
    assert " cause=DEVICE:tip " in line(HELLO, watch.shown())
    client.states_.items.append(sample_at(clock, state=State.ESTOP, fault_first=number))
    watch.receive(0.1)
    assert "cause   ESTOP: the emergency stop is pressed" in drawn(watch)


def test_a_device_that_complains_is_shown_and_one_that_is_well_is_not(sample):
    ill = {
        "device": "device[0] 'can'",
        "axis": "tip",
        "text": "node 2: fault",
        "faults": ["DEVICE"],
        "silent": False,
    }
    well = {**ill, "axis": "base", "text": "node 1: ready", "faults": []}
    text = "\n".join(table(HELLO, Shown(sample, 0.0, 0, {**HEALTH, "devices": [well, ill]})))
    assert "device  device[0] 'can', axis tip: node 2: fault; DEVICE" in text
    assert "node 1" not in text


def test_the_table_names_state_faults_axes_latency_and_losses(sample):
    text = "\n".join(table(HELLO, Shown(sample, 0.0, 7, HEALTH)))
    for part in ("FAULT", "STALE, JUMP", "base", "tip", "0.1429", "40.0", "999.9", "WAIVER", "lost here 7"):
        assert part in text
    assert "wait" in "\n".join(table(HELLO, Shown(sample, 0.0, 0)))


def test_a_line_of_carriages_is_in_metres_and_newtons(sample):
    axes = [{**axis, "motion": "linear"} for axis in HELLO["axes"]]
    text = line({**HELLO, "axes": axes}, Shown(sample, 0.0, 7, HEALTH))
    assert all(f" {name}=" in text for name in ("position_m", "velocity_m_s", "hand_torque_n"))
    assert "_rad" not in text
    mixed = line({**HELLO, "axes": [HELLO["axes"][0], axes[1]]}, Shown(sample, 0.0, 7, HEALTH))
    assert " position_rad=" in mixed


def test_a_line_is_one_line(sample):
    text = line(HELLO, Shown(sample, 0.0, 7, HEALTH))
    assert "\n" not in text
    assert "faults=STALE,JUMP" in text
    assert "3.0/40.0" in text


def test_json_has_names_for_numbers_and_null_for_what_is_not_finite(sample):
    told = json.loads(json_text(monitor._plain(replace(sample, age_s=math.inf))))
    assert (told["state"], told["faults"], told["age_s"]) == ("FAULT", ["STALE", "JUMP"], None)


def test_a_warning_of_the_daemon_is_shown_and_is_no_fault(sample):
    warning = {"name": "TEMPERATURE", "axis": "tip", "text": "axis tip: friction was learned at 22-31 degC"}
    health = {**HEALTH, "warnings": [warning]}
    assert "WARNING: axis tip: friction was learned at 22-31 degC" in table(
        HELLO, Shown(sample, 0.0, 0, health)
    )
    assert line(HELLO, Shown(sample, 0.0, 0, health)).endswith(" warning=TEMPERATURE:tip")
    assert "WARNING" not in "".join(table(HELLO, Shown(sample, 0.0, 0, HEALTH)))


def test_the_friction_is_shown_where_it_is_known(sample):
    def of(value):
        return {"value": value, "low": value - 0.02, "high": value + 0.02}

    known = {
        "axis": "base",
        "factor": of(0.91),
        "forward": of(0.92),
        "backward": of(0.9),
        "offset_nm": of(0.004),
    }
    health = {
        **HEALTH,
        "friction": [
            {**known, "seconds": 24.1, "followed": None},
            {**known, "axis": "wrist", "seconds": 24.1, "followed": 0.953},
            {"axis": "tip", "factor": None, "seconds": 1.0, "strokes": 2},
        ],
    }
    found = [text for text in table(HELLO, Shown(sample, 0.0, 0, health)) if text.startswith("friction")]
    told = (
        "0.910 of what was learned (0.890 to 0.930; forward 0.92, backward 0.90), offset +4.0 mN m, by 24 s"
    )
    assert found == [
        f"friction base: {told}",
        f"friction wrist: {told}; compensation follows it: 0.953",
    ]
    carriage = {**HELLO, "axes": [{"name": "base", "motion": "linear"}, {"name": "tip"}]}
    found = [text for text in table(carriage, Shown(sample, 0.0, 0, health)) if text.startswith("friction")]
    assert ["mN," in text for text in found] == [True, False], "the unit of each axis"


def test_a_log_or_recording_the_disk_refuses_is_shown(sample):
    health = {**HEALTH, "log": {"broken": None}, "recording": {"broken": "no space left"}}
    text = "\n".join(table(HELLO, Shown(sample, 0.0, 0, health)))
    assert "RECORDING BROKEN: no space left" in text
    assert "EVENT LOG" not in text
    assert "recording=BROKEN" in line(HELLO, Shown(sample, 0.0, 0, health))
    assert "BROKEN" not in line(
        HELLO, Shown(sample, 0.0, 0, {**HEALTH, "log": {"broken": None}, "recording": None})
    )
    assert "log=BROKEN" in line(HELLO, Shown(sample, 0.0, 0, {**HEALTH, "log": {"broken": "full"}}))
