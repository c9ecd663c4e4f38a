"""The playback backend keeps the contract of a backend and gives the log back sample by sample."""

import numpy as np
import pytest

from hw import registry
from hw.interface import BackendError, LinkFault, LinkLost, Rig
from hw.playback.backend import PlaybackBackend, tip_force
from hw.playback.options import PlaybackOptions
from rtctl.control.jit import records
from rtctl.tick import new_ticks

N = 20


def rig(rate_hz=1000.0, lever=((0.0, 0.1, 0.0),)):
    n = len(lever)
    return Rig(
        n_axes=n,
        period_s=1 / rate_hz,
        gear_ratio=np.full(n, 80.0),
        gear_efficiency=np.full(n, 0.75),
        torque_constant_nm_a=np.full(n, 0.02),
        encoder_counts_per_rev=np.full(n, 160_000.0),
        lever_m=np.array(lever),
    )


def make(folder, *, of=None, **more):
    lines = [f"{k / 1000!r},{0.01 * k!r},{0.1 * k!r},{-0.05 * k!r}" for k in range(N)]
    (folder / "log.csv").write_text("t,x,q,h\n" + "\n".join(lines) + "\n")
    axis = {"position": {"column": "x"}, "motor_torque": {"column": "q"}, "hand_torque": {"column": "h"}}
    table = {"file": "log.csv", "time": {"column": "t"}, "axis": [axis], **more}
    valid = PlaybackOptions.model_validate(table, context={"folder": folder}).model_dump(mode="json")
    return PlaybackBackend(valid, of or rig())


def test_every_sample_arrives_once_in_order_with_torques_as_current_and_tip_force(tmp_path):
    backend = make(tmp_path)
    backend.open()
    tick = records(new_ticks())
    for k in range(N):
        backend.read(tick)
        assert tick["sample_count"][0] == k + 1
        assert tick["link_faults"][0] == 0
        assert tick["position_rad"][0, 0] == 0.01 * k
        assert tick["current_a"][0, 0] * 80 * 0.75 * 0.02 == pytest.approx(0.1 * k, rel=1e-14, abs=1e-300)
        assert tick["force_n"][0] @ [0.0, 0.1, 0.0] == pytest.approx(-0.05 * k, rel=1e-14, abs=1e-300)


def test_after_the_last_sample_the_count_stands_and_the_end_is_a_link_fault(tmp_path):
    backend = make(tmp_path)
    backend.open()
    tick = records(new_ticks())
    for _ in range(N):
        backend.read(tick)
    for _ in range(3):
        backend.read(tick)
        assert tick["link_faults"][0] == int(LinkFault.END_OF_LOG)
        assert tick["sample_count"][0] == N
        assert tick["position_rad"][0, 0] == 0.01 * (N - 1)


def test_a_repeated_log_goes_on_where_it_ended_and_never_ends(tmp_path):
    backend = make(tmp_path, loop=True)
    backend.open()
    tick = records(new_ticks())
    seen = []
    for _ in range(3 * N):
        backend.read(tick)
        assert tick["link_faults"][0] == 0
        seen.append(tick["position_rad"][0, 0])
    assert tick["sample_count"][0] == 3 * N
    assert np.abs(np.diff(seen)).max() <= 0.01 + 1e-12
    assert seen[N] == pytest.approx(seen[N - 1])
    assert seen[-1] == pytest.approx(3 * 0.01 * (N - 1))


def test_opening_again_after_closing_starts_from_the_first_sample(tmp_path):
    backend = make(tmp_path)
    tick = records(new_ticks())
    backend.open()
    for _ in range(N + 1):
        backend.read(tick)
    backend.open()  # idempotent: the position in the log stays
    backend.read(tick)
    assert tick["link_faults"][0] == int(LinkFault.END_OF_LOG)
    backend.close()
    backend.close()
    backend.open()
    backend.read(tick)
    assert (tick["sample_count"][0], tick["position_rad"][0, 0], tick["link_faults"][0]) == (1, 0.0, 0)


def test_a_closed_backend_reports_the_link_as_lost_and_stop_never_raises(tmp_path):
    backend = make(tmp_path)
    tick = records(new_ticks())
    backend.stop()
    with pytest.raises(LinkLost):
        backend.read(tick)
    backend.open()
    backend.read(tick)
    backend.close()
    backend.stop()
    with pytest.raises(LinkLost):
        backend.read(tick)
    with pytest.raises(LinkLost):
        backend.write(tick)


