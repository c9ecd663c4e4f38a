"""A corpus of dirty logs: clean ones of `moved_joint` with one thing wrong each, and the words that must name
it.

`python tests/dirty_logs.py` prints what `rtctl identify --log` makes of each. A wrong answer is an inertia
more than 10 %, or a Coulomb or viscous friction more than 15 % off the truth, with exit code 0 and no warning
that names the cause.
"""
# longer than 300 lines: one table, a row for each kind of dirt

from __future__ import annotations

import contextlib
import io
import json
import re
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from dirty_changes import (
    also_held,
    at,
    cells,
    clean,
    column,
    high_passed,
    late,
    lines,
    losing_counts,
    low_passed,
    of_other_axis,
    pasted,
    quantised,
    quick,
    ramped,
    repeated,
    rows_of,
    sampled_at,
    softly,
    turned,
    with_velocity,
    without_rows,
)
from moved_joint import CLEAN, Joint, Log, simulate, wanted

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


def write(log: Log, path: Path, text=lambda text: text, encoding="utf-8"):
    columns = {"time_s": log.time, "x": log.position, "motor": log.motor, "hand": log.hand, **log.extra}
    columns = {name: each for name, each in columns.items() if each is not None}
    table = np.column_stack(list(columns.values()))
    row = ",".join(["%.9g"] * len(columns))
    rows = "\n".join([row] * len(table)) % tuple(table.ravel().tolist())
    path.write_text(text(f"{','.join(columns)}\n{rows}\n"), encoding=encoding)
    return path


