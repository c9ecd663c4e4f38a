"""What can go wrong with a log: each function gives a change of a clean one (`dirty_logs` has the corpus)."""

from dataclasses import replace
from functools import cache

import numpy as np
from moved_joint import CLEAN, Joint, Log, simulate


@cache
def clean(name):
    return simulate(CLEAN[name])


def rows_of(log: Log, kept) -> Log:
    cut = {name: getattr(log, name) for name in ("time", "position", "motor", "hand", "velocity")}
    return replace(log, **{name: each if each is None else each[kept] for name, each in cut.items()})


def column(name, change):
    """A log with one column changed: `change` of the column, or of column and log."""
    return lambda log: replace(log, **{name: change(getattr(log, name), log)})


def at(rows, amounts):
    def change(signal, log):
        signal = signal.copy()
        signal[rows] += amounts
        return signal

    return change


def late(seconds):
    return lambda signal, log: np.interp(log.time - seconds, log.time, signal)


def low_passed(cutoff_hz):
    def change(signal, log):
        from scipy.signal import butter, sosfilt, sosfilt_zi

        sections = butter(2, cutoff_hz, fs=1 / log.step, output="sos")
        return sosfilt(sections, signal, zi=sosfilt_zi(sections) * signal[0])[0]

    return change


def steps(make):
    """The same rows, whose stamps say other steps than there were."""
    return column("time", lambda time, log: np.concatenate([[0.0], np.cumsum(make(len(time) - 1, log.step))]))


def sampled_at(make):
    """A log truly sampled at uneven times, which its stamps say."""

    def change(log):
        time = np.cumsum(make(len(log.time), log.step))
        time = time[time < log.time[-1]]
        fields = {
            name: None if getattr(log, name) is None else np.interp(time, log.time, getattr(log, name))
            for name in ("position", "motor", "hand", "velocity")
        }
        return replace(log, time=time, **fields)

    return change


def pasted(log: Log, other: Log, *, back: bool) -> Log:
    begin = 0.0 if back else log.time[-1] + log.step
    joined = {
        name: np.concatenate([getattr(log, name), getattr(other, name)])
        for name in ("position", "hand", "velocity")
    }
    return replace(log, time=np.concatenate([log.time, other.time + begin]), motor=None, **joined)


def without_rows(share=None, rows=None, *, restamp):
    def change(log):
        n = len(log.time)
        lost = np.zeros(n, bool)
        if rows is not None:
            lost[rows] = True
        else:
            lost = np.random.default_rng(7).uniform(size=n) < share
        kept = rows_of(log, ~lost)
        return replace(kept, time=log.time[: len(kept.time)]) if restamp else kept

    return change


def repeated(count, *, held):
    """Rows that repeat the one before: `held` in its place, else pushed in between with fresh stamps."""

    def change(log):
        rows = np.sort(np.random.default_rng(8).choice(np.arange(10, len(log.time), 3), count, replace=False))
        index = np.arange(len(log.time))
        index = np.where(np.isin(index, rows), index - 1, index) if held else np.insert(index, rows, rows)
        return replace(rows_of(log, index), time=np.arange(len(index)) * log.step)

    return change


def softly(limit, sharpness=6.0):
    def change(signal, log):
        clipped = signal / (1 + np.abs(signal / limit) ** sharpness) ** (1 / sharpness)
        return clipped + np.random.default_rng(9).normal(0, 0.02 * limit, len(signal))

    return change


def quantised(quantum):
    return lambda signal, log: np.round(signal / quantum) * quantum


def both(*changes):
    def change(log):
        for each in changes:
            log = each(log)
        return log

    return change


def of_other_axis(signal, log):
    return simulate(Joint(sines=((0.3, 0.53), (0.2, 0.9), (0.05, 2.9)), seed=20)).hand


def quick(level_nm):
    """Wander quicker than what is taken for drift."""
    return lambda signal, log: signal + level_nm * np.sin(2 * np.pi * 0.7 * log.time + 1)


def ramped(log):
    return simulate(replace(CLEAN["hand"], friction_over_time=0.6, seconds=40.0))


def also_held(kind, stiffness):
    """A motor that moves the joint, and a hand on it that nobody recorded."""

    def change(log):
        joint = replace(CLEAN["motor"], hand=(stiffness, 0.03 * stiffness), kind=kind, seconds=40.0)
        return replace(simulate(joint), hand=None)

    return change


def through_gear(share, brisk):
    """A motor that moves the joint through a gear which rubs by a share of the torque; `brisk` motion has it
    braked.
    """

    def change(log):
        sines = ((0.4, 0.8), (0.15, 2.2), (0.05, 4.3)) if brisk else CLEAN["motor"].sines
        return simulate(replace(CLEAN["motor"], share=share, sines=sines, seconds=40.0))

    return change


def moves(log):
    """Point to point, each move at one acceleration, one speed and one deceleration."""
    return simulate(replace(CLEAN["motor"], kind="moves", seconds=40.0))


def turned(log):
    """A crank turned by more than a turn, whose encoder starts over at 2 pi."""
    log = simulate(Joint(sines=((4.0, 0.25), (1.0, 0.7), (0.05, 2.3)), seed=21))
    return replace(log, position=np.mod(log.position, 2 * np.pi))


def lines(change):
    """Change the lines of the text below the header."""

    def of(text):
        head, *rows = text.splitlines()
        return "\n".join([head, *change(head, rows)]) + "\n"

    return of


def cells(row, index, cell):
    """Put `cell` into column `index` of a row."""
    parts = row.split(",")
    parts[index] = cell
    return ",".join(parts)


def with_velocity(change):
    """The log with a column `v` that a drive wrote: `change` of the true velocity and the log."""
    return lambda log: replace(log, extra={"v": change(log.velocity, log)})


def high_passed(corner_hz):
    """AC-coupled: without what a low-pass of the first order lets through."""

    def change(signal, log):
        from scipy.signal import lfilter, lfilter_zi

        kept = np.exp(-2 * np.pi * corner_hz * log.step)
        b, a = [1 - kept], [1, -kept]
        return signal - lfilter(b, a, signal, zi=lfilter_zi(b, a) * signal[0])[0]

    return change


def losing_counts(share):
    """A position that goes on too little the faster it is, from .4 of its speed on."""

    def change(position, log):
        most = np.quantile(np.abs(log.velocity), 0.9)
        lost = share * np.clip(np.abs(log.velocity) / most - 0.4, 0, 1)
        return position[0] + np.cumsum(np.diff(position, prepend=position[0]) * (1 - lost))

    return change