def test_write_keeps_the_applied_torque_and_stop_forgets_it(tmp_path):
    backend = make(tmp_path)
    backend.open()
    tick = records(new_ticks())
    tick["torque_applied_nm"][0, 0] = 0.125
    backend.write(tick)
    assert backend.torque_applied_nm.tolist() == [0.125]
    backend.stop()
    assert backend.torque_applied_nm.tolist() == [0.0]


def test_another_tick_array_gets_the_next_sample_too(tmp_path):
    backend = make(tmp_path)
    backend.open()
    first, second = records(new_ticks()), records(new_ticks())
    backend.read(first)
    backend.read(second)
    backend.read(first)
    assert second["sample_count"][0] == 2
    assert first["position_rad"][0, 0] == 0.02


@pytest.mark.parametrize("rate_hz", [980.0, 1020.0, 2000.0])
def test_a_log_of_another_rate_is_refused_naming_both(tmp_path, rate_hz):
    backend = make(tmp_path, of=rig(rate_hz))
    with pytest.raises(BackendError, match=rf"sampled at 1000 Hz.*runs at {rate_hz:g} Hz.*rate_hz = 1000"):
        backend.open()


def test_a_rate_within_one_percent_is_taken(tmp_path):
    make(tmp_path, of=rig(995.0)).open()


def test_only_mapped_channels_are_provided_and_the_others_read_zero(tmp_path):
    backend = make(tmp_path, axis=[{"position": {"column": "x"}}])
    assert backend.provides == {"position"}
    assert make(tmp_path).provides == {"position", "current", "force"}
    backend.open()
    tick = records(new_ticks())
    tick["current_a"], tick["force_n"] = 3.0, 3.0
    backend.read(tick)
    assert not tick["current_a"].any()
    assert not tick["force_n"].any()


def test_force_columns_reach_the_tick_unchanged(tmp_path):
    force = [{"column": "x"}, {"column": "q", "scale": -1.0}, {"column": "h"}]
    backend = make(tmp_path, axis=[{"position": {"column": "x"}}], force=force)
    backend.open()
    tick = records(new_ticks())
    backend.read(tick)
    backend.read(tick)
    np.testing.assert_allclose(tick["force_n"][0], [0.01, -0.1, -0.05])


def test_the_tip_force_gives_the_torques_back_on_skew_levers():
    generator = np.random.default_rng(1)
    lever = generator.normal(size=(2, 3))
    torque = generator.normal(size=(7, 2))
    np.testing.assert_allclose(tip_force(torque, lever) @ lever.T, torque, rtol=1e-12)


@pytest.mark.parametrize("lever", [[[0, 0.1, 0], [0, 0.2, 0]], np.ones((4, 3)).tolist()])
def test_levers_that_cannot_produce_the_torques_are_refused(lever):
    with pytest.raises(BackendError, match="independent torques"):
        tip_force(np.zeros((3, len(lever))), np.array(lever))


def test_the_registry_makes_it_from_validated_options(tmp_path):
    options = make(tmp_path)._options
    assert isinstance(registry.create("playback", options, rig()), PlaybackBackend)
    assert registry.options_model("playback") is PlaybackOptions


@pytest.mark.compiled
@pytest.mark.parametrize("loop", [False, True])
def test_the_compiled_halves_show_and_keep_the_same(tmp_path, loop):
    backends = [make(tmp_path, loop=loop) for _ in range(2)]
    for backend in backends:
        backend.open()
    ticks = [new_ticks(1, 1) for _ in backends]
    parts = backends[1].compiled_cycle(ticks[1])
    assert parts is not None
    for k in range(2 * len(backends[0].recording) + 3):
        for tick in ticks:
            tick["torque_applied_nm"] = 0.01 * k
        backends[0].read(ticks[0])
        backends[0].write(ticks[0])
        assert parts.read(*parts.read_arguments) == parts.write(*parts.write_arguments) == 0
        assert ticks[0].tobytes() == ticks[1].tobytes()
        assert np.array_equal(backends[0].torque_applied_nm, backends[1].torque_applied_nm)
    backends[1].close()
    assert parts.read(*parts.read_arguments) == 1, "left to Python, which says that it is not open"
    assert parts.write(*parts.write_arguments) == 1
