"""Whether Coulomb friction is taken off a torque already, as by a drive that compensates it: told by the
turns.

Friction of bristles is continuous: behind a turn it goes from -F to F over the travel that bends them. A
compensation knows the sign of the velocity and no bristles, so that what it takes off turns over at once, and
the torque that is left jumps the wrong way at each turn. In the balance of
`rtctl.friction.logs.reversal_memory`

    tau = J a + b v + (friction of LuGre's bristles of length L, with Stribeck peaks) + c sgn(v) + offset

c is 0 of a joint and -c_0 where c_0 is taken off (docs/theory.md 9.5). A joint whose friction turns over at
once leaves both columns alike, and nothing is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.friction.logs.bristle_columns import by_lugre
from rtctl.friction.logs.dynamics import AxisLog, smooth
from rtctl.friction.logs.reversal_memory import TurnRows, tried_lengths
from rtctl.friction.logs.turns import parts_of

SHARE_LEAST, SHARE_MOST = 0.3, 1.2
"""Shares of the friction that are told as taken off: sound joints of other laws showed .22 at most, and no
drive takes off much more than there is."""

SURELY = 5.0
"""Standard errors by which what is taken off must differ from 0."""

EXPLAINS = 0.6
"""Share of what is left over without it, RMS, that may be left over with it: of 60 joints of other laws
.66 and more was where nothing had been taken off."""

# a warning and no refusal: too little friction told makes less help, not more (decision 0088)
KNOWN = 0.25
"""Share of the friction that is surely not taken off (two standard errors), from which down a log is said to
tell that nothing was."""

CANNOT = (
    "whether a share of the friction is taken off the torque already, as by a drive that compensates it: "
    "the turns of this log do not show it (record brisk turns at 200 Hz and more); map the current or the "
    "torque that the motor made"
)


@dataclass(frozen=True)
class _Found:
    """Torque of the sign, its standard error, friction of the bristles, N m; what is left over with and
    without it, squares."""

    sign_nm: float
    error_nm: float
    friction_nm: float
    left: float
    left_without: float


def taken_off(
    logs: Sequence[AxisLog], cutoff_hz: float, speed_min_rad_s: float, source: str
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Warning that friction is taken off the torque of some logs (or of stretches of them), and what they
    cannot tell of it; each empty or of one text."""
    parts = parts_of(logs, cutoff_hz, speed_min_rad_s)
    lengths = tried_lengths(parts)
    if not len(lengths):
        return (), (CANNOT,)
    # every rung of the memory of a turn asks at the same lengths; the sign is smoothed as they are
    rows = TurnRows.of(parts, sum(part.turns for part in parts))
    signs = [smooth(np.sign(part.motion[:, 1]), part.rate_hz, part.cutoff_hz)[part.rows] for part in parts]
    sign = np.concatenate(signs)
    found = [
        _fitted(rows, np.concatenate([by_lugre(part, length) for part in parts]), sign) for length in lengths
    ]
    # each with the length that suits it: else a wrong length would be mended by the sign
    best, without = min(found, key=lambda one: one.left), min(one.left_without for one in found)
    share = -best.sign_nm / best.friction_nm if best.friction_nm > 0 else np.nan
    # squares are compared with squares
    explains = best.left < EXPLAINS**2 * without
    if explains and SHARE_LEAST < share < SHARE_MOST and -best.sign_nm > SURELY * best.error_nm:
        text = (
            f"{source}: {-best.sign_nm:.3g} N m of the Coulomb friction, {100 * min(share, 1):.0f} % of it, "
            "are taken off this torque already: it jumps the wrong way by as much where the joint turns, "
            "as no friction does (a drive that compensates friction, a command before it is added); "
            f"Coulomb friction would be {best.friction_nm:.3g} N m; map the current or the torque that the "
            "motor made"
        )
        return (text,), ()
    known = abs(share) + 2 * best.error_nm / max(best.friction_nm, 1e-300) < KNOWN
    return (), () if known else (CANNOT,)


def _fitted(rows: TurnRows, friction: np.ndarray, sign: np.ndarray) -> _Found:
    """The balance with friction columns (n, k), forwards and backwards first, with and without the sign of
    the velocity (n,)."""
    motion = np.hstack([rows.motion, rows.offsets])
    plain = np.hstack([motion, friction])
    scale = np.sqrt((plain**2).mean(axis=0)) + np.finfo(float).tiny
    both = np.column_stack([sign, rows.torque_nm])
    # once for both (Frisch, Waugh and Lovell): the sign's coefficient is that of what no other column has
    shared = np.linalg.lstsq(plain / scale, both, rcond=1e-9)[0]
    own, rest = (both - plain / scale @ shared).T
    power = float(own @ own) + np.finfo(float).tiny
    value = float(own @ rest) / power
    left = rest - value * own
    # by blocks of time: rows of one turn are one witness
    error = float(np.sqrt((np.bincount(rows.block, own * left) ** 2).sum())) / power
    # beside the sign: what that takes goes off the bristles' friction
    levels = (shared[:, 1] - value * shared[:, 0]) / scale
    first = motion.shape[1]
    return _Found(
        value, error, float(levels[first : first + 2].mean()), float(left @ left), float(rest @ rest)
    )
