"""What `rtctl check` makes of a force sensor's own filter, and of what only a joint's bristles hold."""

import dataclasses
import math
import re
from pathlib import Path

import pytest

from hw import registry
from rtctl.check import (
    force_way,
    law_plan,
    observer_tuning,
    stability_report,
    verdicts_of_admittance_steps,
    verdicts_of_friction,
    verdicts_of_observer,
)
from rtctl.check.stability_report import examine
from rtctl.check.verdict import Outcome
from rtctl.control.proofs import admittance_margin
from rtctl.control.proofs.less_late import quicker_sensors
from rtctl.rig_file.config import Config, load
from rtctl.simulation.family import with_plant

CONFIGS = Path(__file__).parents[3] / "configs"
DISPLAY, DISPLAY_SENSOR = "admittance in a hand", "admittance, the force sensor's own filter"
OBSERVER, OBSERVER_SENSOR = "disturbance observer in a hand", "observer, the force sensor's own filter"
HUNTS = "admittance, hunting about a count"


def with_sensor(name, hz=0.0, late_s=0.0, **changes):
    """A shipped rig file with this sensor on its first axis, and other changes."""
    loaded = load(CONFIGS / f"{name}.toml")
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["axis"][0]["force"] |= {"sensor_lowpass_hz": hz, "sensor_delay_s": late_s}
    table["axis"][0] |= changes
    return loaded.model_copy(update={"config": Config.model_validate(table)})


def checked(*what, telling=False, **changes):
    """Report of the first axis of that; `telling`: with what refuses nothing and takes long."""
    return examine(with_sensor(*what, **changes), telling=telling).axes[0]


def rows(*what, telling=False, **changes):
    return {row.name: row for row in checked(*what, telling=telling, **changes).verdicts}


@pytest.mark.parametrize(
    ("name", "loop", "sensor"),
    [("admittance", DISPLAY, DISPLAY_SENSOR), ("mock", OBSERVER, OBSERVER_SENSOR)],
)
def test_a_loop_counts_on_the_force_sensors_own_filter_and_says_how_slow_it_may_be(name, loop, sensor):
    axis = checked(name, telling=name == "mock")
    row = {one.name: one for one in axis.verdicts}[sensor]
    assert row.outcome == Outcome.PASS  # a simulated sensor says that it has none
    assert "no low-pass" in row.meaning
    least_hz = float(row.bound.removeprefix(">= ").removesuffix(" Hz"))
    assert f"holds down to a sensor low-pass of {least_hz:g} Hz" in row.meaning
    assert rows(name, 1.02 * least_hz)[loop].outcome == Outcome.PASS
    if name == "admittance":
        for slower in ({"sensor_hz": 0.7 * least_hz}, {"sensor_hz": 5000.0, "sensor_ticks": 4}):
            assert not admittance_margin.judge(dataclasses.replace(axis.loop, **slower)).ok


def test_the_loops_that_are_judged_have_the_force_sensors_own_filter(monkeypatch):
    shown = stability_report.admittance_loop(with_sensor("admittance", 300.0, 0.002), 0)
    assert (shown.sensor_hz, shown.sensor_ticks) == (300.0, 2)
    seen = []

    def judged(loop):
        seen.append(loop)
        return observer_tuning.judged(loop)

    monkeypatch.setattr(verdicts_of_observer, "judged", judged)
    checked("mock", 300.0, 0.002)
    assert (seen[0].sensor_hz, seen[0].sensor_ticks) == (300.0, 2)


@pytest.mark.parametrize(
    ("hz", "late_s"), [(0.0, 0.002), (150.0, 1 / 333 + 0.00016), (30.0, 0.0), (500.0, 0.012)]
)
def test_an_observer_goes_by_a_sensor_that_is_late_and_passes(hz, late_s):
    axis = checked("mock", hz, late_s, telling=True)
    found = {row.name: row for row in axis.verdicts}
    assert axis.ok
    assert found[OBSERVER].outcome == Outcome.PASS
    assert axis.observer.own_ticks > 0 or axis.observer.excess > 0 or axis.observer.bandwidth_hz < 20
    meaning, own = found[OBSERVER_SENSOR].meaning, axis.observer.own_ticks
    assert (f"torque and velocity are taken of {own} ticks before" in meaning) == (own > 0)
    assert ("the inertia" in meaning) == (axis.observer.excess > 0)
    assert ("Hz for it (20 without)" in meaning) == (axis.observer.bandwidth_hz < 20)


