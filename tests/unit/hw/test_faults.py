"""Every scripted fault does what it says, in the ticks it says, and nothing else."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hw.channels import QUANTITIES
from hw.fault_kinds import KINDS, Channel, Effect, Kind
from hw.fault_options import read_faults
from hw.fault_script import fill_schedule
from hw.interface import BackendError, LinkFault, LinkLost, Rig
from hw.mock.backend import MockBackend
from hw.mock.jit import records
from hw.mock.options import SENSORS, MockOptions
from hw.scripted_faults import FAULTS
from rtctl.tick import new_ticks

N, AT, FOR, T = 60, 20, 5, 1e-3
DUE = slice(AT, AT + FOR)
COUNT_RAD = 2 * math.pi / 160_000
MEASURED = ("position_rad", "current_a", "force_n", "moment_nm", "temperature_c", "device_velocity_rad_s")
SHOWN = (
    *MEASURED,
    "estop",
    "link_faults",
    "sample_count",
)
BEYOND = {reading.name for reading in QUANTITIES} - SENSORS
"""Channels that the mock rig does not measure."""

MOVING = {
    "seed": 7,
    "axis": [{"start_position_rad": 0.2, "current_noise_a": 0.02, "current_bias_a": 0.3}],
    "force": {
        "noise_n": 0.01,
        "bias_n": [0.1, -0.2, 0.3],
        "drift_n_sqrt_s": 0.1,
        "moment": {"noise_nm": 0.01, "contact_m": [0.1, 0.02, 0.0]},
    },
    "velocity": {"noise_rad_s": 0.01, "resolution_rad_s": 0.001},
    "hand": [{"kind": "sine", "start_s": 0.0, "frequency_hz": 5.0}],
}


def rig(n=2):
    return Rig(
        n_axes=n,
        period_s=T,
        gear_ratio=np.full(n, 80.0),
        gear_efficiency=np.full(n, 0.72),
        torque_constant_nm_a=np.full(n, 0.0134),
        encoder_counts_per_rev=np.full(n, 160_000.0),
        lever_m=np.array([[0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])[:n],
    )


def make(faults=(), n=2, **options):
    return MockBackend(
        MockOptions.model_validate({**MOVING, **options, "faults": list(faults)}).model_dump(mode="json"),
        rig(n),
    )


def run(backend, ticks=N, enabled=1, amplitude_a=0.5):
    """Ticks shown, and states of the rig after each one's period."""
    n = len(backend.state["position_rad"][0])
    tick, out = records(new_ticks(1, n)), new_ticks(ticks, n)
    truth = np.zeros(ticks, backend.state.dtype)
    for k in range(ticks):
        tick["tick"] = k
        backend.read(tick)
        tick["current_command_a"] = amplitude_a * math.sin(0.2 * k)
        tick["enabled"] = enabled
        backend.write(tick)
        out[k], truth[k] = tick[0], backend.state[0]
    return out, truth


def fault(channel, kind, **more):
    times = {"at_tick": AT, "for_ticks": FOR}
    for name in ("at_s", "at_tick"):
        if name in more:
            times.pop("at_tick", None)
    for name in ("for_s", "for_ticks"):
        if name in more:
            times.pop("for_ticks", None)
    return {"channel": channel, "kind": kind, **times, **more}


@pytest.fixture(scope="module")
def clean():
    return run(make())


def holding(values):
    held = values.copy()
    held[DUE] = values[AT - 1]
    return held


def with_due(values, change):
    out = values.copy()
    out[DUE] = change(values[DUE])
    return out


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
    tested |= {
        (channel, kind) for channel in BEYOND for kind in ("nan", "frozen", "offset", "out_of_range")
    }  # test_channels
    assert tested == set(KINDS)


# -- when


def on_ticks(ticks=N, **when):
    when = {"channel": "estop", "kind": "pressed", **when}
    return np.flatnonzero(run(make([when]), ticks)[0]["estop"]).tolist()


