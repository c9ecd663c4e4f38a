"""Logs of joints and carriages of another make, by loops that write a row in other ways: the command that the
row begins, the one that ended at it, or a torque that was measured, behind a filter or a bus.

Nothing here is shared with the mock, `moved_joint` or `other_rigs`: friction by Karnopp, by Bouc and Wen or a
smooth tanh, integrated by Heun's method; a PID loop on the encoder's counts. The true torque of each instant
is known, so that the true parameters are those of the friction that acted while the joint slid.

    python tests/foreign_clocks.py [N [FIRST]]

prints what `rtctl identify --log` makes of N of them.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from dirty_logs import OFF, said_by

from hw.jit import compiled
from hw.motion import name as key

STEP_S = 1e-4
KARNOPP, BOUC_WEN, TANH = 0, 1, 2
SLIDES_LEAST = 10
"""Fewest rows that slide, of one in twenty, that have a friction."""

BEGINS, ENDS, MEASURED = "begins", "ends", "measured"


@dataclass(frozen=True)
class Loop:
    """A joint (SI) and what moves it and writes it down; a carriage in m, N and kg."""

    inertia: float = 0.012
    viscous: float = 0.05
    coulomb: float = 0.25
    peak: float = 1.15
    """Break-away over Coulomb friction."""
    law: int = KARNOPP
    travel: float = 0.6
    speed: float = 2.0
    """What a fast stroke has; a radian of the axis is half of it."""
    count: float = 1e-4
    program: str = "sines"
    hertz: float = 6.0
    """Of the loop that follows the program."""
    control_hz: float = 1000.0
    log_hz: float = 1000.0
    row: str = BEGINS
    filter_s: float = 0.0
    """Of the current that is measured, first order."""
    bus_s: float = 0.0
    """By how much later than its row a torque acted, or was measured earlier, besides what `row` says."""
    noise: float = 0.01
    """Of the torque written, share of Coulomb friction."""
    linear: bool = False
    seconds: float = 30.0
    seed: int = 1


@dataclass(frozen=True)
class Written:
    """Columns of the log, and the parameters that are right."""

    time: np.ndarray
    position: np.ndarray
    torque: np.ndarray
    truth: dict[str, float]


def wished(loop: Loop) -> np.ndarray:
    """Place the loop is sent to, at every step."""
    rng = np.random.default_rng(loop.seed)
    t = np.arange(round(loop.seconds / STEP_S)) * STEP_S
    if loop.program == "sines":
        hertz = np.array([0.23, 0.61, 1.27, 2.3]) * rng.uniform(0.8, 1.25, 4)
        share = np.array([1.0, 0.5, 0.22, 0.08])
        waves = share[:, None] * np.sin(2 * np.pi * hertz[:, None] * t + rng.uniform(0, 6.28, 4)[:, None])
        x = waves.sum(axis=0)
    elif loop.program == "strokes":
        x, at, first = np.zeros(len(t)), -1.0, 0
        while first < len(t):
            there, most = rng.uniform(-1, 1), rng.choice([0.1, 0.3, 1.0, 2.0])
            seconds = max(1.5 * abs(there - at) / most, 0.15)
            s = np.clip((t[first:] - t[first]) / seconds, 0, 1)
            x[first:] = at + (there - at) * s**2 * (3 - 2 * s)
            at, first = there, first + round((seconds + 0.15) / STEP_S)
    else:
        swept = 0.15 * t + 0.5 * (2.5 - 0.15) / t[-1] * t**2
        x = np.sin(2 * np.pi * swept) / (1 + 2 * t / t[-1])
    x = (x - x[0]) * np.minimum(1.0, t)
    x *= min(loop.travel / np.abs(x).max(), loop.speed / np.abs(np.gradient(x, STEP_S)).max())
    return x


@compiled
def _rubs(v, push, z, law, fc, fs, b, vs, slow, dt, bend):
    """Friction, and what its bristle is after dt."""
    level = fc + (fs - fc) * math.exp(-abs(v) / vs)
    if law == 0:
        if abs(v) < slow and abs(push) < fs:
            return push, z
        return math.copysign(level, v if abs(v) >= slow else push) + b * v, z
    if law == 1:
        z += dt * v / bend * (1.0 - abs(z) * (0.6 + 0.4 * math.copysign(1.0, v * z)))
        z = min(max(z, -1.0), 1.0)
        return level * z + b * v, z
    return level * math.tanh(v / slow) + b * v, z


@compiled
def _moved(goal, law, m, fc, fs, b, vs, slow, bend, kp, ki, kd, count, every, ahead, dt, out):
    """Position, velocity, torque and friction at every step; a command acts `ahead` steps after its turn."""
    x, v, z, integral, before, rate = goal[0], 0.0, 0.0, 0.0, goal[0], 0.0
    held = 0.0
    line = np.zeros(ahead + 1)
    for k in range(len(goal)):
        if k % every == 0:
            seen = math.floor(x / count) * count
            rate += 0.5 * ((seen - before) / (every * dt) - rate)
            before = seen
            integral += (goal[k] - seen) * every * dt
            goal_v = (goal[min(k + 1, len(goal) - 1)] - goal[k]) / dt
            held = kp * (goal[k] - seen) + ki * integral + kd * (goal_v - rate)
        line[k % (ahead + 1)] = held
        torque = line[(k + 1) % (ahead + 1)] if ahead else held
        friction, z = _rubs(v, torque, z, law, fc, fs, b, vs, slow, dt, bend)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3], out[k, 4], out[k, 5] = x, v, torque, friction, held, z
        a = (torque - friction) / m
        if law == 0 and a == 0.0:
            v = 0.0
            continue
        ahead_v = v + dt * a
        again, _ = _rubs(ahead_v, torque, z, law, fc, fs, b, vs, slow, dt, bend)
        mean = 0.5 * (a + (torque - again) / m)
        x += dt * (v + 0.5 * dt * mean)
        v += dt * mean


@cache
def written(loop: Loop) -> Written:
    """The log of that loop."""
    goal, rng = wished(loop), np.random.default_rng(loop.seed + 1)
    w = 2 * math.pi * loop.hertz
    kp, ki, kd = loop.inertia * w**2, 0.3 * loop.inertia * w**3, 1.4 * loop.inertia * w
    acts_late = round(loop.bus_s / STEP_S) if loop.row == BEGINS else 0
    out = np.empty((len(goal), 6))
    _moved(
        goal, loop.law, loop.inertia, loop.coulomb, loop.peak * loop.coulomb, loop.viscous,
        0.02 * loop.speed, 4e-3 * loop.speed, 1e-3 * loop.speed, kp, ki, kd, loop.count,
        round(1 / loop.control_hz / STEP_S), acts_late, STEP_S, out,
    )  # fmt: skip
    x, v, acted, friction, commanded, bent = out.T
    rows = np.arange(2, int(loop.seconds * loop.log_hz)) * round(1 / loop.log_hz / STEP_S)
    if loop.row == BEGINS:
        torque = commanded[rows]
    elif loop.row == ENDS:
        torque = acted[rows - 1]
    else:
        share = 1 - math.exp(-STEP_S / loop.filter_s) if loop.filter_s else 1.0
        torque = _followed(acted, share)[rows - round(loop.bus_s / STEP_S)]
    torque = torque + rng.normal(0, loop.noise * loop.coulomb, len(rows))
    built_up = (np.abs(bent) > 0.98) | (loop.law != BOUC_WEN)
    slides = np.flatnonzero((np.abs(v) > 0.03 * loop.speed) & built_up)[::20]
    # a program may be of slow strokes only (17): of no sliding there is no friction to be right about
    found = [math.nan, math.nan]
    if len(slides) >= SLIDES_LEAST:
        found = np.linalg.lstsq(np.column_stack([v, np.sign(v)])[slides], friction[slides], rcond=None)[0]
    truth = {"inertia_kgm2": loop.inertia, "viscous_nms_rad": found[0], "coulomb_nm": found[1]}
    return Written(rows * STEP_S, np.floor(x[rows] / loop.count) * loop.count, torque, truth)


def _followed(signal: np.ndarray, share: float) -> np.ndarray:
    from scipy.signal import lfilter

    return np.asarray(lfilter([share], [1, share - 1], signal))


def drawn(seed: int) -> Loop:
    """A loop by chance: joint, geared joint or carriage, moved and logged somehow."""
    rng = np.random.default_rng(1000 + seed)
    log_hz = float(rng.choice([100, 200, 250, 500, 1000]))
    control_hz = log_hz if rng.random() < 0.7 else max(1000.0, log_hz)
    row = str(rng.choice([BEGINS, BEGINS, ENDS, MEASURED]))
    kind = rng.integers(3)
    inertia = float(10 ** rng.uniform(-2.5, -1.3))
    base = Loop(
        inertia=inertia, coulomb=float(inertia * 10 ** rng.uniform(1.0, 1.5)),
        viscous=float(inertia * rng.uniform(2, 8)), peak=float(rng.uniform(1.0, 1.3)),
        law=int(rng.integers(3)), count=2 * math.pi / float(rng.choice([8192, 20000, 65536])),
        program=str(rng.choice(["sines", "strokes", "chirp"])), hertz=min(6.0, control_hz / 40),
        control_hz=control_hz, log_hz=log_hz, row=row,
        filter_s=float(rng.choice([0, 0.3e-3])) if row == MEASURED else 0.0,
        noise=float(rng.choice([0.002, 0.01, 0.03])), seed=seed,
    )  # fmt: skip
    if kind == 1:  # a gear: more friction for its inertia, a fine encoder, slower
        base = replace(base, coulomb=3 * base.coulomb, viscous=4 * base.viscous, count=base.count / 20)
    elif kind == 2:
        m = float(10 ** rng.uniform(-0.5, 0.7))
        rubs = {"coulomb": m * float(rng.uniform(1, 6)), "viscous": m * float(rng.uniform(2, 8))}
        count = float(rng.choice([1e-6, 5e-6, 2e-5]))
        base = replace(base, linear=True, inertia=m, travel=0.12, speed=0.4, count=count, **rubs)
    return base


def identified(loop: Loop, folder: Path, *more: str, log: Written | None = None):
    """Exit code, how far each parameter is off, the report as an object (empty if refused), the error; of the
    loop's own log, or of what was made of it.
    """
    log, path = log or written(loop), folder / "log.csv"
    np.savetxt(path, np.column_stack([log.time, log.position, log.torque]), delimiter=",",
               header="time_s,x,motor", comments="", fmt="%.9g")  # fmt: skip
    place, effort = ("m", "N") if loop.linear else ("rad", "Nm")
    code, out, err = said_by(
        "--log", str(path), "--column", f"position=x:{place}", "--column", f"torque=motor:{effort}",
        "--gear-ratio", "1", "--json", *more,
    )  # fmt: skip
    if code:
        return code, {}, {}, err
    found = json.loads(out)
    values = found["symmetric"]["parameters"]
    off = {name: values[key(name, found["motion"])]["value"] / true - 1 for name, true in log.truth.items()}
    return code, off, found, err


def main() -> None:
    count, first = (int(text) for text in (*sys.argv[1:], "30", "0")[:2])
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            loop = drawn(seed)
            code, off, found, error = identified(loop, Path(folder))
            wrong = any(not abs(off.get(name, 1)) <= most for name, most in OFF.items())
            verdict = "never slides" if np.isnan(list(off.values())).any() else "WRONG" if wrong else "right"
            shift = " ".join(f"{100 * each:+6.1f}" for each in off.values())
            late = found.get("remaining_delay_s") or {"value": math.nan}
            words = [f"{seed:3} {loop.log_hz:5g} Hz {loop.row:8} {code} {verdict} {shift}"]
            words += [f"left {1e3 * late['value']:+.2f} ms", *found.get("warnings", ()), error.strip()]
            sys.stdout.write("\n    ".join(word[:160] for word in words if word) + "\n")


if __name__ == "__main__":
    main()