@pytest.mark.parametrize(("hz", "late_s"), [(0.0, 0.004), (150.0, 0.004), (500.0, 0.006)])
def test_the_default_observer_of_an_elastic_joint_passes_behind_a_late_sensor(hz, late_s):
    loaded = with_plant(with_sensor("mock", hz, late_s), "harmonic-drive")
    axis = examine(loaded, telling=False).axes[0]
    assert {row.name: row for row in axis.verdicts}[OBSERVER].outcome == Outcome.PASS
    assert axis.observer.bandwidth_hz >= 15.0


def observer_of(hz, late_s, **observer):
    """Rows and figures of the shipped mock with this sensor and other keys of its observer."""
    friction = load(CONFIGS / "mock.toml").config.model_dump(mode="json", by_alias=True)["axis"][0][
        "friction"
    ]
    friction["observer"] |= observer
    return checked("mock", hz, late_s, friction=friction)


def test_a_bandwidth_that_is_named_is_kept_and_refused_where_it_is_too_much():
    axis = observer_of(0.0, 0.008, bandwidth_hz=20.0)
    row = {one.name: one for one in axis.verdicts}[OBSERVER]
    assert axis.observer.bandwidth_hz == 20.0
    assert row.outcome == Outcome.FAIL
    refusals = " ".join(one.refusal for one in axis.verdicts)
    remedy = min(map(float, re.findall(r"bandwidth_hz = ([\d.]+)(?: at this gain|,)", refusals)))
    assert observer_of(0.0, 0.008, bandwidth_hz=remedy).ok
    assert observer_of(0.0, 0.002, bandwidth_hz=15.0).observer.bandwidth_hz == 15.0
    assert observer_of(0.0, 0.002, gain=0.0).observer.own_ticks == 0


def test_an_observer_is_judged_with_quicker_sensors_too(monkeypatch):
    """Delayed by all that a sensor of two ticks may be late it passes behind that one, and shakes a stiff
    hand behind a quick one.
    """
    tuned = observer_tuning.Tuning(20.0, own_ticks=2, usual_hz=20.0)
    monkeypatch.setattr(observer_tuning, "of_axis", lambda *_: tuned)
    row = rows("mock", 0.0, 0.002)[OBSERVER]
    assert row.outcome == Outcome.FAIL
    assert "600 N m/rad" in row.meaning


def test_law_and_check_go_by_the_same_observer():
    loaded = with_plant(with_sensor("mock", 150.0, 0.004), "harmonic-drive")
    axis, p = examine(loaded, telling=False).axes[0], law_plan.build(loaded).params[0]
    assert p["observer_late_ticks"][0] == axis.observer.own_ticks > 0
    assert p["observer_excess"][0] == axis.observer.excess > 0
    assert p["observer_bandwidth_rad_s"][0] == 2 * math.pi * axis.observer.bandwidth_hz
    bare = law_plan.build(with_sensor("mock")).params[0]
    assert bare["observer_late_ticks"][0] == bare["observer_excess"][0] == 0


def test_an_admittance_is_not_refused_for_an_observer_that_sends_nothing_there():
    friction = load(CONFIGS / "admittance.toml").config.model_dump(mode="json", by_alias=True)["axis"][0][
        "friction"
    ]
    wild = {**friction["observer"], "gain": 0.98, "bandwidth_hz": 200.0}
    axis, usual = checked("admittance", friction={**friction, "observer": wild}), checked("admittance")
    assert axis.loop == usual.loop
    assert [row.name for row in axis.verdicts] == [row.name for row in usual.verdicts]
    assert not [row for row in axis.verdicts if "observer" in row.name]
    assert axis.ok


def test_a_force_that_is_late_is_counted_in_whole_ticks_and_what_is_earlier_is_tried():
    axis = checked("admittance", 2000.0, 0.0021)
    assert (axis.loop.sensor_hz, axis.loop.sensor_ticks) == (2000.0, 3)
    assert axis.force_way.said_by == "rig file and device[0] 'mock'"
    tried = quicker_sensors(axis.loop)
    assert {(one.sensor_hz, one.sensor_ticks) for one in tried} == {
        (hz, ticks) for hz in (0.0, 2000.0) for ticks in range(4)
    } - {(2000.0, 3)}


