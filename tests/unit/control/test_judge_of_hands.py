"""What `rtctl campaign --admittance` takes for a ring that dies away."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.control.vocabulary import State
from rtctl.simulation import campaign_in_hands

PERIOD_S = 1e-3


def rests(hz, phase, decay_s):
    """The verdict on a ring that is the last that moves."""
    t = np.arange(0, campaign_in_hands.REST_S, PERIOD_S)
    speed = 0.1 * np.exp(-t / decay_s) * np.sin(2 * np.pi * hz * t + phase)
    columns = np.zeros((len(t), 1))
    truth = {"velocity_rad_s": speed[:, None], "position_rad": columns}
    made = SimpleNamespace(
        run=lambda _: {"state": np.full(len(t), State.ACTIVE)},
        plan=SimpleNamespace(period_s=PERIOD_S),
        truth=truth,
    )
    rig = SimpleNamespace(index=0, plant="", compensation=0.0)
    return campaign_in_hands._judged(rig, None, made, campaign_in_hands.REST_S).rests


@pytest.mark.parametrize("hz", [0.5, 0.9, 3.1])
def test_a_ring_that_stays_does_not_rest_in_any_phase_and_one_that_dies_away_does(hz):
    phases = np.linspace(0, np.pi, 40)
    assert not any(rests(hz, phase, np.inf) for phase in phases)
    assert all(rests(hz, phase, 5.0) for phase in phases)


def test_what_is_not_a_number_does_not_rest():
    assert not rests(np.nan, 0.0, np.inf)
