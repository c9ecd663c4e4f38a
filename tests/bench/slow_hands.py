"""Does help with friction shake a hand that moves the joint slowly? `python -m tests.bench.slow_hands`.

The joints and hands of `rtctl campaign --still`, without those that let go; the hand swings once in ten seconds, at most at each of `SPEEDS_RAD_S`.
What is judged is what is left of the true speed beside its mean over `MEAN_S`, RMS, with the hybrid policy, the observer alone and without
help. A joint that sticks and slips has much of it in any case; shaken by the help is who has more than twice that of both others, and `FELT_RAD_S`.
"""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import click
import numpy as np

from rtctl.campaign.still_cases import Case, drawn, rig

SPEEDS_RAD_S = (0.03, 0.08)
SWING_HZ = 0.1
MEAN_S = 0.06
FELT_RAD_S = 0.005
POLICIES = ("hybrid", "observer", "off")


def shaken_rad_s(case: Case, fastest_rad_s: float) -> float:
    """RMS speed beside the motion of the hand that swings the joint of this case."""
    turning_rad_s = 2 * math.pi * SWING_HZ
    simulation = rig(replace(case, amplitude_rad=fastest_rad_s / turning_rad_s))
    simulation.plant_params["hand_sine_rad_s"] = turning_rad_s
    simulation.arm()
    simulation.run(1.0)
    simulation.run(1 / SWING_HZ)
    speed = simulation.truth["velocity_rad_s"][:, 0]
    n = round(MEAN_S / simulation.plan.period_s)
    beside = speed[n:-n] - np.convolve(speed, np.full(2 * n + 1, 1 / (2 * n + 1)), "valid")
    return float(np.sqrt(np.mean(np.square(beside))))


def shaken(asked: tuple[int, int, float]) -> tuple[bool, list[float]]:
    """Of case `index` of this seed at this speed: whether its joint is elastic, and what each policy leaves, rad/s."""
    seed, index, fastest_rad_s = asked
    case = drawn(seed, index, ("off",))
    return case.joint_hz > 0, [
        shaken_rad_s(replace(case, policy=policy), fastest_rad_s) for policy in POLICIES
    ]


def main() -> None:
    """Run the cases and print what they left."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    holding = [i for i in range(options.cases) if drawn(options.seed, i, ("off",)).hand_stiffness_nm_rad > 0]
    asked = [(options.seed, index, speed) for index in holding for speed in SPEEDS_RAD_S]
    with ProcessPoolExecutor(options.jobs) as pool:
        found = list(pool.map(shaken, asked, chunksize=4))
    for elastic in (False, True):
        left = np.array([values for is_elastic, values in found if is_elastic == elastic])
        hybrid, others = left[:, 0], left[:, 1:].max(axis=1)
        felt = int(np.sum(hybrid > 2 * others + FELT_RAD_S))
        click.echo(f"{'elastic' if elastic else 'rigid'}: {felt} of {len(left)} shaken by the help")
        for policy, values in zip(POLICIES, left.T, strict=True):
            click.echo(
                f"  {policy:9s} median {1e3 * np.median(values):.1f}, nine of ten below {1e3 * np.quantile(values, 0.9):.1f}, "
                f"most {1e3 * values.max():.1f} mrad/s"
            )


if __name__ == "__main__":
    main()
