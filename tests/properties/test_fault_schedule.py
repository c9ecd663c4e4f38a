"""Any schedule, however it came into the record, acts when it is due and leaves the rig's truth and noise
alone.
"""

import math
from functools import cache

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.fault_kinds import Channel, Effect, campaign_table
from hw.generator import seed_words, uniform
from hw.interface import Rig
from hw.jit import compiled
from hw.scripted_faults import FAULTS
from hw.simulators.jit import records
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_options import MockOptions
from hw.simulators.mock_plant import next_slot, plant_read, plant_write
from rtctl.tick import new_ticks

RIG = Rig(
    n_axes=2,
    period_s=1e-3,
    gear_ratio=np.full(2, 80.0),
    gear_efficiency=np.full(2, 0.72),
    torque_constant_nm_a=np.full(2, 0.0134),
    encoder_counts_per_rev=np.full(2, 160_000.0),
    lever_m=np.array([[0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]),
)
OPTIONS = MockOptions.model_validate(
    {"axis": [{"current_noise_a": 0.01}], "hand": [{"kind": "sine", "start_s": 0.0, "frequency_hz": 2.0}]}
).model_dump(mode="json")
TICKS = 50
SENSORS = (Channel.POSITION, Channel.CURRENT, Channel.FORCE, Channel.TEMPERATURE, Channel.ESTOP)

ROW = st.tuples(
    st.integers(0, len(campaign_table()) - 1),
    st.integers(-1, 2),
    st.integers(0, TICKS),
    st.integers(0, 20),
    st.integers(0, 30),
    st.floats(0, 1),
)


def scripted(rows):
    backend = MockBackend(OPTIONS, RIG)
    p = backend.params[0]
    for k, (kind, axis, at, ticks, every, share) in enumerate(rows):
        channel, effect, low, high = campaign_table()[kind]
        p["fault_channel"][k], p["fault_effect"][k], p["fault_axis"][k] = channel, effect, axis
        p["fault_from_tick"][k], p["fault_ticks"][k], p["fault_every_ticks"][k] = at, ticks, every
        p["fault_probability"][k], p["fault_value"][k] = 1.0, low + share * (high - low)
    p["fault_count"] = len(rows)
    return backend


def run(backend):
    """Ticks shown, truth after each, and which places acted."""
    tick, out, truth = records(new_ticks(1, 2)), new_ticks(TICKS, 2), np.zeros(TICKS, backend.state.dtype)
    acted = []
    for k in range(TICKS):
        tick["tick"] = k
        plant_read(tick, backend.state, backend.params)
        acted.append(int(backend.state["fault_on"][0]))
        tick["enabled"], tick["current_command_a"] = 1, 0.3 * math.sin(0.3 * k)
        plant_write(tick, backend.state, backend.params)
        out[k], truth[k] = tick[0], backend.state[0]
    return out, truth, acted


def due(row, k):
    """The schedule's words, said once more."""
    _, _, at, ticks, every, _ = row
    begins = range(at, k + 1, every) if every else ([at] if at <= k else [])
    return bool(begins) and (ticks == 0 or k - begins[-1] < ticks)


@settings(max_examples=150, deadline=None)
@given(rows=st.lists(ROW, min_size=1, max_size=FAULTS))
def test_whatever_is_scheduled_acts_exactly_when_due_and_the_truth_stays_finite(rows):
    _, truth, acted = run(scripted(rows))
    expected = [sum(due(row, k) << i for i, row in enumerate(rows)) for k in range(TICKS)]
    assert acted == expected
    for name in ("position_rad", "velocity_rad_s", "current_a", "motor_torque_nm", "hand_torque_nm"):
        assert np.isfinite(truth[name]).all(), name
    assert np.all(np.abs(truth["current_a"]) <= 20.0)


@cache
def clean():
    return run(MockBackend(OPTIONS, RIG))


@settings(max_examples=100, deadline=None)
@given(rows=st.lists(ROW, min_size=1, max_size=FAULTS))
def test_no_fault_of_a_sensor_moves_the_rig_or_its_noise_or_the_samples_where_none_is_due(rows):
    table = campaign_table()
    rows = [row for row in rows if table[row[0], 0] in SENSORS]
    shown, truth, acted = run(scripted(rows))
    assert truth["position_rad"].tobytes() == clean()[1]["position_rad"].tobytes()
    assert truth["rng"].tobytes() == clean()[1]["rng"].tobytes()
    quiet = np.array(acted) == 0
    assert shown[quiet].tobytes() == clean()[0][quiet].tobytes()


@compiled
def campaign(tick, state, params, rng, table, ticks, every):
    """A compiled campaign in small: draws a new fault every so often; returns how many ticks showed NaN."""
    p, bad = params[0], 0
    for k in range(ticks):
        if k % every == 0:
            kind = int(uniform(rng) * len(table))
            p.fault_channel[0] = int(table[kind, 0])
            p.fault_effect[0] = int(table[kind, 1])
            p.fault_value[0] = table[kind, 2] + uniform(rng) * (table[kind, 3] - table[kind, 2])
            p.fault_axis[0], p.fault_ticks[0], p.fault_every_ticks[0] = -1, 5, 0
            p.fault_from_tick[0] = tick[0].tick - state[0].first_tick + int(uniform(rng) * every)
            p.fault_probability[0] = 1.0
            p.fault_count = 1
        plant_read(tick, state, params)
        if math.isnan(tick[0].position_rad[0]):
            bad += 1
        plant_write(tick, state, params)
        next_slot(tick, state)
    return bad


def test_compiled_code_can_draw_faults_into_the_record_as_it_runs():
    results = []
    for _ in range(2):
        backend, tick = MockBackend(OPTIONS, RIG), records(new_ticks(1, 2))
        table = campaign_table()
        table = table[table[:, 1] != Effect.STALL]
        bad = campaign(tick, backend.state, backend.params, seed_words(5), table, 10_000, 40)
        results.append((bad, tick.tobytes(), backend.state.tobytes()))
    assert results[0] == results[1]
    assert 5 < results[0][0] < 150, "one kind in 36 is NaN of the position: 250 faults of 5 ticks"
