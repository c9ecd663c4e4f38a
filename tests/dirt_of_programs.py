"""More dirty logs: what programs, spreadsheets and sensors of others do to a clean one; cases as of
`dirty_logs`, judged alike.

`python tests/dirt_of_programs.py` prints what comes of each.
"""
# longer than 300 lines: one table, a row for each kind of dirt

from __future__ import annotations

import datetime
import re
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from dirty_changes import (
    cells,
    clean,
    column,
    late,
    lines,
    low_passed,
    moves,
    quantised,
    rows_of,
    through_gear,
    with_velocity,
)
from dirty_logs import CASES, RIG, Case, identified, show
from moved_joint import Joint, Log, simulate

CASES_OF_BEFORE = len(CASES)


def stamped(written):
    """The first cell of each row written by `written`, which is given its time in s."""
    return lines(lambda _, rows: [cells(row, 0, written(float(row.split(",")[0]))) for row in rows])


def of_day(format_of, start):
    """Times of a day, from `start` (h, min, s) on."""
    begin = datetime.datetime(2026, 11, 24, *start)
    return stamped(lambda t: format_of(begin + datetime.timedelta(seconds=t)))


def interleaved(log: Log) -> Log:
    """Rows of two axes in turn, at the same times; the other axis rests nearly."""
    other = simulate(
        Joint(inertia=0.03, coulomb=0.6, breakaway=0.65, sines=((0.2, 0.5), (0.05, 1.7)), seed=31)
    )
    n = min(len(log.time), len(other.time))
    both = {
        name: np.column_stack([getattr(log, name)[:n], getattr(other, name)[:n]]).ravel()
        for name in ("time", "position", "hand", "velocity")
    }
    return replace(log, motor=None, extra={"axis": np.tile([1.0, 2.0], n)}, **both)


