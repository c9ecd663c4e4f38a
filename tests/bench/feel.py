"""What a program that sets the world 60 times a second lets a hand feel, beside one that sets it every tick.

The joint makes one and the same motion in all runs, that of the mock in free space under its hand; only how
often the numbers are sent differs. What a program adds is the torque of the world less that of a run in which
the numbers stay as they were first. What the slow program adds is what the fast one adds, later (`delay`) and
smaller or larger (`softening`): both by least squares.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtctl.control.environments.coupling import coupling_torque
from rtctl.control.vocabulary import Environment, State
from rtctl.errors import RtctlError
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation
from tests.bench.row import Row

FRAMES_HZ = 60
SETTLE_S = 2.0
"""The world has grown by then."""

LATEST_MS = 40
NEAR = 0.05
"""A jump has arrived when what is felt is this near to its end."""

REST_TICKS = 4000

World = Mapping[str, float]
Motion = Callable[[float], World]


def _wave(mean: float, amplitude: float, hz: float, time_s: float) -> float:
    return mean + amplitude * float(np.sin(2 * np.pi * hz * time_s))


MOVING: dict[str, tuple[World, Motion]] = {
    "spring's centre, +-0.1 rad at 1 Hz": (
        {"kind": Environment.SPRING, "stiffness_nm_rad": 3.0},
        lambda t: {"center_rad": _wave(0.0, 0.1, 1.0, t)},
    ),
    "wall's face, +-0.02 rad at 1.3 Hz": (
        {"kind": Environment.WALL, "stiffness_nm_rad": 200.0, "side": 1},
        lambda t: {"center_rad": _wave(0.25, 0.02, 1.3, t)},
    ),
    "wall's stiffness, 20 to 180 N m/rad at 2 Hz": (
        {"kind": Environment.WALL, "center_rad": 0.25, "side": 1},
        lambda t: {"stiffness_nm_rad": _wave(100.0, 80.0, 2.0, t)},
    ),
}
"""What stays, and what the program moves; the joint swings +-0.3 rad."""

SPRING: World = {"kind": Environment.SPRING, "stiffness_nm_rad": 10.0, "center_rad": 0.05}
FREE: World = {"kind": Environment.FREE}
JUMPS: dict[str, tuple[World, World]] = {
    "free to a spring, 0.5 N m": (FREE, SPRING),
    "a spring to free": (SPRING, FREE),
    "a spring's centre, 0.05 to -0.05 rad": (SPRING, {"center_rad": -0.05}),
    "a spring to a wall pressing the other way": (
        SPRING,
        {"kind": Environment.WALL, "stiffness_nm_rad": 500.0, "center_rad": -0.02, "side": 1},
    ),
}

AWAY: World = {"kind": Environment.WALL, "stiffness_nm_rad": 500.0, "center_rad": 0.5, "side": 1}
DEEP: dict[str, tuple[World, World]] = {
    "a stiff wall whose face jumps 0.5 rad behind a resting hand": (AWAY, {"center_rad": -0.5}),
    "a wall that is set 0.5 rad behind a resting hand": (FREE, {**AWAY, "center_rad": -0.5}),
}


def swing(config: Path, seconds: float) -> np.ndarray:
    """Ticks of the mock, armed and compensated, moved by its hand through free space.

    Raises
    ------
    RtctlError
        The rig left ACTIVE: something else would be measured.
    """
    simulation = Simulation(load(config))
    simulation.arm(compensation=1.0)
    ticks = simulation.run(SETTLE_S + seconds)
    if simulation.state["state"][0] != State.ACTIVE:
        raise RtctlError(f"{config}: the rig left ACTIVE for {State(int(simulation.state['state'][0])).name}")
    return ticks


class _World:
    """Coupling and environment of the first axis alone, with the rig file's parameters."""

    def __init__(self, config: Path) -> None:
        rig = Simulation(load(config))
        self.period_s = rig.plan.period_s
        self._s, self._p, self._c = rig.state[0], rig.params[0], rig.command[0]

    def set(self, values: World) -> None:
        for name, value in values.items():
            self._c[f"environment_{name}"][0] = value

    def torque(self, position_rad: float = 0.0, velocity_rad_s: float = 0.0) -> float:
        """One tick at this position; N m."""
        s = self._s
        before = s["position_rad"][0]
        s["position_before_rad"][0], s["position_rad"][0] = before, position_rad
        s["velocity_rad_s"][0] = velocity_rad_s
        difference = (position_rad - before) / self.period_s
        return float(coupling_torque(s, self._p, self._c, 0, 1, difference, False))


