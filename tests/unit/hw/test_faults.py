"""Every scripted fault does what it says while it is due, and nothing else."""

import math

import numpy as np
import pytest
from scripted_mock import AT, BEYOND, COUNT_RAD, DUE, FOR, MEASURED, SHOWN, N, T, fault, holding, make, run

from hw.fault_kinds import KINDS, Kind
from hw.interface import LinkFault, LinkLost
from hw.simulators.jit import records
from rtctl.tick import new_ticks


@pytest.fixture(scope="module")
def clean():
    return run(make())


SINCE_S = (np.arange(FOR)[:, None] + 1) * T

READINGS = {
    ("position", "nan"): (None, lambda x, last: x * math.nan),
    ("position", "inf"): (-1.0, lambda x, last: np.full_like(x, -math.inf)),
    ("position", "jump"): (0.25, lambda x, last: x + 0.25),
    ("position", "frozen"): (None, lambda x, last: np.zeros_like(x) + last),
    ("position", "out_of_range"): (None, lambda x, last: np.full_like(x, 1e6)),
    ("position", "drift"): (3.0, lambda x, last: x + 3.0 * SINCE_S),
    ("position", "sign"): (None, lambda x, last: 2 * last - x),
    ("position", "wrap"): (
        8,
        lambda x, last: ((np.floor(x / COUNT_RAD + 0.5) + 128) % 256 - 128) * COUNT_RAD,
    ),
    ("current", "nan"): (None, lambda x, last: x * math.nan),
    ("current", "inf"): (None, lambda x, last: np.full_like(x, math.inf)),
    ("current", "stuck"): (None, lambda x, last: np.zeros_like(x) + last),
    ("current", "offset"): (-1.5, lambda x, last: x - 1.5),
    ("current", "scale"): (2.5, lambda x, last: x * 2.5),
    ("current", "sign"): (None, lambda x, last: -x),
    ("force", "nan"): (None, lambda x, last: x * math.nan),
    ("force", "inf"): (0, lambda x, last: np.full_like(x, math.inf)),
    ("force", "saturated"): (-50, lambda x, last: np.full_like(x, -50.0)),
    ("force", "frozen"): (None, lambda x, last: np.zeros_like(x) + last),
    ("force", "offset"): (4.0, lambda x, last: x + 4.0),
    ("force", "clipped"): (0.2, lambda x, last: np.clip(x, -0.2, 0.2)),
    ("force", "scale"): (-1.5, lambda x, last: x * -1.5),
    ("moment", "nan"): (None, lambda x, last: x * math.nan),
    ("moment", "frozen"): (None, lambda x, last: np.zeros_like(x) + last),
    ("moment", "offset"): (0.4, lambda x, last: x + 0.4),
    ("moment", "clipped"): (0.01, lambda x, last: np.clip(x, -0.01, 0.01)),
    ("temperature", "value"): (120.0, lambda x, last: np.full_like(x, 120.0)),
    ("temperature", "ramp"): (500.0, lambda x, last: x + 500.0 * SINCE_S),
    ("temperature", "missing"): (None, lambda x, last: x * math.nan),
    ("velocity", "nan"): (None, lambda x, last: x * math.nan),
    ("velocity", "inf"): (-1.0, lambda x, last: np.full_like(x, -math.inf)),
    ("velocity", "frozen"): (None, lambda x, last: np.zeros_like(x) + last),
    ("velocity", "out_of_range"): (None, lambda x, last: np.full_like(x, 1e6)),
    ("velocity", "offset"): (-0.75, lambda x, last: x - 0.75),
    ("velocity", "scale"): (0.5, lambda x, last: x * 0.5),
    ("velocity", "sign"): (None, lambda x, last: -x),
}
FIELD = {
    "position": "position_rad",
    "current": "current_a",
    "force": "force_n",
    "moment": "moment_nm",
    "temperature": "temperature_c",
    "velocity": "device_velocity_rad_s",
}


def valued(value):
    return {} if value is None else {"value": float(value)}


@pytest.mark.parametrize("axis", [None, 0, 1])
@pytest.mark.parametrize(("channel", "kind"), READINGS)
def test_a_fault_of_a_sensor_changes_its_reading_while_it_is_due_and_nothing_else(channel, kind, axis, clean):
    value, change = READINGS[channel, kind]
    more = valued(value) if axis is None else {**valued(value), "axis": axis}
    shown, truth = run(make([fault(channel, kind, **more)]))
    expected = {name: clean[0][name].copy() for name in SHOWN}
    field = expected[FIELD[channel]]
    where = slice(None) if axis is None else slice(axis, axis + 1)
    field[DUE, where] = change(field[DUE, where], field[AT - 1, where])
    for name in SHOWN:
        np.testing.assert_allclose(shown[name], expected[name], rtol=1e-13, atol=0, err_msg=name)
    assert truth["position_rad"].tobytes() == clean[1]["position_rad"].tobytes(), "a sensor moves nothing"
    assert truth["rng"].tobytes() == clean[1]["rng"].tobytes(), "the noise is the same"