def interleaved_apart(log: Log) -> Log:
    """The same, the second axis half a step later."""
    found = interleaved(log)
    return replace(found, time=found.time + np.tile([0.0, 0.5 * log.step], len(found.time) // 2))


def held_up(times):
    """Every row repeated: a slower log brought to a higher rate by holding rows."""

    def change(log):
        rows = np.arange(0, len(log.time) - times, times)
        kept = rows_of(log, np.repeat(rows, times))
        return replace(kept, time=log.time[: len(kept.time)])

    return change


def held_column(rows):
    """A column of a slower bus: the value of the last telegram."""
    return lambda signal, log: signal[(np.arange(len(signal)) // rows) * rows]


def of_another_clock(seconds):
    """Late by so much at the last row, and not at the first."""
    return lambda signal, log: np.interp(log.time - seconds * log.time / log.time[-1], log.time, signal)


def of_levels(position, count):
    step = np.ptp(position) / count
    return np.round(position / step) * step


def averaged(rows):
    """The mean of the last rows."""
    return lambda signal, log: np.convolve(signal, np.ones(rows) / rows)[: len(signal)]


def compensated(log: Log) -> Log:
    """The friction that the drive feeds forward is not in what it calls torque."""
    v, truth = log.velocity, log.truth
    ahead = 0.95 * (truth["coulomb_nm"] * np.tanh(v / 0.02) + truth["viscous_nms_rad"] * v)
    return replace(log, motor=log.motor - ahead)


def tared(signal, log):
    """Somebody pressed zero in the middle."""
    return signal - 0.15 * (log.time > 12)


def ac_coupled(signal, log):
    return signal - low_passed(0.4)(signal, log)


def dropouts(signal, log):
    return np.where(np.random.default_rng(41).uniform(size=len(signal)) < 0.1, 0.0, signal)


def off_for_a_part(log: Log) -> Log:
    """The motor is off between 8 and 14 s, and somebody moves the joint on: its current is 0, with the noise
    of the meter.
    """
    off = (log.time > 8) & (log.time < 14)
    return replace(log, motor=np.where(off, np.random.default_rng(40).normal(0, 0.003, len(off)), log.motor))


def braked(log: Log) -> Log:
    """A brake holds the joint for 3 s where it turns, while its motor pushes."""
    k, n = 4000 + int(np.argmin(np.abs(log.velocity[4000:6000]))), 1500
    held = rows_of(log, np.concatenate([np.arange(k), np.full(n, k), np.arange(k, len(log.time) - n)]))
    motor = held.motor.copy()
    motor[k : k + n] += 2 * np.sin(np.linspace(0, np.pi, n))
    return replace(held, time=log.time, motor=motor)


def swapped(log: Log) -> Log:
    return replace(log, position=log.hand, hand=log.position)


def shuffled(log: Log) -> Log:
    """Somebody sorted the table by the position."""
    return rows_of(log, np.argsort(log.position, kind="stable"))


def comma(text):
    return text.replace(",", ";").replace(".", ",")


def thousands(text):
    """Stamps in ms with a point between the thousands, decimal commas, semicolons."""

    def cell(t):
        return f"{1e3 * t:,.3f}".replace(",", " ").replace(".", ",").replace(" ", ".")

    head, *rows = text.splitlines()
    found = []
    for row in rows:
        time, *others = row.split(",")
        found.append(";".join([cell(float(time)), *(other.replace(".", ",") for other in others)]))
    return "\n".join([head.replace(",", ";"), *found]) + "\n"


def quoted_thousands(text):
    return stamped(lambda t: f'"{1e3 * t:,.1f}"')(text)


def with_cells(cell, share=0.002, index=2):
    def change(_, rows):
        lost = np.random.default_rng(42).uniform(size=len(rows)) < share
        return [cells(row, index, cell) if gone else row for row, gone in zip(rows, lost, strict=True)]

    return lines(change)


def headers_between(head, rows):
    found = []
    for k in range(0, len(rows), 2000):
        found += [*rows[k : k + 2000], head]
    return found


def dotted(moment):
    return moment.strftime("%d.%m.%Y %H:%M:%S.") + f"{moment.microsecond // 100:04d}"


def excel_day(t):
    return f"{46350.5 + t / 86400:.9f}"


MS = ("--column", "time=time_s:ms")
US = ("--column", "time=time_s:us")
NS = ("--column", "time=time_s:ns")
SAME = r"."
"""Right values will do: any word, or none."""

MORE = {
    "us stamps that wrap at 2^32": Case("hand",
        column("time", lambda t, _: np.mod(np.round(1e6 * t) + 2**32 - 9e6, 2**32)),
        r"starts? over|wrap|unsorted", US, text=lambda t: t),
    "us stamps that wrap at 2^32, read as s": Case("hand",
        column("time", lambda t, _: np.mod(np.round(1e6 * t) + 2**32 - 9e6, 2**32)), r"time"),
    "us of a 16-bit timer that wraps": Case("hand",
        column("time", lambda t, _: np.mod(np.round(1e6 * t), 65536)), r"starts? over|wrap|unsorted", US),
    "two axes in turn": Case("hand", interleaved, r"2 axes|duplicated"),
    "two axes in turn, apart in time": Case("hand", interleaved_apart, r"2 axes"),
    "torque of the other sign": Case("hand, noisy", column("hand", lambda s, _: -s), r"sign"),
    "amperes in the header, read as N m": Case("motor", lambda log: log, r"is read in Nm, the file says A",
        ("--column", "torque=motor [A]:Nm"), text=lambda t: t.replace("motor", "motor [A]", 1)),
    "motor off for a part": Case("motor", off_for_a_part, r"motor torque: about 0 .*motor was off"),
    "motor off for a part, exactly 0": Case("motor",
        lambda log: replace(off_for_a_part(log),
            motor=np.where((log.time > 8) & (log.time < 14), 0.0, log.motor)),
            r"motor torque: about 0 .*motor was off"),
    "deg/s beside rad": Case("hand", lambda log: replace(log, extra={"v": np.degrees(log.velocity)}),
        r"deg/s|unit", ("--column", "velocity=v")),
    "rows held by ten": Case("hand, 100 Hz", lambda log: log, SAME),
    "a log of 50 Hz held to 500": Case("hand", held_up(10), r"stands 10 times"),
    "a log of 250 Hz held to 500": Case("hand", held_up(2), r"stands 2 times"),
    "position of a bus of 100 Hz": Case("hand", column("position", held_column(5)),
        r"column position: nearly every value stands for 5 rows \(100 Hz\)"),
    "velocity of a bus of 150 Hz": Case("motor",
        with_velocity(lambda v, log: v[(np.arange(len(v)) * 0.3).astype(int) * 10 // 3]),
        r"column velocity: nearly every value stands for 3.33 rows \(150 Hz\)", ("--column", "velocity=v")),
    "torque of a bus of 20 Hz": Case("hand", column("hand", held_column(25)),
        r"external torque: nearly every value stands for 25 rows"),
    "torque of a bus of 50 Hz, motor": Case("motor", column("motor", held_column(10)),
        r"motor torque: nearly every value stands for 10 rows"),
    "12 bits of torque": Case("hand", column("hand", quantised(20 / 4096)), SAME),
    "8 bits of torque": Case("hand", column("hand", quantised(20 / 256)), r"coarse|levels"),
    "friction is compensated already": Case("motor", compensated, r"taken off"),
    "mean of the last 100 ms of torque": Case("hand", column("hand", averaged(50)), r"late"),
    "mean of the last 300 ms of torque": Case("hand", column("hand", averaged(150)), r"late|explains|torque"),
    "torque filtered at 2 Hz": Case("motor", column("motor", low_passed(2.0)), r"late|explains|torque"),
    "torque without its mean, AC-coupled": Case("hand", column("hand", ac_coupled),
        r"torque|left over|explains"),
    "torque without its sign": Case("hand", column("hand", lambda s, _: np.abs(s)),
        r"external torque: never negative although the joint turns back"),
    "negative torques wrapped at 2^16": Case("motor",
        column("motor", lambda s, _: np.mod(np.round(s * 1e3), 65536)),
        r"negative numbers were written without a sign; take 65\.536 N m",
        ("--column", "torque=motor:mNm")),
    "dropouts written as 0": Case("hand", column("hand", dropouts), r"external torque.*exactly 0"),
    "zero pressed in the middle": Case("hand", column("hand", tared), r"left over|zero of the torque"),
    "range changed in the middle": Case("hand",
        column("hand", lambda s, log: s * np.where(log.time > 12, 10.0, 1.0)), r"torque|changes"),
    "range of the motor's current changed by 1.5": Case("motor",
        column("motor", lambda s, log: s * np.where(log.time > 12, 1.5, 1.0)), r"changes within"),
    "position and torque swapped": Case("hand", swapped, r"torque|position|sign"),
    "sorted by the position": Case("hand", shuffled, r"unsorted|time"),
    "newest first": Case("hand", lambda log: rows_of(log, np.arange(len(log.time))[::-1]),
        r"unsorted|time|backwards"),
    "encoder turned in the middle": Case("hand",
        column("position", lambda x, log: np.where(log.time > 12, -x, x)),
        r"position|torque|explains|changes"),
    "angle of the motor before a gear of 30": Case("motor", column("position", lambda x, _: 30 * x),
        r"before the gear"),
    "torque in 0.1 % of rated": Case("motor", column("motor", lambda s, _: np.round(1e3 * s / 1.2)),
        r"mN m|unit"),
    "UTF-16 with a mark": Case("hand", lambda log: log, SAME),
    "semicolons, decimal commas": Case("hand", lambda log: log, SAME, text=comma),
    "semicolons, decimal commas, thousands": Case("hand", lambda log: log, SAME, MS, text=thousands),
    "thousands in quotes": Case("hand", lambda log: log, SAME, MS, text=quoted_thousands),
    "European dates": Case("hand", lambda log: log, SAME, text=of_day(dotted, (14, 5, 1))),
    "dates of Excel as numbers of days": Case("hand", lambda log: log, r"time", text=stamped(excel_day)),
    "times of day past midnight": Case("hand", lambda log: log, SAME,
        text=of_day(lambda m: m.strftime("%H:%M:%S.%f"), (23, 59, 50))),
    "seconds of the day past midnight": Case("hand",
        column("time", lambda t, _: np.mod(t + 86390.0, 86400.0)), r"midnight"),
    "ms of the day past midnight": Case("hand",
        column("time", lambda t, _: np.mod(np.round(1e3 * t) + 86390e3, 86400e3)), r"midnight", MS),
    "minutes and seconds past the hour": Case("hand", lambda log: log, r"time|starts? over",
        text=of_day(lambda m: m.strftime("%M:%S.%f"), (14, 59, 50))),
    "a clock put back by half a second": Case("hand",
        column("time", lambda t, _: np.where(t > 12, t - 0.5, t)), r"time|unsorted|duplicated"),
    "a clock put forward by half a second": Case("hand",
        column("time", lambda t, _: np.where(t > 12, t + 0.5, t)), r"gap|jump|time"),
    "a brake closed for a while, and the motor pushed": Case("motor", braked,
        r"the joint stands for 2\.\d s from .*although 1\.\d+ N m push it.*a brake"),
    "torque late by 9.3 ms": Case("motor", column("motor", late(0.0093)),
        r"^(?!(?s:.*)two clocks)(?s:.*)torque looks 9 ms late"),
    "a pause of an hour, as summer time begins": Case("hand",
        column("time", lambda t, _: np.where(t > 12, t + 3600, t)), r"gap"),
    "Unix time in ten digits": Case("hand", column("time", lambda t, _: np.round(1.7325e9 + t)),
        r"time|duplicated"),
    "headers between": Case("hand", lambda log: log, r"header", text=lines(headers_between)),
    "#N/A in cells": Case("hand", lambda log: log, r"#N/A|no number", text=with_cells("#N/A")),
    "NaN in cells": Case("hand", lambda log: log, r"'hand' row|no number", text=with_cells("NaN")),
    "empty cells": Case("hand", lambda log: log, r"empty|'hand' row", text=with_cells("")),
    "-9999 for what is missing": Case("hand", lambda log: log, r"torque|-9999|spike",
        text=with_cells("-9999")),
    "0 for what is missing, of the position": Case("hand", lambda log: log, r"position",
        text=with_cells("0", 0.01, 1)),
    "NUL bytes at the end": Case("hand", lambda log: log, SAME, text=lambda t: t + "\0" * 4096),
    "last line cut off": Case("hand", lambda log: log, SAME, text=lambda t: t[:-9]),
    "position of three digits": Case("hand",
        column("position", lambda x, _: np.array([float(f"{v:.2e}") for v in x])), SAME),
    "torque of two digits": Case("hand",
        column("hand", lambda x, _: np.array([float(f"{v:.1e}") for v in x])), SAME),
    "a part at half the rate": Case("hand",
        lambda log: rows_of(log, np.concatenate([np.arange(6000), np.arange(6000, len(log.time), 2)])), SAME),
    "a part at half the rate, unknown to the stamps": Case("hand",
        lambda log: replace(rows_of(log,
            np.concatenate([np.arange(6000), np.arange(6000, len(log.time), 2)])),
            time=log.time[: 6000 + (len(log.time) - 6000 + 1) // 2]),
            r"inertia.* rows of another rate.* changes within"),
    "the same log twice in one file": Case("hand",
        lambda log: replace(rows_of(log, np.tile(np.arange(6000), 2)), time=log.time[:12000]),
        r"twice|repeat|jump"),
    "current with the load's torque already in": Case("hand against a spring of the motor",
        lambda log: replace(log, motor=log.motor + log.hand), r"torque|weight"),
    "a gear that rubs by a fifth of its torque, brisk": Case("motor", through_gear(0.2, brisk=True),
        r"friction grows with the torque"),
    "torque saturates softly by a fifth": Case("motor",
        column("motor", lambda s, log: 0.9 * np.tanh(s / 0.9)), r"not proportional|clipped"),
    "torque saturates softly, brisk": Case("motor",
        lambda log: softened(through_gear(0.0, brisk=True)(log), 1.5), r"not proportional|clipped"),
    "current of a motor that saturates": Case("motor",
        column("motor", lambda s, log: s * (1 + 0.25 * (s / np.abs(s).max()) ** 2)), r"not proportional"),
    "scale of the position drifts by a fifth": Case("hand",
        column("position", lambda x, log: x * (1 + 0.2 * log.time / log.time[-1])),
        r"scale of the position drifts"),
    "scale of the torque drifts by a quarter": Case("motor",
        column("motor", lambda s, log: s * (1 + 0.25 * log.time / log.time[-1])),
        r"scale of the torque drifts|changes within"),
    "position drifts against its velocity": Case("motor",
        lambda log: replace(log, position=log.position * (1 + 0.15 * log.time / log.time[-1]),
            extra={"v": log.velocity}), r"drifts|changes|times the derivative", ("--column", "velocity=v")),
    "half the gear ratio, with the rig file": Case("motor", column("position", lambda x, _: 2 * x),
        r"inertia_kgm2.*unit", RIG),
    "a torque constant off by 30 %, with the rig file": Case("motor", column("motor", lambda s, _: 1.3 * s),
        r"inertia_kgm2.*unit or a scale", RIG),
    "torque of a device whose clock gains 150 ms": Case("hand", column("hand", of_another_clock(0.15)),
        r"two clocks"),
    "torque of a device whose clock loses 100 ms": Case("motor", column("motor", of_another_clock(-0.1)),
        r"two clocks"),
    "position of sixty levels, slow": Case("hand",
        lambda log: replace(clean("hand"), position=of_levels(log.position, 60)),
        r"column position: too coarse"),
    "position of eighty levels": Case("hand", column("position", lambda x, _: of_levels(x, 80)),
        r"column position: too coarse"),
    "moves of even accelerations": Case("motor", moves, SAME),
    "moves of even accelerations, coarse current": Case("motor",
        lambda log: replace(moves(log), motor=np.round(moves(log).motor / 0.004) * 0.004), SAME),
    "moves, clipped": Case("motor",
        lambda log: replace(moves(log), motor=np.clip(moves(log).motor, -0.45, 0.45)), r"clipped"),
}  # fmt: skip


def softened(log: Log, largest_nm: float) -> Log:
    """The motor's torque saturates softly."""
    return replace(log, motor=largest_nm * np.tanh(log.motor / largest_nm))


def of(name: str, folder: Path):
    case = MORE[name]
    log = case.dirty(clean(case.clean))
    if name.startswith("UTF-16"):
        return identified(log, folder, case.options, case.text, encoding="utf-16")
    return identified(log, folder, case.options, case.text)


def main():
    bad = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, case in MORE.items():
            if sys.argv[2:] and not any(word in name for word in sys.argv[2:]):
                continue
            found = of(name, Path(folder))
            named = re.search(case.cause, found.said) is not None and (found.said or case.cause == SAME)
            bad += found.wrong() and not named
            verdict = (
                "WRONG"
                if found.wrong() and not named
                else "wrong, named"
                if found.wrong()
                else "refused"
                if found.code
                else "right"
            )
            show(name, found, verdict + (" ?" if not named and found.code else ""))
            sys.stdout.flush()
    sys.stdout.write(f"{bad} wrong and quiet of {len(MORE)}\n")


if __name__ == "__main__":
    main()
