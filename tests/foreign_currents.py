"""Current loops of other makes than the mock's: what a drive may do to the torque that it is told.

By first principles in small steps, no line shared with the law, its proofs or the mock: loops of first and
second order, two lags, a PI controller on a winding whose voltage is limited, a dead-beat controller of its
own rate. Times are in ticks, currents in what was sent.
"""

import math
from typing import NamedTuple

import numpy as np

from rtctl.control.jit import compiled

LINEAR, PI, DEADBEAT = range(3)
SUBSTEPS = 100


class Loop(NamedTuple):
    """`lag` and `zeta` of a linear one (infinite: of first order); of a PI controller the rate at which it
    closes (1/`lag`), how much its zero lies beside the winding's pole, the winding's own time and most
    voltage over that of the step; of a dead-beat one the period of its controller.
    """

    kind: int = LINEAR
    delay: float = 0.0
    lag: float = 1.0
    zeta: float = math.inf
    beside: float = 1.0
    winding: float = 10.0
    voltage: float = 10.0
    period: float = 0.25


@compiled
def _linear(wanted, lag, m, out, dt):
    current = rate = 0.0
    for k in range(len(out)):
        if m == 0.0:
            current += (wanted[k] - current) * (1.0 - math.exp(-dt / lag))
        else:
            rate += dt * (wanted[k] - current - lag * rate) / (m * lag * lag)
            current += dt * rate
        out[k] = current


@compiled
def _pi(wanted, lag, beside, winding, most, out, dt):
    current = summed = 0.0
    gain = winding / lag
    for k in range(len(out)):
        error = wanted[k] - current
        asked = gain * error + summed
        volts = min(max(asked, -most), most)
        if volts == asked:
            summed += dt * gain * beside / winding * error
        current += dt * (volts - current) / winding
        out[k] = current


@compiled
def _deadbeat(wanted, period, out, dt):
    begun, aim, seen, since = 0.0, 0.0, 0.0, 0.0
    current = 0.0
    for k in range(len(out)):
        if since <= 0.0:
            begun, aim, seen, since = current, seen, wanted[k], since + period
        since -= dt
        current = begun + (aim - begun) * min(1.0 - since / period, 1.0)
        out[k] = current


def follow(sent, loop, substeps=SUBSTEPS):
    """The current at the end of each of `substeps` parts of every tick."""
    fine, dt = np.repeat(np.asarray(sent, float), substeps), 1.0 / substeps
    late = round(loop.delay * substeps)
    wanted = np.concatenate([np.zeros(late), fine])[: len(fine)]
    out = np.zeros(len(fine))
    if loop.kind == LINEAR:
        # rounding of an explicit step is less than a thousandth where a lag is 20 of them
        _linear(wanted, loop.lag, 0.0 if math.isinf(loop.zeta) else 0.25 / loop.zeta**2, out, dt)
    elif loop.kind == PI:
        most = loop.voltage * float(np.max(np.abs(wanted)))
        _pi(wanted, loop.lag, loop.beside, loop.winding, most, out, dt)
    else:
        _deadbeat(wanted, loop.period, out, dt)
    return out


def overshoot(loop):
    """By what share its current exceeds a step, by a step."""
    out = follow(np.ones(300), loop)
    return max(float(np.max(out)) / float(out[-1]) - 1.0, 0.0)


def pulse(part=20):
    """What arming sends, in pulses."""
    return np.concatenate([np.zeros(part), np.ones(part), -np.ones(part), np.zeros(part)])


def shown(sent, loop, draw, *, pulses=1, noise=0.0, step=0.0, every=1, gain=1.0, offset=0.0):
    """What samples at the ends of ticks show of so many tests: noise, steps of the current, and NaN but in
    every n-th tick.
    """
    clean = gain * follow(sent, loop)[SUBSTEPS - 1 :: SUBSTEPS] + offset
    out = clean + noise * draw.standard_normal((pulses, len(sent)))
    if step > 0.0:
        out = np.round(out / step) * step
    at = np.arange(len(sent)) + draw.integers(every, size=(pulses, 1))
    return np.where(at % every == 0, out, np.nan)
