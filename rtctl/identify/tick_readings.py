"""What the ticks say: is the motion steady, where did the joint break away, what was the friction."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.identify.late_ticks import on_every_slot, ran_late
from rtctl.identify.ticks import mean_c

BLOCKS = 8
"""Blocks into which a window is averaged before its slope is tested: the servo's chatter averages out."""
STEADY_SHARE = 0.01
"""Change of the mean torque over the window, share of the torque, that still counts as steady."""
SPEED_SHARE = 0.03
UNEVEN_SHARE = 0.5  # a joint that jumps from count to count rests in between
"""A block of the window that is further off the wanted speed than this share is stick-slip."""
DRIFTED_SHARE = 0.1
MOVING_COUNTS = 8
MOVING_RAD = 3e-4
LOOK_BACK_S = 0.01
"""Break-away: this many counts within this time, and this travel, mean that the joint slides.

Counts alone would find a fine encoder's joint sliding while its bristles still bend: a ramp of slope r on
bristles of stiffness s0 creeps at r / s0 / (1 - u) where it is the share u of the break-away torque."""
PEAK_S = 0.02
"""Break-away: least length of the windows through which the joint's acceleration is seen."""
PEAK_NOISE_SHARE = 0.003
"""Most that the encoder's steps may make of the break-away torque: with a coarse one windows are longer."""
PEAK_MOST_S = 0.3
"""Longest window, and how long before the slide the peak is looked for."""
REST_RMS = math.sqrt(0.5) / 1.5
"""Most RMS of the swing that the torque alone makes, share of the speed: two thirds of that of a sine that
just comes to rest.

Bristles are a spring beside the inertia, and near their own frequency the true swing is larger: joints of .46
were .8 % off, of .50 10 %."""


def is_steady(
    position_rad: np.ndarray,
    torque_nm: np.ndarray,
    period_s: float,
    speed_rad_s: float,
    count_rad: float,
    *,
    change_nm: float = 0.0,
    speed_share: float = 0.0,
    pairs: bool = False,
) -> bool:
    """True when neither torque nor speed still changes over the window, and the speed is the wanted one.

    Parameters
    ----------
    position_rad, torque_nm : array, shape (n,)
        At least 16 consecutive ticks.
    speed_rad_s : float
        Wanted speed, signed.
    change_nm, speed_share : float
        Change of torque and of speed (share) that a ripple alone may make over the window.
    pairs : bool
        The window holds an even number of periods of a ripple: its halves are compared, phase by phase.

    Notes
    -----
    A straight line through the means of 8 blocks. Its rise over the window must be at most 1 % of the
    torque or within twice its own standard error, and that error itself at most 3 % (a window too noisy to
    tell is not steady). No block may be slower than half the wanted speed or quicker than one and a half of
    it: that is stick-slip, whatever the mean. NaN is never steady."""
    n = len(torque_nm) // BLOCKS * BLOCKS
    if n < 2 * BLOCKS:
        return False
    level, rise, error = _trend(torque_nm, pairs=pairs)
    # a ripple that the window cannot tell from a drift is no unsteadiness
    tolerance = STEADY_SHARE * abs(level) + change_nm
    window_s = (len(position_rad) - 1) * period_s
    speed = float(position_rad[-1] - position_rad[0]) / window_s
    # two counts: either end of the way may be a count off
    slack = (SPEED_SHARE + speed_share) * abs(speed_rad_s) + 2 * count_rad / window_s
    return (
        abs(rise) <= max(tolerance, 2 * error)
        and error <= 3 * tolerance
        and abs(speed - speed_rad_s) <= slack
        and is_even(position_rad, period_s, speed_rad_s, count_rad, speed_share)
    )


def is_even(
    position_rad: np.ndarray, period_s: float, speed_rad_s: float, count_rad: float, speed_share: float = 0.0
) -> bool:
    """False for stick-slip: an eighth of the window off the speed by half, or the whole by `DRIFTED_SHARE`.

    `speed_share` is what a ripple alone may do to the speed. NaN is not even."""
    window_s = (len(position_rad) - 1) * period_s
    edges = position_rad[np.linspace(0, len(position_rad) - 1, BLOCKS + 1).astype(int)]
    off = np.abs(np.diff(edges) - speed_rad_s * window_s / BLOCKS)
    whole = abs(float(edges[-1] - edges[0]) - speed_rad_s * window_s)
    wanted = abs(speed_rad_s) * window_s
    return bool(
        np.all(off <= (UNEVEN_SHARE + speed_share) * wanted / BLOCKS + 2 * count_rad)
        and whole <= (DRIFTED_SHARE + speed_share) * wanted + 2 * count_rad
    )


