"""A corpus of dirty logs: clean ones of `moved_joint` with one thing wrong each, and the words that must name it.

`python tests/dirty_logs.py` prints what `rtctl identify --log` makes of each. A wrong answer is an inertia more than 10 %,
or a Coulomb or viscous friction more than 15 % off the truth, with exit code 0 and no warning that names the cause.
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from moved_joint import CLEAN, Joint, Log, simulate

OFF = {"inertia_kgm2": 0.10, "viscous_nms_rad": 0.15, "coulomb_nm": 0.15}
MOCK = Path(__file__).parents[1] / "configs" / "mock.toml"


@dataclass
class Case:
    """`dirty` changes a log or its text; `cause` is what error or warning must say, a regular expression."""

    clean: str
    dirty: Callable[[Log], Log]
    cause: str
    options: tuple[str, ...] = ()
    text: Callable[[str], str] = lambda text: text


@dataclass
class Outcome:
    """What the program said: exit code, how far each parameter is off (shares), warnings and error."""

    code: int
    off: dict
    said: str

    def wrong(self):
        return self.code == 0 and any(not abs(self.off[name]) <= most for name, most in OFF.items())


@cache
def clean(name):
    return simulate(CLEAN[name])


def write(log: Log, path: Path, text=lambda text: text):
    columns = {"time_s": log.time, "x": log.position, "motor": log.motor, "hand": log.hand, **log.extra}
    columns = {name: column for name, column in columns.items() if column is not None}
    rows = "\n".join(",".join(f"{cell:.9g}" for cell in row) for row in zip(*columns.values(), strict=True))
    path.write_text(text(f"{','.join(columns)}\n{rows}\n"))
    return path


def identified(log: Log, folder: Path, options=(), text=lambda text: text) -> Outcome:
    from rtctl.__main__ import main

    path = write(log, folder / "log.csv", text)
    arguments = ["identify", "--log", str(path), "--column", "position=x", "--json", *options]
    for role, name, column in (("torque", "motor", log.motor), ("external", "hand", log.hand)):
        if column is not None and not any(f"{role}=" in option for option in options):
            arguments += ["--column", f"{role}={name}"]
    out, err, code, before = io.StringIO(), io.StringIO(), 0, sys.argv
    sys.argv = ["rtctl", *arguments]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as ended:
        code = int(ended.code or 0)
    finally:
        sys.argv = before
    if code:
        return Outcome(code, {}, out.getvalue() + err.getvalue())
    found = json.loads(out.getvalue())
    values = found["symmetric"]["parameters"]
    off = {name: values[name]["value"] / truth - 1 for name, truth in log.truth.items()}
    return Outcome(0, off, "\n".join(found["warnings"]))


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


UNIT = r"unit|deg|mN m"
RIG = ("--config", str(MOCK))

CASES = {
    "one position spike": Case("hand", column("position", at([4321], 0.5)), r"column position.*spike.*row 4322"),
    "small spikes of position": Case(
        "hand", column("position", at(np.arange(500, 12000, 300), 0.03)), r"column position.*spike"
    ),
    "bursts of position spikes": Case(
        "motor",
        column("position", at([900, 901, 902, 5000, 5001, 9000], [0.3, -0.2, 0.4, 0.6, 0.5, -0.4])),
        r"column position.*spike",
    ),
    "spikes of torque": Case("hand", column("hand", at(np.arange(300, 12000, 90), 6.0)), r"external torque.*spike"),
    "torque clipped hard": Case("hand", column("hand", lambda s, _: np.clip(s, -0.5, 0.5)), r"external torque.*clipped"),
    "torque clipped at one side, 100 Hz": Case(
        "hand, 100 Hz", column("hand", lambda s, _: np.minimum(s, 0.4)), r"external torque.*clipped"
    ),
    "torque clipped softly": Case("hand", column("hand", softly(0.45)), r"torque.*clipped"),
    "torque clipped, noise on top": Case(
        "motor",
        column("motor", lambda s, log: np.clip(s, -0.4, 0.4) + np.random.default_rng(1).normal(0, 0.01, len(s))),
        r"torque.*clipped",
    ),
    "rows lost, stamps even": Case("hand", without_rows(0.01, restamp=True), r"rows .*(lost|missing)|jump"),
    "a second lost, stamps even": Case(
        "hand", without_rows(rows=slice(4000, 4500), restamp=True), r"position.*jump|rows .*lost"
    ),
    "rows repeated in place": Case("hand", repeated(600, held=True), r"rows? .*repeat"),
    "rows repeated in between": Case("hand", repeated(600, held=False), r"rows? .*repeat"),
    "velocity as position": Case("hand", column("position", lambda _, log: log.velocity), r"position.*velocity"),
    "velocity as position, motor": Case("motor", column("position", lambda _, log: log.velocity), r"position.*velocity"),
    "degrees as radians": Case("hand", column("position", lambda s, _: np.degrees(s)), r"position.*(deg|unit)"),
    "degrees as radians, motor": Case("motor", column("position", lambda s, _: np.degrees(s)), r"position.*(deg|unit)"),
    "counts as radians": Case(
        "hand", column("position", lambda s, _: np.round(s * 4096 / 2 / np.pi)), r"position.*(counts|unit)"
    ),
    "turns as radians, with the rig file": Case(
        "motor", column("position", lambda s, _: s / 2 / np.pi), r"inertia_kgm2.*unit", RIG
    ),
    "milli-newton-metres": Case("motor", column("motor", lambda s, _: 1e3 * s), r"torque.*(mN m|unit)"),
    "milli-newton-metres of the hand alone": Case(
        "hand against a spring of the motor", column("hand", lambda s, _: 1e3 * s), r"external torque.*(mN m|unit)"
    ),
    "motor in mN m beside a hand in N m": Case(
        "hand against a spring of the motor", column("motor", lambda s, _: 1e3 * s), r"motor torque.*(mN m|unit)"
    ),
    "amperes as newton-metres, with the rig file": Case(
        "motor", column("motor", lambda s, _: s / 0.4), r"(inertia_kgm2|motor torque).*unit", RIG
    ),
    "amperes beside a hand": Case(
        "hand against a spring of the motor", column("motor", lambda s, _: s / 0.2), r"motor torque.*(unit|scale)"
    ),
    "sign of the torque": Case("motor", column("motor", lambda s, _: -s), r"sign"),
    "sign of the hand's torque": Case(
        "hand against a spring of the motor", column("hand", lambda s, _: -s), r"sign"
    ),
    "sign of the motor's torque beside the hand's": Case(
        "hand against a spring of the motor", column("motor", lambda s, _: -s), r"motor torque.*sign"
    ),
    "torque of another axis": Case("hand", column("hand", of_other_axis), r"torque.*same axis"),
    "the hand's torque not mapped": Case(
        "hand against a spring of the motor", column("hand", lambda s, _: None), r"torque|sign"
    ),
    "torque late by 5 ms": Case("motor", column("motor", late(0.005)), r"torque looks .* late"),
    "torque late by 20 ms": Case("hand", column("hand", late(0.02)), r"torque looks .* late"),
    "torque late by 50 ms": Case("hand", column("hand", late(0.05)), r"torque looks .* late|--torque-delay|time"),
    "position low-passed": Case("hand", column("position", low_passed(4.0)), r"torque looks .* early|late"),
    "uneven stamps": Case(
        "hand", sampled_at(lambda n, h: np.tile([0.6 * h, 1.4 * h], n // 2)), r"resampled"
    ),
    "stamps that jitter, sampling even": Case(
        "hand", column("time", lambda t, log: t + np.random.default_rng(2).uniform(-0.4, 0.4, len(t)) * log.step), r"resampled"
    ),
    "stamps in ms as s": Case("hand", column("time", lambda t, _: 1e3 * t), r"time.*(ms|unit)"),
    "stamps in s as ms": Case("hand", lambda log: log, r"time.*unit|unit.*time", ("--column", "time=time_s:ms")),
    "twice the rate, with the rig file": Case(
        "hand", lambda log: log, r"inertia_kgm2.*time", ("--rate-hz", "1000", *RIG)
    ),
    "a gap": Case("hand", without_rows(rows=slice(4000, 4500), restamp=False), r"gap"),
    "rows lost, stamps true": Case("hand", without_rows(0.05, restamp=False), r"resampled"),
    "a pause at rest": Case(
        "hand",
        lambda log: rows_of(log, np.concatenate([np.arange(6000), np.full(3000, 6000), np.arange(6000, 12500)])),
        r"duplicated|repeat|time",
    ),
    "constant torque": Case("hand", column("hand", lambda s, _: np.full_like(s, 0.1)), r"constant"),
    "constant torque of the motor": Case(
        "hand against a spring of the motor", column("motor", lambda s, _: np.zeros_like(s)), r"motor torque.*constant"
    ),
    "torque of three levels": Case("hand", column("hand", quantised(0.4)), r"external torque.*(coarse|levels)"),
    "position of two decimals": Case("hand", column("position", quantised(0.01)), r"position.*(coarse|steps)"),
    "position of one decimal of degrees, 50 Hz": Case(
        "hand, 100 Hz", column("position", quantised(0.05)), r"position.*(coarse|steps)"
    ),
    "offset that wanders quickly": Case("hand", column("hand", quick(0.25)), r"torque.*(something else|explains)"),
    "encoder that starts over at 2 pi": Case("hand", turned, r"position.*starts over|turn"),
    "position that jumps": Case(
        "hand", column("position", lambda s, log: s + 0.2 * (log.time > 11)), r"position.*jump.*row 550[0-9]"
    ),
    "NaN": Case("hand", lambda log: log, r"'x' row 701", text=lines(lambda _, rows: [*rows[:700], cells(rows[700], 1, "nan"), *rows[701:]])),
    "an empty column": Case("hand", lambda log: log, r"'hand'.*empty", text=lines(lambda _, rows: [cells(row, 2, "") for row in rows])),
    "a word in a cell": Case("hand", lambda log: log, r"'hand' row 701.*overflow", text=lines(lambda _, rows: [*rows[:700], cells(rows[700], 2, "overflow"), *rows[701:]])),
    "two logs with both headers": Case("hand", lambda log: log, r"row 5001.*header", text=lines(lambda head, rows: [*rows[:5000], head, *rows[5000:]])),
    "time that runs back": Case("hand", column("time", lambda t, _: np.where(t > 12, t - 3, t)), r"unsorted|duplicated"),
    "two logs pasted, time starting over": Case("hand", lambda log: pasted(log, clean("hand, noisy"), back=True), r"unsorted time"),
    "two joints pasted, stamps even": Case(
        "hand",
        lambda log: pasted(log, rows_of(simulate(Joint(inertia=0.03, coulomb=0.6, breakaway=0.65, seed=22)), slice(1700, None)), back=False),
        r"jump|changes|two logs",
    ),
    "friction that warms away": Case("hand", ramped, r"friction.*(changes|changed)"),
    "a spring that is not mapped": Case(
        "hand", column("hand", lambda s, log: s + 0.8 * log.position), r"position|spring"
    ),
    "gravity that is not mapped": Case(
        "motor", column("motor", lambda s, log: s + 0.5 * np.sin(2 * log.position + 0.5)), r"position|gravity"
    ),
    "the hand's sensor dead for a third": Case(
        "hand", column("hand", lambda s, log: np.where((log.time > 8) & (log.time < 16), s[4000], s)), r"external torque.*(constant|frozen|stands)"
    ),
}  # fmt: skip


def outcome(name: str, folder: Path) -> Outcome:
    case = CASES[name]
    return identified(case.dirty(clean(case.clean)), folder, case.options, case.text)


def named(name: str, found: Outcome) -> bool:
    return re.search(CASES[name].cause, found.said) is not None


def main():
    wanted = [name for name in CASES if not sys.argv[2:] or any(word in name for word in sys.argv[2:])]
    with tempfile.TemporaryDirectory() as folder:
        bad = 0
        for name in () if sys.argv[2:] else CLEAN:
            found = identified(clean(name), Path(folder))
            show(name, found, "WRONG" if found.wrong() or found.code else "right")
        print()
        for name in wanted:
            found = outcome(name, Path(folder))
            silent = not named(name, found)
            bad += silent and found.wrong()
            show(name, found, ("WRONG" if found.wrong() else "not named") if silent else "named")
        print(f"{bad} wrong answers without a warning that names the cause, of {len(CASES)}")


def show(name, found, verdict):
    off = " ".join(f"{100 * each:+6.1f}" for each in found.off.values())
    print(
        f"{verdict:10} {name:46} {found.code:3} {off:22} {found.said.strip().splitlines()}"[
            : int(sys.argv[1]) if len(sys.argv) > 1 else 190
        ]
    )


if __name__ == "__main__":
    main()
