"""The help of the first releases forced on an engine's joint: seen within 3 s where it shakes?
`python tests/foreign_engine/forced.py --engine dart` (decision 0181).

Hands of `tests/acceptance/test_still_hands.py`, which hold still after a motion, each with help and without.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import click
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from first_help import AS_IN_THE_FIRST_RELEASES, FORGETS_S, forget
from foreign_moved import name_of

from foreign_engine import plants, rig
from foreign_engine.engines import ROWS
from foreign_engine.left import JOINTS, loaded_for
from rtctl.control.vocabulary import Policy

HANDS = {"100, .3": (100.0, 0.3), "5, .1": (5.0, 0.1), "20, .1": (20.0, 0.1)}
"""N m/rad, N m s/rad."""
FROM_S, MOVED_S, HELD_S, LATE_S = 3.0, 4.0, 5.0, 2.0
LENGTHS = {"told 1.9 mrad": 1.9e-3, "told .3 mrad": 3e-4, "as it is": 0.0}
"""Presliding lengths that the account of the first help is told; the last is today's help, nothing forced."""


def sine(time_s):
    return 0.3 * np.sin(np.pi * np.clip(time_s - FROM_S, 0.0, MOVED_S))


def held(loaded, joint, hand, length, device, policy=None):
    """(rad/s RMS until the fault or the end, and from 2 s on; the end, s after the motion; the fault)."""
    made = plants.Hand("arm", 0.002, *hand, 500.0, 0.3)
    one = rig.Rig(loaded, joint, made, plants.World(), device, 21, policy)
    forced = AS_IN_THE_FIRST_RELEASES | {"presliding_rad": length}
    for name, value in forced.items():
        if policy is None and length:
            one.law[2][name] = value
    one.wish = sine
    if not one.arm():
        raise click.ClickException("not armed in time")
    one.run(FROM_S + MOVED_S - one.time_s)
    speeds = []
    while one.active and len(speeds) < HELD_S / FORGETS_S:
        if policy is None and length:
            forget(one.law[1])
        speeds.append(one.run(FORGETS_S)[:, :2])
    speed = np.concatenate(speeds) if speeds else np.zeros((1, 2))
    late = round(LATE_S / one.period_s)
    loud = [float(np.sqrt(np.square(of).mean(axis=0).max())) for of in (speed, speed[late:]) if len(of)]
    return loud, one.time_s - FROM_S - MOVED_S, -1 if one.active else one.fault


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--engine", choices=ROWS, default="mujoco")
    parser.add_argument("--step", type=float, default=1e-4, help="of the engine, s")
    parser.add_argument("--factor", type=float, default=1.0, help="of the joint's friction, in the model")
    asked = parser.parse_args()
    device = plants.Device(force_noise=0.005, step_s=asked.step, engine=asked.engine)
    click.echo(
        "| joint | hand | length | mrad/s RMS, from 2 s on; without help | fault | s after the motion |"
    )
    with tempfile.TemporaryDirectory() as folder:
        for name, joint in JOINTS.items():
            more = joint._replace(dry=asked.factor * joint.dry, link_dry=asked.factor * joint.link_dry)
            loaded = loaded_for(more, "hybrid", folder)
            for hand, numbers in HANDS.items():
                plain, _, _ = held(loaded, joint, numbers, 0.0, device, Policy.OFF)
                for length, told in LENGTHS.items():
                    loud, after_s, fault = held(loaded, joint, numbers, told, device)
                    said = "; ".join(", ".join(f"{1e3 * one:.1f}" for one in of) for of in (loud, plain))
                    click.echo(f"| {name} | {hand} | {length} | {said} | {name_of(fault)} | {after_s:.2f} |")


if __name__ == "__main__":
    main()