def test_a_force_is_as_late_as_the_samples_of_its_device_may_be():
    """800 samples a second under a loop of 1 kHz are up to two ticks old, whatever low-pass is told."""
    loaded = load(CONFIGS / "drive-and-force-sensor.toml")
    assert force_way.of_axis(loaded, 0).ticks == 0, "nobody says anything: nothing is counted on"
    axis = loaded.config.axis[0]
    for late_s, ticks in ((0.0, 2), (0.0015, 2), (0.0042, 5)):
        told = axis.force.model_copy(update={"sensor_lowpass_hz": 300.0, "sensor_delay_s": late_s})
        config = loaded.config.model_copy(update={"axis": (axis.model_copy(update={"force": told}),)})
        way = force_way.of_axis(loaded.model_copy(update={"config": config}), 0)
        assert (way.sensor_hz, way.ticks, way.said_by) == (300.0, ticks, "rig file")


def test_a_sensor_of_which_nobody_says_what_its_filter_is_is_not_proved(monkeypatch):
    silent = dataclasses.replace(registry.lookup("mock"), force=None)
    monkeypatch.setattr(registry, "lookup", lambda kind: silent)
    row = rows("admittance")[DISPLAY_SENSOR]
    assert (row.outcome, row.figure) == (Outcome.NOT_PROVED, "not declared")
    assert "nobody says" in row.meaning
    assert "force.sensor_lowpass_hz" in row.meaning
    told = rows("admittance", 2000.0)[DISPLAY_SENSOR]
    assert (told.outcome, told.figure) == (Outcome.PASS, "2000 Hz")


def test_a_count_that_only_bristles_hold_is_refused_where_a_flicker_is_answered(monkeypatch):
    """Friction of the joint is a spring within its bristles, over many counts, and K_v pushes it by one count
    a tick.
    """
    coarser = {"encoder_counts_per_rev": 120000.0, "dry_friction_nm": 0.2}
    found = rows("admittance", telling=True, **coarser)
    asked = rows("admittance", **coarser)
    assert found.keys() - asked.keys() == {"admittance, creep among counts"}
    assert not found["admittance, creep among counts"].refusal
    assert found[HUNTS].outcome == Outcome.PASS
    assert "is not answered" in found[HUNTS].meaning
    creeps = found["admittance, creep among counts"]
    assert creeps.outcome == Outcome.NOT_PROVED
    assert "encoder_counts_per_rev" in creeps.meaning
    monkeypatch.setattr(verdicts_of_admittance_steps, "holds_flicker", lambda *_: False)
    row = rows("admittance", **coarser)[HUNTS]
    assert row.outcome == Outcome.FAIL
    assert "encoder_counts_per_rev" in row.refusal
    assert float(row.figure.split()[0]) <= float(creeps.figure.split()[0])


def test_a_slow_sensor_narrows_the_intent_that_settles():
    """The roots of the loop with and without it, by hand."""
    bound = verdicts_of_friction._late_bound_hz
    for late, sensor_hz in ((0, 0.0), (2, 0.0), (0, 40.0), (3, 80.0)):
        hz, kept = (
            bound(6.0, late, 1e-3, sensor_hz),
            math.exp(-2 * math.pi * sensor_hz * 1e-3) if sensor_hz else 0.0,
        )

        def settles(hz, late=late, kept=kept):
            take, hand, sent, sensed = 1 - math.exp(-2 * math.pi * hz * 1e-3), 1.0, [0.0] * (late + 1), 1.0
            for _ in range(4000):
                sensed = kept * sensed + (1 - kept) * -6.0 * sent[-1]
                hand += take * (sensed - hand)
                sent = [hand, *sent[:-1]]
            return abs(hand) < 1.0

        assert settles(0.98 * hz), (late, sensor_hz)
        assert hz == math.inf or not settles(1.05 * hz), (late, sensor_hz)


def test_who_asks_for_a_refusal_alone_gets_the_same_one_without_the_search_for_a_slower_sensor():
    for stiffness_nm_rad in (10.0, 1e4):
        loaded = with_sensor("mock", coupling={"stiffness_nm_rad": stiffness_nm_rad, "damping_nms_rad": 0.01})
        whole, asked = examine(loaded), examine(loaded, telling=False)
        assert asked.refusal() == whole.refusal()
        assert asked.ok == (stiffness_nm_rad == 10.0)
        assert {row.name for row in whole.verdicts} - {row.name for row in asked.verdicts} == {
            OBSERVER_SENSOR
        }
