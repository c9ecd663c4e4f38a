"""How often telemetry comes: a world that answers each message with a target must not be near HOLD."""

from pathlib import Path

import pytest

from rtctl.check.law_plan import target_hold_ticks
from rtctl.host.exchange.rig_description import describe, pace
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"


@pytest.mark.parametrize("rate_hz", [100.0, 250.0, 1000.0, 2000.0, 5000.0, 10000.0, 20000.0])
def test_a_message_comes_twice_at_least_within_the_ticks_after_which_the_rig_holds(rate_hz):
    batch_s, state_hz = pace(rate_hz, None, None)
    assert batch_s * rate_hz <= target_hold_ticks(rate_hz) / 2
    assert rate_hz / state_hz <= target_hold_ticks(rate_hz) / 2


@pytest.mark.parametrize("rate_hz", [100.0, 1000.0, 5000.0, 20000.0])
def test_messages_stay_few_enough_for_the_host(rate_hz):
    batch_s, state_hz = pace(rate_hz, None, None)
    assert 2e-3 <= batch_s <= 20e-3
    assert state_hz <= 500.0


def test_what_the_rig_file_says_counts():
    assert pace(1000.0, 50.0, 10.0) == (0.05, 10.0)
    assert pace(1000.0, 50.0, None) == (0.05, 100.0)


def test_a_shipped_rig_file_has_the_default():
    rig = describe(load(CONFIGS / "mock.toml"))
    assert (rig.batch_s, rig.state_hz) == (0.008, 125.0)
