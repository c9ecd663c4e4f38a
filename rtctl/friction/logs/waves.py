"""Waves of the torque over the position: cogging of a linear motor over the pitch of its magnets, ripple of a
screw's lead, of a gear or of a belt's teeth.

They belong to no parameter, and of even strokes they are most of what looks like an acceleration. Where they
are plainly there, alike in both directions, they are taken out of balance and points (decision 0131)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.friction.logs.balance import Balance
from rtctl.friction.logs.balance_faults import LEFT_LEAST
from rtctl.friction.logs.dynamics import SAMPLES_MIN, AxisLog
from rtctl.friction.logs.in_place_of_torque import in_place_of_torque
from rtctl.friction.logs.regressors import Regressors

WAVES_LEAST, WAVES_MOST = 4, 200
"""Fewest waves over the whole travel that are told from a spring or gravity, and most that are tried."""

TRIES_A_WAVE = 4
"""Steps of the number of waves in which they are tried."""

# cogging of a pitch made masses 11 to 51 % too large and was told as two clocks (decision 0131)
TAKEN_RATIO = 0.7
"""Share of what is left over, RMS, to which it must fall with the waves."""

CELLS = 4096
"""Cells of the travel in which they are sought first: twenty of the shortest wave."""

ROWS_MOST = 20_000
"""Most rows, of a long log, by which the best of those is told to a hundredth of a wave."""

ALIKE = 0.5
"""Most by which waves may differ between the directions, share of them: a joint that trembles has none that
are alike."""


def without_waves(
    signals: Regressors, logs: Sequence[Sequence[AxisLog]], speed_min_rad_s: float
) -> Regressors:
    """The signals of these logs without the waves that their torque has over the position; their warnings say
    so."""
    balance = Balance.of(signals)
    if min(int((balance.velocity > 0).sum()), int((balance.velocity < 0).sum())) < SAMPLES_MIN:
        return signals  # the fit itself says what is missing
    plain, travel = balance.fit(), float(np.ptp(balance.position))
    # as of any cause that a balance is asked for: friction that is not quite Coulomb + viscous leaves as much
    if plain.rest <= LEFT_LEAST * balance.spread or not travel > 0:
        return signals
    per_travel = _strongest(balance, travel)
    number = 2 * np.pi * per_travel / travel
    # on every row, since later looks take others than the sliding ones
    everywhere = _low_passed(logs, number, signals.cutoff_hz, speed_min_rad_s)
    columns = everywhere[signals.sliding]
    with_waves = balance.fit(added=columns)
    # cogging is of the place and not of the direction; what turns with it is friction by place
    # fitted anew each way, with all of the balance: friction that differs is not to look like waves that do
    ways = [balance.fit(added=columns, rows=balance.velocity * way > 0).added for way in (1, -1)]
    apart, size = (float(np.hypot(*each)) for each in (ways[0][:2] - ways[1][:2], with_waves.added[:2]))
    if with_waves.rest > TAKEN_RATIO * plain.rest or apart > ALIKE * size:
        return signals
    told = (
        f"{signals.source}: the torque has waves over the position, every {travel / per_travel:.3g} rad, of "
        f"{size:.3g} N m and alike in both directions (magnets of a motor, the ripple of a gear or screw, "
        "teeth of a belt): they are taken out of the balance and of the points; a model of them is learned "
        "of a slow two-way sweep (rtctl fit --sweep)"
    )
    return replace(
        signals,
        torque_nm=signals.torque_nm - everywhere @ with_waves.added,
        waves=everywhere,
        warnings=(*signals.warnings, told),
    )


def _strongest(balance: Balance, travel: float) -> float:
    """Number of waves over the travel that explain most of what is left over, to a hundredth."""
    rest, share = balance.residual(), (balance.position - balance.position.min()) / travel
    cells = np.bincount(np.minimum((CELLS * share).astype(int), CELLS - 1), rest, CELLS)
    # padded to four times its length: a pitch between two whole numbers of waves would fall through
    power = np.abs(np.fft.rfft(cells, TRIES_A_WAVE * CELLS))[: WAVES_MOST * TRIES_A_WAVE]
    # a spring, gravity and the drift of an offset are there
    power[: WAVES_LEAST * TRIES_A_WAVE] = 0.0
    fine = (np.argmax(power) + np.linspace(-1, 1, 2 * 100 // TRIES_A_WAVE + 1)) / TRIES_A_WAVE
    every = max(1, len(rest) // ROWS_MOST)
    turn, rest = 2j * np.pi * share[::every], rest[::every]
    return float(fine[np.argmax([abs(complex(np.exp(turn * each) @ rest)) for each in fine])])


def _low_passed(
    logs: Sequence[Sequence[AxisLog]], number: float, cutoff_hz: float, speed_min_rad_s: float
) -> np.ndarray:
    """Sine and cosine of the wave, of its half, and what either becomes by a little more or less pitch, on
    every row, (n, 6): of the position as it was recorded and then through the low-pass, since what that
    leaves goes by how the speed changes and by what the wave itself does to the motion."""
    middle = number * float(np.mean(np.concatenate([one.position_rad for each in logs for one in each])))

    def shapes(turn: np.ndarray) -> tuple[np.ndarray, ...]:
        sine, cosine = np.sin(turn), np.cos(turn)
        return (
            sine,
            cosine,
            np.sin(2 * turn),
            np.cos(2 * turn),
            (turn - middle) * sine,
            (turn - middle) * cosine,
        )

    def passed(which: int) -> np.ndarray:
        return in_place_of_torque(
            logs, lambda log: shapes(number * log.position_rad)[which], cutoff_hz, speed_min_rad_s
        )

    return np.column_stack([passed(which) for which in range(6)])