def stops_and_starts(torque_nm: np.ndarray, period_s: float, speed_rad_s: float, inertia_kgm2: float) -> bool:
    """True where the torque swings so much that the joint must rest in between: too quick for the blocks.

    Notes
    -----
    What the torque has beside its mean over an eighth of the window accelerates the joint. A sine of speed
    that just reaches 0 has an RMS of sqrt(1/2) of the mean speed; two thirds of it are allowed (`REST_RMS`).
    The friction of such a motion is no friction at its mean speed: a joint that jumped from count to count
    had up to 55 % less, one of 2e-6 kg m^2 that seemed to swing by .7 to .9 of it 7 to 10 %. NaN stops."""
    block = max(2, len(torque_nm) // BLOCKS)
    if len(torque_nm) < 2 * block:
        return False  # so few ticks show no swing
    swing_rad_s = _beside(np.cumsum(_beside(torque_nm, block)), block) * period_s / inertia_kgm2
    return not float(np.sqrt(np.mean(swing_rad_s**2))) < REST_RMS * abs(speed_rad_s)


def _beside(values: np.ndarray, block: int) -> np.ndarray:
    """What these values have beside their mean over `block` of them around each, where there are so many."""
    mean = np.convolve(values, np.full(block, 1.0 / block), "valid")
    beside: np.ndarray = values[block // 2 :][: len(mean)] - mean
    return beside


def _trend(torque_nm: np.ndarray, *, pairs: bool) -> tuple[float, float, float]:
    """Mean of the torque, its rise over the window, and the rise's standard error."""
    half = len(torque_nm) // (2 * BLOCKS) * BLOCKS
    if pairs:
        change = torque_nm[-half:] - torque_nm[-2 * half : -half]
        blocks = change.reshape(BLOCKS, -1).mean(axis=1)
        # twice: the halves are half a window apart, the rise is over all of it
        error = 2.0 * float(np.std(blocks, ddof=1)) / np.sqrt(BLOCKS)
        return float(np.mean(torque_nm[-2 * half :])), 2.0 * float(np.mean(change)), error
    n = len(torque_nm) // BLOCKS * BLOCKS
    means = torque_nm[-n:].reshape(BLOCKS, -1).mean(axis=1)
    level = float(np.mean(means))
    x = (np.arange(BLOCKS) - 0.5 * (BLOCKS - 1)) / BLOCKS
    rise = float(x @ means / (x @ x))
    residual = means - level - rise * x
    return level, rise, float(np.sqrt(residual @ residual / (BLOCKS - 2) / (x @ x)))


@dataclass(frozen=True)
class Measurement:
    """One measurement: means over one window (break-away: just before the slip).

    `time_s` is the middle of the window on the loop's clock; `first_tick` and `ticks` say which ticks it is.
    """

    torque_nm: float
    velocity_rad_s: float
    acceleration_rad_s2: float
    hand_torque_nm: float
    force_n: tuple[float, float, float]
    temperature_c: float | None
    """None: the rig has no thermometer."""
    position_rad: float
    time_s: float
    first_tick: int
    ticks: int
    cogging_nm: float = 0.0
    """What was taken off `torque_nm` as cogging at this place, along +x."""


def measure(rows: np.ndarray, axis: int, period_s: float, inertia_kgm2: float, bias_nm: float) -> Measurement:
    """Friction over one window of steady motion.

    Notes
    -----
    friction = motor torque - bias - J a, with velocity and acceleration from the parabola that fits the
    positions best. J a is small when the motion is steady, and has no error of its own worth naming."""
    position = rows["position_rad"][:, axis]
    # by slots, not rows: what was left out passed all the same
    t = (rows["tick"] - np.mean(rows["tick"])) * period_s
    square = t * t - np.mean(t * t)
    # slots that were left out make the times lopsided: without this a speed looks like an acceleration
    square -= t * (t @ square / (t @ t))
    velocity = float(t @ position / (t @ t))
    acceleration = 2.0 * float(square @ position / (square @ square))
    torque = float(np.mean(rows["motor_torque_nm"][:, axis])) - bias_nm - inertia_kgm2 * acceleration
    return _measurement(rows, axis, torque, velocity, acceleration)


def _measurement(rows: np.ndarray, axis: int, torque: float, v: float, a: float) -> Measurement:
    force = rows["force_n"].mean(axis=0)
    return Measurement(
        torque_nm=torque,
        velocity_rad_s=v,
        acceleration_rad_s2=a,
        hand_torque_nm=float(np.mean(rows["hand_torque_nm"][:, axis])),
        force_n=(float(force[0]), float(force[1]), float(force[2])),
        temperature_c=mean_c(rows["temperature_c"][:, axis]),
        position_rad=float(np.mean(rows["position_rad"][:, axis])),
        time_s=0.5e-9 * (int(rows["time_ns"][0]) + int(rows["time_ns"][-1])),
        first_tick=int(rows["tick"][0]),
        ticks=len(np.unique(rows["tick"])),
    )


def break_away_row(position_rad: np.ndarray, look_back: int, moving_rad: float) -> int:
    """Row where the last slide began: `look_back` rows before the first that moved `moving_rad` since.

    A lurch that comes to rest again (gear play, the start of a ramp) is no break-away. Returns -1 when the
    joint does not slide at the end, or was never at rest before."""
    moved = np.abs(position_rad[look_back:] - position_rad[:-look_back]) >= moving_rad
    if not moved[-1] or moved.all():
        return -1
    began = len(moved) - int(np.argmin(moved[::-1]))
    return began if began > look_back else -1


def rows_before_seen(position_rad: np.ndarray, seen: int, look_back: int) -> int:
    """Rows by which the middle of the `look_back` rows before row `seen` lies behind the moment when the
    slide began; 0: before it.

    Notes
    -----
    A joint with much damping does not jump: it slides ever faster, and long before its speed tells it. The
    parabola through the second half of its way, where no bristles bend any more, tells when it would have
    stood still. NaN is 0."""
    way_rad = np.abs(position_rad - position_rad[0])
    half = np.flatnonzero(way_rad >= 0.5 * way_rad[-1])
    if len(half) < look_back:
        return 0
    rows = np.arange(half[0], len(position_rad))
    bend, speed = (float(one) for one in np.polyfit(rows - seen, position_rad[rows], 2)[:2])
    if not bend * speed > 0.0:
        return 0
    return max(0, round(0.5 * speed / bend - 0.5 * (look_back - 1)))


def peak_nm(
    position_rad: np.ndarray, torque_nm: np.ndarray, period_s: float, count_rad: float, inertia_kgm2: float
) -> float:
    """Most of what is left of a ramp's torque without J a: the friction at break-away, signed as the last
    torque; NaN where none is seen.

    Notes
    -----
    A ramp goes on while the joint gets faster, and by when it is seen to slide a share of the torque moves
    the inertia, on a light joint a tenth of it. Torque means and accelerations are those of sliding windows,
    by the parabola that fits their positions best. A step of the encoder is `count_rad`/sqrt(12) of noise,
    which such a parabola makes sqrt(720/n^5)/T^2 as large."""
    sign = math.copysign(1.0, float(torque_nm[-1]))
    noise_nm = math.sqrt(720.0 / 12.0) * count_rad * inertia_kgm2 / period_s**2
    size = max(abs(float(torque_nm[-1])), 1e-12)
    # n^(5/2) of the noise, solved for n; odd, with a middle
    n = round(max(PEAK_S / period_s, (noise_nm / (PEAK_NOISE_SHARE * size)) ** 0.4)) | 1
    if n > min(len(position_rad), PEAK_MOST_S / period_s):
        return math.nan
    square = (np.arange(n) - 0.5 * (n - 1)) ** 2
    square -= square.mean()
    acceleration = np.convolve(position_rad, 2.0 * square / (square @ square) / period_s**2, "valid")
    left = np.convolve(torque_nm, np.full(n, 1.0 / n), "valid") - inertia_kgm2 * acceleration
    return sign * float(np.max(sign * left))


def break_away(
    rows: np.ndarray,
    axis: int,
    period_s: float,
    count_rad: float,
    bias_nm: float,
    inertia_kgm2: float,
    radian: float = 1.0,
) -> Measurement | None:
    """Break-away torque of one ramp: the most that friction held before the slide, or the mean over
    `LOOK_BACK_S` about its beginning.

    The last rows are those of the slip. None without one, and when the loop was late about then."""
    look_back, rows = max(4, round(LOOK_BACK_S / period_s)), on_every_slot(rows, axis)
    if len(rows) <= 2 * look_back:
        return None
    moving_rad = max(MOVING_COUNTS * count_rad, MOVING_RAD * radian)
    position_rad = rows["position_rad"][:, axis]
    seen = break_away_row(position_rad, look_back, moving_rad)
    if seen < 0:
        return None
    began = max(look_back, seen - rows_before_seen(position_rad, seen, look_back))
    last = rows[began - look_back + 1 : began + 1]
    torque_nm = rows["motor_torque_nm"][:, axis] - bias_nm
    first, half = max(0, began - round(PEAK_MOST_S / period_s)), round(0.5 * PEAK_S / period_s)
    if ran_late(rows[first : seen + look_back + 1], period_s):
        return None
    about = slice(first, began - look_back // 2 + half + 1)
    held_nm = peak_nm(position_rad[about], torque_nm[about], period_s, count_rad, inertia_kgm2)
    if not math.isfinite(held_nm):
        held_nm = float(np.mean(last["motor_torque_nm"][:, axis])) - bias_nm
    return _measurement(last, axis, held_nm, 0.0, 0.0)
