"""Does help with friction shake a hand that moves the joint, slowly or briskly?
`python -m tests.bench.slow_hands`.

The joints and hands of `rtctl campaign --still`, without those that let go; the hand swings to and fro, at
most at each speed of `SWINGS_HZ`. What is judged is what is left of the true speed beside its mean over
`MEAN_S`, taken twice (of a hand's own swing so little is left that it is nothing), RMS, with the hybrid
policy, the observer alone and without help: of the whole motion, turns and all, and of the strokes between
the turns. A joint that sticks and slips has much of it in any case; shaken by the help is who has more than
twice that of both others, and `FELT_RAD_S`.
"""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import click
import numpy as np

from rtctl.simulation.campaign_still_cases import Case, drawn, rig

SWINGS_HZ = {0.03: 0.1, 0.08: 0.1, 0.3: 0.25, 0.8: 0.5, 1.6: 0.8}
"""Swings a second of a hand whose largest speed is this, rad/s."""
MEAN_S = 0.06
"""To both sides."""
STROKE = 0.5
"""Faster than this share of the hand's largest speed the joint is between two turns."""
SECONDS = 10.0
FELT_RAD_S = 0.005
POLICIES = ("hybrid", "observer", "off")


@dataclass(frozen=True)
class Swung:
    """What the joint of a case did beside the motion of its hand, RMS, rad/s."""

    whole: float
    strokes: float


def _mean(speed: np.ndarray, n: int) -> np.ndarray:
    return np.convolve(speed, np.full(2 * n + 1, 1 / (2 * n + 1)), "valid")


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0


def swung(case: Case, fastest_rad_s: float) -> Swung:
    """Run the hand of this case at most at this speed."""
    turning_rad_s = 2 * math.pi * SWINGS_HZ[fastest_rad_s]
    simulation = rig(replace(case, amplitude_rad=fastest_rad_s / turning_rad_s))
    simulation.plant_params["hand_sine_rad_s"] = turning_rad_s
    simulation.arm()
    simulation.run(1.0)
    simulation.run(SECONDS)
    speed = simulation.truth["velocity_rad_s"][:, 0]
    n = round(MEAN_S / simulation.plan.period_s)
    beside = speed[n:-n] - _mean(speed, n)
    beside = beside[n:-n] - _mean(beside, n)
    on = np.abs(_mean(speed, n))[n:-n] > STROKE * fastest_rad_s
    return Swung(_rms(beside), _rms(beside[on]))


@dataclass(frozen=True)
class Asked:
    """Case `index` of this seed at this speed."""

    seed: int
    index: int
    fastest_rad_s: float


def of_policies(asked: Asked) -> tuple[Case, list[Swung]]:
    """The case, and what each of `POLICIES` leaves in its motion."""
    case = drawn(asked.seed, asked.index, ("off",))
    return case, [swung(replace(case, policy=policy), asked.fastest_rad_s) for policy in POLICIES]


def is_shaken(left: list[Swung]) -> bool:
    """True where the first of `POLICIES` has more than twice what both others have, whole or between the
    turns.
    """
    hybrid, *others = left
    return any(
        getattr(hybrid, part) > 2 * max(getattr(one, part) for one in others) + FELT_RAD_S
        for part in ("whole", "strokes")
    )


def _say(name: str, found: list[list[Swung]]) -> None:
    click.echo(f"{name}: {sum(map(is_shaken, found))} of {len(found)} shaken by the help")
    for at, policy in enumerate(POLICIES):
        whole, strokes = (
            1e3 * np.array([getattr(one[at], part) for one in found]) for part in ("whole", "strokes")
        )
        click.echo(
            f"  {policy:9s} median {np.median(whole):.1f}, nine of ten below {np.quantile(whole, 0.9):.1f}, "
            f"most {whole.max():.1f} mrad/s; between the turns {np.median(strokes):.1f}, "
            f"{np.quantile(strokes, 0.9):.1f}, {strokes.max():.1f}"
        )


def main() -> None:
    """Run the cases and print what they left."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--speeds", type=float, nargs="+", choices=SWINGS_HZ, default=list(SWINGS_HZ), help="rad/s"
    )
    options = parser.parse_args()
    holding = [i for i in range(options.cases) if drawn(options.seed, i, ("off",)).hand_stiffness_nm_rad > 0]
    asked = [Asked(options.seed, index, speed) for speed in options.speeds for index in holding]
    with ProcessPoolExecutor(options.jobs) as pool:
        found = list(pool.map(of_policies, asked, chunksize=4))
    for speed in options.speeds:
        for joint in ("elastic", "rigid"):
            of_joint = [
                left
                for one, (case, left) in zip(asked, found, strict=True)
                if one.fastest_rad_s == speed and (case.joint_hz > 0) == (joint == "elastic")
            ]
            if of_joint:
                _say(f"{joint}, {speed:g} rad/s", of_joint)
    for one, (case, left) in zip(asked, found, strict=True):
        if is_shaken(left):
            figures = ", ".join(f"{1e3 * each.whole:.1f} ({1e3 * each.strokes:.1f})" for each in left)
            click.echo(f"{one.fastest_rad_s:g} rad/s, seed {one.seed}: {figures} mrad/s: {case}")


if __name__ == "__main__":
    main()