def said_by(*arguments) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of `rtctl identify`."""
    from rtctl.__main__ import main

    out, err, code, before = io.StringIO(), io.StringIO(), 0, sys.argv
    sys.argv = ["rtctl", "identify", *arguments]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as ended:
        code = int(ended.code or 0)
    finally:
        sys.argv = before
    return code, out.getvalue(), err.getvalue()


def identified(log: Log, folder: Path, options=(), text=lambda text: text, encoding="utf-8") -> Outcome:
    path = write(log, folder / "log.csv", text, encoding)
    arguments = ["--log", str(path), "--column", "position=x", "--json", *options]
    arguments += [] if "--config" in options else ["--gear-ratio", "1"]
    for role, name, signal in (("torque", "motor", log.motor), ("external", "hand", log.hand)):
        if signal is not None and not any(f"{role}=" in option for option in options):
            arguments += ["--column", f"{role}={name}"]
    code, out, err = said_by(*arguments)
    if code:
        return Outcome(code, {}, out + err)
    found = json.loads(out)
    values = found["symmetric"]["parameters"]
    off = {name: values[name]["value"] / truth - 1 for name, truth in log.truth.items()}
    return Outcome(0, off, "\n".join(found["warnings"]))


RIG = ("--config", str(MOCK))

CASES = {
    "one position spike": Case("hand", column("position", at([4321], 0.5)),
        r"column position.*spike.*row 4322"),
    "small spikes of position": Case(
        "hand", column("position", at(np.arange(500, 12000, 300), 0.03)), r"column position.*spike"
    ),
    "bursts of position spikes": Case(
        "motor",
        column("position", at([900, 901, 902, 5000, 5001, 9000], [0.3, -0.2, 0.4, 0.6, 0.5, -0.4])),
        r"column position.*spike",
    ),
    "spikes of torque": Case("hand", column("hand", at(np.arange(300, 12000, 90), 6.0)),
        r"external torque.*spike"),
    "torque clipped hard": Case("hand", column("hand", lambda s, _: np.clip(s, -0.5, 0.5)),
        r"external torque.*clipped"),
    "torque clipped at one side, 100 Hz": Case(
        "hand, 100 Hz", column("hand", lambda s, _: np.minimum(s, 0.4)), r"external torque.*clipped"
    ),
    "torque clipped softly": Case("hand", column("hand", softly(0.45)), r"torque.*clipped"),
    "torque clipped, noise on top": Case(
        "motor",
        column("motor", lambda s,
            log: np.clip(s, -0.4, 0.4) + np.random.default_rng(1).normal(0, 0.01, len(s))),
        r"torque.*clipped",
    ),
    "rows lost, stamps even": Case("hand", without_rows(0.01, restamp=True), r"rows .*(lost|missing)|jump"),
    "a second lost, stamps even": Case(
        "hand", without_rows(rows=slice(4000, 4500), restamp=True), r"position.*jump|rows .*lost"
    ),
    "rows repeated in place": Case("hand", repeated(600, held=True), r"rows? .*repeat"),
    "rows repeated in between": Case("hand", repeated(600, held=False), r"rows repeat .*the time is wrong"),
    "velocity as position": Case("hand", column("position", lambda _, log: log.velocity),
        r"position.*velocity"),
    "velocity as position, motor": Case("motor", column("position", lambda _, log: log.velocity),
        r"position.*velocity"),
    "degrees as radians": Case("hand", column("position", lambda s, _: np.degrees(s)),
        r"position.*(deg|unit)"),
    "degrees as radians, motor": Case("motor", column("position", lambda s, _: np.degrees(s)),
        r"position.*(deg|unit)"),
    "counts as radians": Case(
        "hand", column("position", lambda s, _: np.round(s * 4096 / 2 / np.pi)), r"position.*(counts|unit)"
    ),
    "turns as radians, with the rig file": Case(
        "motor", column("position", lambda s, _: s / 2 / np.pi), r"inertia_kgm2.*unit", RIG
    ),
    "milli-newton-metres": Case("motor", column("motor", lambda s, _: 1e3 * s), r"torque.*(mN m|unit)"),
    "milli-newton-metres of the hand alone": Case(
        "hand against a spring of the motor", column("hand", lambda s, _: 1e3 * s),
        r"external torque.*(mN m|unit)"
    ),
    "motor in mN m beside a hand in N m": Case(
        "hand against a spring of the motor", column("motor", lambda s, _: 1e3 * s),
        r"motor torque.*(mN m|unit)"
    ),
    "amperes as newton-metres, with the rig file": Case(
        "motor", column("motor", lambda s, _: s / 0.4), r"(inertia_kgm2|motor torque).*unit", RIG
    ),
    "amperes beside a hand": Case(
        "hand against a spring of the motor", column("motor", lambda s, _: s / 0.2),
        r"motor torque.*(unit|scale)"
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
    "torque late by 50 ms": Case("hand", column("hand", late(0.05)),
        r"torque looks .* late|--torque-delay|time"),
    "position low-passed": Case("hand", column("position", low_passed(4.0)), r"torque looks .* early|late"),
    "uneven stamps": Case(
        "hand", sampled_at(lambda n, h: np.tile([0.6 * h, 1.4 * h], n // 2)), r"resampled"
    ),
    "stamps that jitter, sampling even": Case(
        "hand", column("time", lambda t,
            log: t + np.random.default_rng(2).uniform(-0.4, 0.4, len(t)) * log.step), r"resampled"
    ),
    "stamps in ms as s": Case("hand", column("time", lambda t, _: 1e3 * t), r"time.*(ms|unit)"),
    "stamps in s as ms": Case("hand", lambda log: log, r"time.*unit|unit.*time",
        ("--column", "time=time_s:ms")),
    "twice the rate, with the rig file": Case(
        "hand", lambda log: log, r"inertia_kgm2.*time", ("--rate-hz", "1000", *RIG)
    ),
    "a gap": Case("hand", without_rows(rows=slice(4000, 4500), restamp=False), r"gap"),
    "rows lost, stamps true": Case("hand", without_rows(0.05, restamp=False), r"resampled"),
    "a pause at rest": Case(
        "hand",
        lambda log: rows_of(log,
            np.concatenate([np.arange(6000), np.full(3000, 6000), np.arange(6000, 12500)])),
        r"duplicated|repeat|time",
    ),
    "constant torque": Case("hand", column("hand", lambda s, _: np.full_like(s, 0.1)), r"constant"),
    "constant torque of the motor": Case(
        "hand against a spring of the motor", column("motor", lambda s, _: np.zeros_like(s)),
        r"motor torque.*constant"
    ),
    "torque of three levels": Case("hand", column("hand", quantised(0.4)),
        r"external torque.*(coarse|levels)"),
    "position of two decimals": Case("hand", column("position", quantised(0.01)),
        r"position.*(coarse|steps)"),
    "position of one decimal of degrees, 50 Hz": Case(
        "hand, 100 Hz", column("position", quantised(0.05)), r"position.*(coarse|steps)"
    ),
    "offset that wanders quickly": Case("hand", column("hand", quick(0.25)),
        r"torque.*(something else|explains)"),
    "encoder that starts over at 2 pi": Case("hand", turned, r"position.*starts over|turn"),
    "position that jumps": Case(
        "hand", column("position", lambda s, log: s + 0.2 * (log.time > 11)), r"position.*jump.*row 550[0-9]"
    ),
    "NaN": Case("hand", lambda log: log, r"'x' row 701",
        text=lines(lambda _, rows: [*rows[:700], cells(rows[700], 1, "nan"), *rows[701:]])),
    "an empty column": Case("hand", lambda log: log, r"'hand'.*empty",
        text=lines(lambda _, rows: [cells(row, 2, "") for row in rows])),
    "a word in a cell": Case("hand", lambda log: log, r"'hand' row 701.*overflow",
        text=lines(lambda _, rows: [*rows[:700], cells(rows[700], 2, "overflow"), *rows[701:]])),
    "two logs with both headers": Case("hand", lambda log: log, r"row 5001.*header",
        text=lines(lambda head, rows: [*rows[:5000], head, *rows[5000:]])),
    "time that runs back": Case("hand", column("time", lambda t, _: np.where(t > 12, t - 3, t)),
        r"unsorted|duplicated"),
    "two logs pasted, time starting over": Case("hand",
        lambda log: pasted(log, clean("hand, noisy"), back=True), r"unsorted time"),
    "two joints pasted, stamps even": Case(
        "hand",
        lambda log: pasted(log,
            rows_of(simulate(Joint(inertia=0.03, coulomb=0.6, breakaway=0.65, seed=22)), slice(1700, None)),
            back=False),
        r"jump|changes|two logs",
    ),
    "friction that warms away": Case("hand", ramped, r"friction.*(changes|changed)"),
    "a spring that is not mapped": Case(
        "hand", column("hand", lambda s, log: s + 0.8 * log.position), r"position|spring"
    ),
    "gravity that is not mapped": Case(
        "motor", column("motor", lambda s, log: s + 0.5 * np.sin(2 * log.position + 0.5)), r"position|gravity"
    ),
    "a hand beside the motor, not recorded": Case("motor", also_held("sines", 10.0),
        r"left over and is no noise.*hand"),
    "a hand beside the motor in even strokes, not recorded": Case("motor", also_held("strokes", 5.0),
        r"left over and is no noise.*hand"),
    "torque AC-coupled": Case("motor", column("motor", high_passed(0.3)),
        r"torque looks AC-coupled: as behind a high-pass of 0\.(29|3|31) Hz"),
    "torque AC-coupled, strokes quicker and quicker": Case("motor, even strokes",
        column("motor", high_passed(0.1)), r"torque looks AC-coupled"),
    "range of the torque changed": Case("hand",
        column("hand", lambda s, log: s * np.where(log.time > 12, 2.0, 1.0)),
        r"scale of the torque, by the factor (2|1\.99|2\.01)\b"),
    "zero of the torque changed": Case("motor", column("motor", lambda s, log: s - 0.4 * (log.time > 12)),
        r"zero of the torque, by -0\.[34]"),
    "counts lost at speed": Case("motor", column("position", losing_counts(0.3)),
        r"counts of the position are lost at speed"),
    "counts lost at speed, beside a velocity": Case("motor",
        lambda log: with_velocity(lambda v, _: v)(column("position", losing_counts(0.3))(log)),
        r"counts of the position are lost at speed", ("--column", "velocity=v")),
    "velocity clipped": Case("motor", with_velocity(lambda v, _: np.clip(v, -1.0, 1.0)),
        r"column velocity: clipped at about 1(\.\d+)? rad/s", ("--column", "velocity=v")),
    "velocity filtered at 4 Hz, of the second order": Case("motor", with_velocity(low_passed(4.0)),
        r"column velocity: filtered, as by two low-passes", ("--column", "velocity=v")),
    "velocity of whole rad/s": Case("motor", with_velocity(quantised(1.0)),
        r"column velocity: too coarse|coarse", ("--column", "velocity=v")),
    "velocity of the set point": Case("motor",
        with_velocity(lambda _, log: wanted(CLEAN["motor"], log.time)[1]), r"set point",
        ("--column", "velocity=v")),
    "position of one digit beside a velocity": Case("motor",
        lambda log: with_velocity(lambda v, _: v)(column("position", quantised(0.1))(log)),
        r"(?s)^(?!.*(drifts against|put right))", ("--column", "velocity=v")),
    "the hand's sensor dead for a third": Case(
        "hand", column("hand", lambda s, log: np.where((log.time > 8) & (log.time < 16), s[4000], s)),
        r"external torque.*(constant|frozen|stands)"
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
        sys.stdout.write("\n")
        for name in wanted:
            found = outcome(name, Path(folder))
            silent = not named(name, found)
            bad += silent and found.wrong()
            show(name, found, ("WRONG" if found.wrong() else "not named") if silent else "named")
        sys.stdout.write(f"{bad} wrong answers without a warning that names the cause, of {len(CASES)}\n")


def show(name, found, verdict):
    off = " ".join(f"{100 * each:+6.1f}" for each in found.off.values())
    line = f"{verdict:10} {name:46} {found.code:3} {off:22} {found.said.strip().splitlines()}"
    sys.stdout.write(f"{line[: int(sys.argv[1]) if len(sys.argv) > 1 else 190]}\n")


if __name__ == "__main__":
    main()