@pytest.mark.parametrize(
    ("when", "expected"),
    [
        ({"at_tick": 0, "for_ticks": 1}, [0]),
        ({"at_tick": 58, "for_ticks": 0}, [58, 59]),
        ({"at_s": 0.057, "for_s": 0.0}, [57, 58, 59]),
        ({"at_s": 0.01, "for_s": 0.003}, [10, 11, 12]),
        ({"at_s": 0.0104, "for_s": 0.0001}, [10]),
        ({"at_tick": 5, "for_s": 0.002, "every_s": 0.02}, [5, 6, 25, 26, 45, 46]),
        ({"at_tick": 5, "for_ticks": 2, "every_ticks": 30}, [5, 6, 35, 36]),
        ({"at_tick": 56, "for_ticks": 1, "every_ticks": 1}, [56, 57, 58, 59]),
        ({"at_tick": 60, "for_ticks": 1}, []),
        ({"at_tick": 0, "for_ticks": 0, "probability": 0.0}, []),
    ],
)
def test_a_fault_acts_in_exactly_the_ticks_of_its_schedule(when, expected):
    assert on_ticks(**when) == expected


def test_time_counts_from_the_first_tick_whatever_its_slot():
    backend = make([fault("estop", "pressed", at_tick=2, for_ticks=1)])
    tick, pressed = records(new_ticks(1, 2)), []
    for slot in (1000, 1001, 1002, 1003):
        tick["tick"] = slot
        backend.read(tick)
        pressed.append(int(tick["estop"][0]))
        backend.write(tick)
    assert pressed == [0, 0, 1, 0]


def test_faults_on_one_reading_act_in_their_order_and_those_of_the_link_last(clean):
    twice = [fault("current", "scale", value=2.0), fault("current", "offset", value=1.0)]
    there, back = run(make(twice))[0], run(make(twice[::-1]))[0]
    true = clean[0]["current_a"][DUE]
    np.testing.assert_allclose(there["current_a"][DUE], 2 * true + 1, rtol=1e-13)
    np.testing.assert_allclose(back["current_a"][DUE], 2 * (true + 1), rtol=1e-13)
    dropped = run(make([fault("link", "drop"), fault("position", "nan")]))[0]
    assert dropped["position_rad"].tobytes() == holding(clean[0]["position_rad"]).tobytes()


# -- chance


def test_the_share_of_ticks_in_which_a_fault_acts_is_its_probability():
    shares = []
    for seed in range(40):
        flicker = [fault("estop", "pressed", at_tick=0, for_ticks=0, probability=0.3)]
        shares.append(run(make(flicker, seed=seed), 250)[0]["estop"].mean())
    deviation = math.sqrt(0.3 * 0.7 / 250)
    assert np.mean(shares) == pytest.approx(0.3, abs=4 * deviation / math.sqrt(40))
    assert np.std(shares) == pytest.approx(deviation, rel=0.4)
    assert len(set(shares)) > 10, "seeds differ"


def test_chance_repeats_with_the_seed_and_leaves_the_noise_alone(clean):
    flicker = [fault("estop", "pressed", at_tick=0, for_ticks=0, probability=0.5)]
    first, again, other = (run(make(flicker, seed=seed)) for seed in (7, 7, 8))
    assert first[0].tobytes() == again[0].tobytes()
    assert first[0]["estop"].tolist() != other[0]["estop"].tolist()
    assert first[0]["force_n"].tobytes() == clean[0]["force_n"].tobytes()


def test_a_schedule_that_is_not_due_changes_no_bit(clean):
    shown, truth = run(make([fault("position", "nan", at_tick=N), fault("actuator", "dead", at_tick=N)]))
    assert shown.tobytes() == clean[0].tobytes()
    for name in ("rng", "position_rad", "velocity_rad_s", "current_line_a"):
        assert truth[name].tobytes() == clean[1][name].tobytes()


# -- records