def counts(*due):
    """Sample counts of a run, with these in the due ticks and the device counting on."""
    return [*range(1, AT + 1), *due, *range(AT + FOR + 1, N + 1)]


BITS = {"checksum": LinkFault.CHECKSUM, "sequence": LinkFault.SEQUENCE, "lost": LinkFault.LOST}
LINK = {
    # kind: (value, counts, whether the readings are held)
    "stale": (None, [*range(1, AT + 1), *[AT] * FOR, *range(AT + 1, N - FOR + 1)], False),
    "drop": (None, counts(*[AT] * FOR), True),
    "checksum": (None, counts(*range(AT + 1, AT + FOR + 1)), False),
    "sequence": (None, counts(*range(AT + 1, AT + FOR + 1)), False),
    "older": (3, counts(*range(AT - 2, AT - 2 + FOR)), True),
    "lost": (None, counts(*[AT] * FOR), True),
}


@pytest.mark.parametrize("kind", LINK)
def test_a_fault_of_the_link_changes_counter_bits_and_values_as_it_says(kind, clean):
    value, count, held = LINK[kind]
    shown, _ = run(make([fault("link", kind, **valued(value))]))
    assert shown["sample_count"].tolist() == count
    bits = np.zeros(N, int)
    bits[DUE] = BITS.get(kind, 0)
    assert shown["link_faults"].tolist() == bits.tolist()
    until = AT + FOR if kind == "lost" else N  # after it the rig stands elsewhere: nothing drove it
    for name in MEASURED:
        expected = holding(clean[0][name]) if held else clean[0][name]
        assert shown[name][:until].tobytes() == expected[:until].tobytes(), name


def test_a_sample_that_was_held_is_followed_by_the_true_one(clean):
    shown, _ = run(make([fault("link", "drop", for_ticks=1)]))
    assert shown["position_rad"][AT].tolist() == clean[0]["position_rad"][AT - 1].tolist()
    assert shown["position_rad"][AT + 1].tolist() == clean[0]["position_rad"][AT + 1].tolist()


def test_a_duplicate_is_the_last_sample_with_its_own_counter(clean):
    shown, _ = run(make([fault("link", "older", for_ticks=1)]))
    assert shown["sample_count"][AT] == AT
    assert shown["position_rad"][AT].tolist() == clean[0]["position_rad"][AT - 1].tolist()


def test_a_device_that_restarts_counts_from_one_after_it_is_plugged_in_again():
    shown, _ = run(make([fault("link", "lost", value=1.0)]))
    assert shown["sample_count"].tolist() == counts(*[AT] * FOR)[: AT + FOR] + list(
        range(1, N - AT - FOR + 1)
    )


def test_an_unplugged_device_gets_no_current_and_lets_go_after_its_time_to_live():
    faults = [fault("link", "lost", for_ticks=30)]
    _, truth = run(make(faults, time_to_live_ticks=4, axis=[{}]))
    wanted = 0.5 * np.sin(0.2 * np.arange(N))
    current = truth["current_a"][:, 0]
    assert current[:AT] == pytest.approx(wanted[:AT])
    assert current[AT : AT + 3] == pytest.approx([wanted[AT - 1]] * 3), "the last current is held"
    assert np.all(current[AT + 4 : AT + 30] == 0)
    assert current[AT + 30 :] == pytest.approx(wanted[AT + 30 :])


@pytest.mark.parametrize("kind", ["raise_read", "raise_write"])
def test_a_lost_link_is_raised_where_the_schedule_says_and_only_then(kind):
    backend = make([fault("link", kind, for_ticks=1)])
    tick = records(new_ticks(1, 2))
    for k in range(AT):
        tick["tick"] = k
        backend.read(tick)
        backend.write(tick)
    tick["tick"] = AT
    if kind == "raise_write":
        backend.read(tick)
        assert tick["sample_count"][0] == AT + 1
        assert tick["link_faults"][0] == 0
        with pytest.raises(LinkLost, match="in write"):
            backend.write(tick)
    else:
        with pytest.raises(LinkLost, match="in read"):
            backend.read(tick)
        assert tick["link_faults"][0] == LinkFault.LOST
    backend.stop()
    assert not backend.state["current_line_a"].any()
    tick["tick"] = AT + 1
    backend.read(tick)
    backend.write(tick)


def test_the_emergency_stop_is_pressed_while_it_is_due(clean):
    shown, _ = run(make([fault("estop", "pressed")]))
    assert np.flatnonzero(shown["estop"]).tolist() == list(range(AT, AT + FOR))
    assert shown["position_rad"].tobytes() == clean[0]["position_rad"].tobytes()