def felt(config: Path, ticks: np.ndarray, standing: World, motion: Motion, every: int) -> NDArray[np.float64]:
    """Torque of the world on these ticks after `SETTLE_S`, N m; the program sends every so many of them."""
    world, torque = _World(config), np.empty(len(ticks))
    world.set(standing)
    for k, (x, v) in enumerate(zip(ticks["position_rad"][:, 0], ticks["velocity_rad_s"][:, 0], strict=True)):
        if k % every == 0:
            world.set(motion(k * world.period_s))
        torque[k] = world.torque(float(x), float(v))
    return torque[round(SETTLE_S / world.period_s) :]


def compare(slow: NDArray[np.float64], fast: NDArray[np.float64]) -> tuple[int, float, float]:
    """Delay of `slow` in ticks, its softening in per cent at that delay, and the RMS difference, N m.

    Notes
    -----
    For each delay d the gain g that makes g fast(k - d) nearest to slow(k); the d with the least remainder
    counts.
    """
    most = min(LATEST_MS, len(slow) - 1)
    later = slow[most:]
    least, delay, gain = np.inf, 0, 1.0
    for d in range(most + 1):
        early = fast[most - d : len(fast) - d]
        g = float(later @ early / (early @ early))
        rest = float(np.sum((later - g * early) ** 2))
        if rest < least:
            least, delay, gain = rest, d, g
    return delay, 100 * (1 - gain), float(np.sqrt(np.mean((slow - fast) ** 2)))


def at_rest(config: Path, before: World, after: World) -> NDArray[np.float64]:
    """Torque of the world on a joint held at 0, N m, on every tick after it jumped from `before` to
    `after`.
    """
    world = _World(config)
    world.set(before)
    for _ in range(REST_TICKS):
        world.torque()
    world.set(after)
    return np.array([world.torque() for _ in range(REST_TICKS)])


def arrival_ticks(torque: NDArray[np.float64], before_nm: float) -> int:
    """Ticks until the torque stays within `NEAR` of the whole jump from its end."""
    far = np.abs(torque - torque[-1]) > NEAR * np.max(np.abs(np.append(torque, before_nm) - torque[-1]))
    return int(np.flatnonzero(far)[-1]) + 2 if far.any() else 1


def rows(config: Path, seconds: float) -> list[Row]:
    """Delay, softening and RMS difference at 60 Hz, arrival of jumps, most torque of a world that grows."""
    rate_hz, ticks = load(config).config.loop.rate_hz, swing(config, seconds)
    return [
        *(_moving_row(config, name, rate_hz, ticks) for name in MOVING),
        *(_jump_row(config, name, rate_hz) for name in JUMPS),
        *(_deep_row(config, name) for name in DEEP),
    ]


def _moving_row(config: Path, name: str, rate_hz: float, ticks: np.ndarray) -> Row:
    standing, motion = MOVING[name]
    every = round(rate_hz / FRAMES_HZ)
    still = felt(config, ticks, standing, lambda _: motion(0.0), every)
    slow = felt(config, ticks, standing, motion, every) - still
    fast = felt(config, ticks, standing, motion, 1) - still
    delay, softer, rms = compare(slow, fast)
    text = (
        f"delay {1e3 * delay / rate_hz:.0f} ms, {softer:+.2f} % softer; the same motion with every tick set, "
        f"where the program adds {np.sqrt(np.mean(fast**2)):.4f} N m RMS"
    )
    return Row(f"RMS difference felt at {FRAMES_HZ} Hz: {name}", rms, "N m", text)


def _jump_row(config: Path, name: str, rate_hz: float) -> Row:
    before, after = JUMPS[name]
    torque = at_rest(config, before, after)
    arrived = 1e3 * arrival_ticks(torque, float(at_rest(config, before, {})[-1])) / rate_hz
    text = f"a resting joint, within {100 * NEAR:g} % of the jump; ends at {torque[-1]:+.3f} N m"
    return Row(f"arrival of a jump: {name}", arrived, "ms", text)


def _deep_row(config: Path, name: str) -> Row:
    most = float(np.max(np.abs(at_rest(config, *DEEP[name]))))
    text = f"joint at rest; torque limit {load(config).config.axis[0].torque_limit_nm:g} N m"
    return Row(f"most it presses: {name}", most, "N m", text)