def test_a_schedule_can_be_written_into_the_records_directly(clean):
    backend = make()
    p = backend.params[0]
    for name, value in {
        "channel": Channel.POSITION,
        "effect": Effect.OFFSET,
        "axis": -1,
        "value": 0.5,
    }.items():
        p["fault_" + name][3] = value
    p["fault_from_tick"][3], p["fault_ticks"][3], p["fault_probability"][3] = AT, FOR, 1.0
    p["fault_count"] = 4  # places 0 to 2 are empty: no such channel, nothing happens
    shown, _ = run(backend)
    expected = with_due(clean[0]["position_rad"], lambda x: x + 0.5)
    assert shown["position_rad"].tobytes() == expected.tobytes()


def test_an_effect_that_is_not_of_its_channel_does_nothing(clean):
    known = {(kind.channel, kind.effect) for kind in KINDS.values()}
    channels = (0, Channel.ESTOP, Channel.LINK, Channel.ACTUATOR, Channel.LOOP, 99)
    for channel in channels:
        backend = make()
        p = backend.params[0]
        strange = [effect for effect in (0, *Effect, 99) if (channel, effect) not in known][:FAULTS]
        for k, effect in enumerate(strange):
            p["fault_channel"][k], p["fault_effect"][k], p["fault_value"][k] = channel, effect, 3.0
            p["fault_axis"][k], p["fault_probability"][k] = -1, 1.0
        p["fault_count"] = len(strange)
        shown, truth = run(backend)
        assert shown.tobytes() == clean[0].tobytes(), channel
        assert truth["motor_torque_nm"].tobytes() == clean[1]["motor_torque_nm"].tobytes(), channel


def test_filling_again_replaces_what_was_there(clean):
    backend = make([fault("position", "nan")] * FAULTS)
    fill_schedule(backend.params, read_faults([fault("estop", "pressed")]), rig())
    shown, _ = run(backend)
    assert shown["position_rad"].tobytes() == clean[0]["position_rad"].tobytes()
    assert backend.params["fault_count"][0] == 1
    assert not backend.params["fault_channel"][0, 1:].any()


def test_a_joint_that_is_not_there_is_refused_also_without_a_rig_file():
    with pytest.raises(BackendError, match=r"faults\[0\]\.axis: 2 is not there; must be below 2"):
        make([fault("position", "nan", axis=2)])
    make([fault("force", "nan", axis=2)])


def all_effects():
    """One fault of every effect on every channel that neither raises nor sleeps, overlapping, some by chance."""
    out = []
    for k, kind in enumerate(KINDS.values()):
        if kind.effect in (Effect.RAISE_READ, Effect.RAISE_WRITE, Effect.STALL):
            continue
        if kind.channel.name.lower() in BEYOND:
            continue
        value = kind.default if kind.default is not None else (kind.low + 3 * kind.high) / 4
        probability = 0.4 if k % 3 == 0 else 1.0
        table = fault(kind.channel.name.lower(), kind.name, at_tick=2 + k, for_ticks=4, every_ticks=23)
        out.append({**table, "probability": probability, "value": float(value)})
    return {"first": out[:FAULTS], "last": out[-FAULTS:]}  # as many as there are places


PLAIN = """
import json, sys
sys.path.insert(0, {folder!r})
import test_faults
shown, _ = test_faults.run(test_faults.make(test_faults.all_effects()[{part!r}]), 90)
print(json.dumps([shown[name].tolist() for name in test_faults.SHOWN]))
"""


@pytest.mark.parametrize(("part", "without_number"), [("first", "current_a"), ("last", "moment_nm")])
def test_compiled_and_plain_python_agree_on_all_effects_and_neither_warns(part, without_number):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", PLAIN.format(folder=str(Path(__file__).parent), part=part)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    shown, _ = run(make(all_effects()[part]), 90)
    assert not np.isfinite(shown[without_number]).all()
    for name, plain in zip(SHOWN, json.loads(done.stdout), strict=True):
        np.testing.assert_allclose(np.array(plain), shown[name], rtol=1e-9, atol=1e-12, err_msg=name)


def test_the_table_of_kinds_is_sound():
    for kind in KINDS.values():
        assert isinstance(kind, Kind)
        assert kind.low <= kind.high
        assert kind.default is None or kind.low <= kind.default <= kind.high
        assert bool(kind.unit) == (kind.low < kind.high)
