"""What `rtctl check` makes of a force sensor's own filter, and of what only a joint's bristles hold."""

import dataclasses
import math
from pathlib import Path

import pytest

from hw import registry
from rtctl.check import force_way, verdicts_of_admittance_steps, verdicts_of_friction
from rtctl.check.stability_report import examine
from rtctl.check.verdict import Outcome
from rtctl.rig_file.config import Config, load

CONFIGS = Path(__file__).parents[3] / "configs"
DISPLAY, DISPLAY_SENSOR = "admittance in a hand", "admittance, the force sensor's own filter"
OBSERVER, OBSERVER_SENSOR = "disturbance observer in a hand", "observer, the force sensor's own filter"
COUNT = "admittance, one encoder count"


def checked(name, hz=0.0, late_s=0.0, **changes):
    """Report of the first axis of a shipped rig file with this sensor, and other changes."""
    loaded = load(CONFIGS / f"{name}.toml")
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["axis"][0]["force"] |= {"sensor_lowpass_hz": hz, "sensor_delay_s": late_s}
    table["axis"][0] |= changes
    return examine(loaded.model_copy(update={"config": Config.model_validate(table)})).axes[0]


def rows(*what, **changes):
    return {row.name: row for row in checked(*what, **changes).verdicts}


@pytest.mark.parametrize(
    ("name", "loop", "sensor"),
    [("admittance", DISPLAY, DISPLAY_SENSOR), ("mock", OBSERVER, OBSERVER_SENSOR)],
)
def test_a_loop_counts_on_the_force_sensors_own_filter_and_says_how_slow_it_may_be(name, loop, sensor):
    row = rows(name)[sensor]
    assert row.outcome == Outcome.PASS  # a simulated sensor says that it has none
    assert "no low-pass" in row.meaning
    least_hz = float(row.bound.removeprefix(">= ").removesuffix(" Hz"))
    assert f"holds down to a sensor low-pass of {least_hz:g} Hz" in row.meaning
    assert rows(name, 1.02 * least_hz)[loop].outcome == Outcome.PASS
    assert rows(name, 0.7 * least_hz)[loop].outcome == Outcome.FAIL
    assert rows(name, 5000.0, 0.012)[loop].outcome == Outcome.FAIL


def test_a_force_that_is_late_is_counted_in_whole_ticks_and_what_is_earlier_is_tried():
    axis = checked("admittance", 2000.0, 0.0021)
    assert (axis.loop.sensor_hz, axis.loop.sensor_ticks) == (2000.0, 3)
    assert axis.force_way.said_by == "rig file and device[0] 'mock'"
    tried = force_way.quicker_sensors(axis.loop)
    assert {(one.sensor_hz, one.sensor_ticks) for one in tried} == {
        (hz, ticks) for hz in (0.0, 2000.0) for ticks in range(4)
    } - {(2000.0, 3)}


def test_a_sensor_of_which_nobody_says_what_its_filter_is_is_not_proved(monkeypatch):
    silent = dataclasses.replace(registry.lookup("mock"), force=None)
    monkeypatch.setattr(registry, "lookup", lambda kind: silent)
    row = rows("admittance")[DISPLAY_SENSOR]
    assert (row.outcome, row.figure) == (Outcome.NOT_PROVED, "not declared")
    assert "nobody says" in row.meaning
    assert "force.sensor_lowpass_hz" in row.meaning
    told = rows("admittance", 2000.0)[DISPLAY_SENSOR]
    assert (told.outcome, told.figure) == (Outcome.PASS, "2000 Hz")


def test_a_count_that_only_bristles_hold_is_not_proved_where_a_flicker_is_answered(monkeypatch):
    """Friction of the joint is a spring within its bristles, over many counts, and K_v pushes it by one count a tick."""
    monkeypatch.setattr(verdicts_of_admittance_steps, "holds_flicker", lambda *_: False)
    coarser = {"encoder_counts_per_rev": 120000.0, "dry_friction_nm": 0.2}
    row = rows("admittance", **coarser)[COUNT]
    assert row.outcome == Outcome.NOT_PROVED
    assert "are a spring" in row.meaning
    monkeypatch.undo()
    row = rows("admittance", **coarser)[COUNT]
    assert row.outcome == Outcome.PASS
    assert "does not answer" in row.meaning


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
