"""Plants of the tests of the mock's effects: a torque over time without a controller, and the truth behind
it.
"""

import math

import numpy as np
from hardware import rig

from hw.simulators import mock_hand
from hw.simulators.jit import compiled, records
from hw.simulators.mock_options import MockOptions
from hw.simulators.mock_plant import advance
from hw.simulators.mock_records import plant_records

PER_A = 80 * 0.72 * 0.0134


def plant(period_s=1e-3, **options):
    """Parameters and state of the rig that these options describe."""
    dumped = MockOptions.model_validate(options).model_dump(mode="json")
    params, state = plant_records(dumped, rig(period_s=period_s))
    return records(params), records(state)


@compiled
def _march(state, params, torques, per_a, out):
    s, p = state[0], params[0]
    s.hand_position_rad[0], s.hand_velocity_rad_s[0] = mock_hand.wanted(0.0, p, 0)
    for k in range(len(torques)):
        s.held_ticks = 0
        s.current_line_a[0, 0] = torques[k] / per_a
        advance(s, p, 1, p.substeps)
        out[k] = state[0]


def march(params, state, torques):
    """The states after each period under these motor torques, N m."""
    out = records(np.zeros(len(torques), state.dtype))
    _march(state, params, np.asarray(torques, float), PER_A, out)
    return out


def truth(states, name):
    return np.asarray(states[name])[:, 0]


def sine(amplitude_nm, frequency_hz, seconds, period_s=1e-3, offset_nm=0.0):
    """A torque over time, N m."""
    t = np.arange(round(seconds / period_s)) * period_s
    return offset_nm + amplitude_nm * np.sin(2 * math.pi * frequency_hz * t)
