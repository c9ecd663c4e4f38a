"""The same schedule acts on recorded samples as on simulated ones."""

import math

import numpy as np
import pytest

from hw.fault_kinds import KINDS
from hw.fault_options import SAMPLE_CHANNELS
from hw.interface import CompiledBackend, LinkFault, LinkLost, Rig
from hw.playback.backend import PlaybackBackend
from hw.playback.options import PlaybackOptions
from rtctl.control.jit import records
from rtctl.tick import new_ticks

N, AT, FOR = 40, 10, 4
RIG = Rig(
    n_axes=1,
    period_s=1e-3,
    gear_ratio=np.array([80.0]),
    gear_efficiency=np.array([0.75]),
    torque_constant_nm_a=np.array([0.02]),
    encoder_counts_per_rev=np.array([160_000.0]),
    lever_m=np.array([[0.0, 0.1, 0.0]]),
)
SHOWN = ("position_rad", "current_a", "force_n", "sample_count", "link_faults")


@pytest.fixture
def make(tmp_path):
    lines = [f"{k / 1000!r},{0.01 * k!r},{0.1 * k!r},{-0.05 * k!r}" for k in range(N)]
    (tmp_path / "log.csv").write_text("t,x,q,h\n" + "\n".join(lines) + "\n")
    axis = {"position": {"column": "x"}, "motor_torque": {"column": "q"}, "hand_torque": {"column": "h"}}

    def made(*faults, **more):
        table = {
            "file": "log.csv",
            "time": {"column": "t"},
            "axis": [axis],
            "faults": [{"at_tick": AT, "for_ticks": FOR, **fault} for fault in faults],
            **more,
        }
        valid = PlaybackOptions.model_validate(table, context={"folder": tmp_path})
        backend = PlaybackBackend(valid.model_dump(mode="json"), RIG)
        backend.open()
        return backend

    return made


def run(backend, ticks=N):
    tick, out = records(new_ticks()), new_ticks(ticks)
    for k in range(ticks):
        tick["tick"] = k
        tick["torque_applied_nm"] = 0.01 * k
        backend.read(tick)
        backend.write(tick)
        out[k] = tick[0]
    return out


def readings():
    for (channel, kind), facts in KINDS.items():
        if channel in SAMPLE_CHANNELS and channel not in ("link", "loop"):
            value = 0.0 if kind == "clipped" else {"bits": 8.0, "": None}.get(facts.unit, 0.75)
            yield channel, kind, {} if value is None else {"value": value}


@pytest.mark.parametrize(("channel", "kind", "value"), list(readings()))
def test_a_fault_of_a_sensor_changes_only_its_reading_and_only_while_it_is_due(make, channel, kind, value):
    clean, shown = run(make()), run(make({"channel": channel, "kind": kind, **value}))
    field = {"position": "position_rad", "current": "current_a", "force": "force_n"}[channel]
    changed = np.flatnonzero((shown[field] != clean[field]).any(axis=1)).tolist()
    assert changed == list(range(AT, AT + FOR))
    for name in set(SHOWN) - {field}:
        assert shown[name].tobytes() == clean[name].tobytes()


LINK = {
    "stale": ([AT] * FOR, 0, True),
    "drop": ([AT] * FOR, 0, False),
    "checksum": (range(AT + 1, AT + FOR + 1), LinkFault.CHECKSUM, False),
    "sequence": (range(AT + 1, AT + FOR + 1), LinkFault.SEQUENCE, False),
    "older": (range(AT, AT + FOR), 0, False),
    "lost": ([AT] * FOR, LinkFault.LOST, False),
}


@pytest.mark.parametrize("kind", LINK)
def test_a_fault_of_the_link_changes_counter_and_bits(make, kind):
    counts, bits, lags = LINK[kind]
    shown = run(make({"channel": "link", "kind": kind}))
    after = AT + 1 if lags else AT + FOR + 1
    expected = [*range(1, AT + 1), *counts, *range(after, after + N - AT - FOR)]
    assert shown["sample_count"].tolist() == expected
    assert shown["link_faults"].tolist() == [0] * AT + [bits] * FOR + [0] * (N - AT - FOR)


def test_what_is_sent_to_an_unplugged_playback_does_not_arrive(make):
    backend = make({"channel": "link", "kind": "lost", "for_ticks": 0})
    run(backend)
    assert backend.torque_applied_nm[0] == pytest.approx(0.01 * (AT - 1))


@pytest.mark.parametrize("kind", ["raise_read", "raise_write"])
def test_a_lost_link_is_raised_and_closing_after_it_is_safe(make, kind):
    backend = make({"channel": "link", "kind": kind})
    with pytest.raises(LinkLost, match="scripted fault"):
        run(backend)
    backend.stop()
    backend.close()
    with pytest.raises(LinkLost, match="not open"):
        backend.read(records(new_ticks()))


def test_a_stall_blocks(make, monkeypatch):
    slept = []
    monkeypatch.setattr("hw.fault_script.time.sleep", slept.append)
    run(make({"channel": "loop", "kind": "stall", "value": 2.0, "for_ticks": 1}))
    assert slept == pytest.approx([3.5e-3])


def test_faults_go_on_after_the_end_of_the_log_beside_its_own(make):
    shown = run(make({"channel": "link", "kind": "checksum", "at_tick": N + 2}), N + 8)
    bits = shown["link_faults"][N:].tolist()
    end, both = int(LinkFault.END_OF_LOG), int(LinkFault.END_OF_LOG | LinkFault.CHECKSUM)
    assert bits == [end, end, both, both, both, both, end, end]


def test_chance_follows_the_seed(make):
    flicker = {"channel": "position", "kind": "nan", "at_tick": 0, "for_ticks": 0, "probability": 0.5}
    one, again, other = (np.isnan(run(make(flicker, seed=s))["position_rad"][:, 0]) for s in (1, 1, 2))
    assert one.tolist() == again.tolist() != other.tolist()
    assert 5 < one.sum() < 35


def test_a_reopened_playback_starts_its_schedule_again(make):
    backend = make({"channel": "position", "kind": "nan"})
    first = run(backend)
    backend.close()
    backend.open()
    assert run(backend).tobytes() == first.tobytes()
    assert math.isnan(first["position_rad"][AT, 0])


def test_warming_up_moves_nothing(make):
    backend, other = (make({"channel": "position", "kind": "frozen"}) for _ in range(2))
    assert isinstance(backend, CompiledBackend)
    backend.warm_up(new_ticks())
    assert run(backend).tobytes() == run(other).tobytes()