ACTUATOR = {
    "dead": (None, lambda wanted, last: wanted * 0, 1),
    "stuck": (None, lambda wanted, last: wanted * 0 + last, 1),
    "scale": (-0.5, lambda wanted, last: wanted * -0.5, 1),
    "sign": (None, lambda wanted, last: wanted, -1),
}


@pytest.mark.parametrize("axis", [None, 1])
@pytest.mark.parametrize("kind", ACTUATOR)
def test_a_fault_of_the_actuator_changes_current_and_torque_while_it_is_due(kind, axis):
    value, change, direction = ACTUATOR[kind]
    more = {} if axis is None else {"axis": axis}
    _, truth = run(make([fault("actuator", kind, **valued(value), **more)]))
    wanted = np.repeat(0.5 * np.sin(0.2 * np.arange(N))[:, None], 2, axis=1)
    where = slice(None) if axis is None else slice(axis, axis + 1)
    current, sign = wanted.copy(), np.ones_like(wanted)
    current[DUE, where] = change(wanted[DUE, where], wanted[AT - 1, where])
    sign[DUE, where] = direction
    np.testing.assert_allclose(truth["current_a"], current, rtol=1e-13)
    np.testing.assert_allclose(truth["motor_torque_nm"], sign * current * 80 * 0.72 * 0.0134, rtol=1e-12)


def test_a_drive_goes_limp_after_being_enabled_so_long_and_recovers_when_disabled():
    backend = make([fault("actuator", "limp", at_tick=0, for_ticks=0, value=0.010)], axis=[{}])
    tick, current = records(new_ticks(1, 2)), []
    enabled = [0] * 5 + [1] * 15 + [0] + [1] * 12
    for k, on in enumerate(enabled):
        tick["tick"], tick["enabled"], tick["current_command_a"] = k, on, 0.4
        backend.read(tick)
        backend.write(tick)
        current.append(float(backend.state["current_a"][0, 0]))
    assert current == [0.0] * 5 + [0.4] * 10 + [0.0] * 5 + [0.0] + [0.4] * 10 + [0.0] * 2


def test_a_stuck_drive_ignores_that_it_was_disabled_but_not_that_it_was_stopped():
    backend = make([fault("actuator", "stuck", for_ticks=0)])
    tick = records(new_ticks(1, 2))
    for k in range(N):
        tick["tick"], tick["enabled"], tick["current_command_a"] = k, k < AT, 0.4
        backend.read(tick)
        backend.write(tick)
    assert backend.state["current_a"][0].tolist() == [0.4, 0.4]
    backend.stop()
    assert backend.state["motor_torque_nm"][0].tolist() == [0.0, 0.0]


def test_a_stuck_drive_comes_free_in_time_also_where_the_loop_misses_slots():
    backend = make([fault("actuator", "stuck", at_tick=5, for_ticks=3)])
    tick = records(new_ticks(1, 2))
    for k in (*range(7), 30):
        tick["tick"], tick["enabled"], tick["current_command_a"] = k, 1, 0.4
        backend.read(tick)
        if k < 30:
            backend.write(tick)
    assert backend.state["current_a"][0].tolist() == [0.0, 0.0]  # its time to live ended long ago


def test_an_amplifier_saturates_also_when_it_drives_too_much():
    _, truth = run(
        make([fault("actuator", "scale", at_tick=0, for_ticks=0, value=100.0)], axis=[{"current_max_a": 2.0}])
    )
    assert np.max(np.abs(truth["current_a"])) == 2.0


def test_a_stall_blocks_the_backend_for_the_slots_it_costs_and_half_a_period(monkeypatch):
    slept = []
    monkeypatch.setattr("hw.fault_script.time.sleep", slept.append)
    run(make([fault("loop", "stall", value=4.0, for_ticks=2)]))
    assert slept == pytest.approx([5.5e-3, 5.5e-3])


def test_every_kind_there_is_has_its_test():
    tested = {*READINGS, *(("link", kind) for kind in (*LINK, "raise_read", "raise_write"))}
    tested |= {("actuator", kind) for kind in (*ACTUATOR, "limp")} | {("estop", "pressed"), ("loop", "stall")}
    # test_channels
    tested |= {(channel, kind) for channel in BEYOND for kind in ("nan", "frozen", "offset", "out_of_range")}
    assert tested == set(KINDS)


def test_the_table_of_kinds_is_sound():
    for kind in KINDS.values():
        assert isinstance(kind, Kind)
        assert kind.low <= kind.high
        assert kind.default is None or kind.low <= kind.default <= kind.high
        assert bool(kind.unit) == (kind.low < kind.high)
