"""Numbers of rigs of another make, drawn at random: joints, hands, devices; a carriage's from a joint's."""

import math

import numpy as np
from foreign_rig import DEVICE, HAND, JOINT

_OF_LENGTH = {
    "motor": -2, "viscous": -2, "bristle": -2, "link": -2, "gear": -2, "gear_damping": -2, "spring": -2,
    "damper": -2, "mass": -2, "grip": -2, "grip_damping": -2, "stiffening": -2, "coulomb": -1,
    "breakaway": -1, "cogging": -1, "stribeck": 1, "amplitude": 1, "waves": -1, "cogs": -1,
}  # fmt: skip
"""Powers of a handle's distance by which a joint's numbers become those of a carriage."""


class Luck:
    """Numbers of one case."""

    FIRST = 20261125

    def __init__(self, *seed):
        self.draw = np.random.default_rng((self.FIRST, *seed))

    def spread(self, low, high):
        return float(np.exp(self.draw.uniform(math.log(low), math.log(high))))

    def within(self, low, high):
        return float(self.draw.uniform(low, high))

    def one(self, *of):
        return of[int(self.draw.integers(len(of)))]


def joint(luck):
    """A joint, rigid or elastic, whose friction may grow with its load."""
    inertia, dry = luck.spread(0.003, 0.04), luck.spread(0.08, 0.5)
    made = dict(
        JOINT, motor=inertia, viscous=luck.spread(0.01, 0.15), coulomb=dry,
        breakaway=dry * luck.within(1.05, 1.6), stribeck=luck.spread(0.03, 0.3),
        bristle=4 * dry * luck.spread(60, 2000), exponent=luck.one(0.6, 1.0, 1.5),
        backward=luck.within(0.95, 1.08), load_motor=luck.one(0.0, 0.0, luck.within(0.0, 0.3)),
        load_hand=luck.one(0.0, 0.0, luck.within(0.0, 0.3)), warming_per_s=luck.within(-0.01, 0.01),
    )  # fmt: skip
    if luck.one(True, False):
        share, hz = luck.within(0.2, 0.7), luck.spread(20, 150)
        link, motor = share * inertia, (1 - share) * inertia
        gear = link * motor / inertia * (2 * math.pi * hz) ** 2
        damping = 2 * luck.within(0.001, 0.03) * math.sqrt(gear * link * motor / inertia)
        made |= {"motor": motor, "link": link, "gear": gear, "gear_damping": damping}
    return made


def hand(luck):
    """A hand that swings the joint for some seconds, and may stiffen, grip late, or tap."""
    grip, mass = luck.spread(20, 3000), luck.one(0.0, luck.spread(1e-4, 0.1))
    made = dict(
        HAND, spring=luck.spread(2, 600), damper=luck.one(1e-3, luck.spread(1e-3, 1.0)), mass=mass,
        grip=grip, grip_damping=luck.one(0.0, 0.1, 0.4) * math.sqrt(grip * mass),
        stiffening=luck.one(0.0, 30.0, 300.0), hz=luck.one(0.3, 0.5, 1.0, 2.0), from_s=2.5,
        to_s=luck.within(4.0, 6.0),
    )  # fmt: skip
    kind = luck.one("even", "even", "grips", "taps")
    if kind == "grips":
        made |= {"relaxed": luck.within(0.01, 0.5), "grips_s": luck.within(2.6, 7.0)}
    if kind == "taps":
        made |= {"mass": luck.spread(1e-3, 0.03), "taps": 1.0, "hz": luck.one(2.0, 4.0, 6.0)}
    return made | {"amplitude": min(luck.spread(0.05, 0.4), 2.5 / (2 * math.pi * made["hz"]))}


def device(luck, delay_ticks, lag_hz):
    """Motor and sensors: a force sensor with a low-pass of 30 to 200 Hz, some ms late, whose zero drifts."""
    return dict(
        DEVICE, delay_ticks=delay_ticks, lag_s=1 / (2 * math.pi * lag_hz) if lag_hz else 0.0,
        current_noise=luck.one(0.0, 0.005), force_step=0.005, force_bias=0.3,
        force_lag_s=luck.one(0.0, 1 / (2 * math.pi * luck.spread(30, 200))),
        force_delay_s=luck.one(0.0, luck.spread(1e-3, 6e-3)),
        force_noise=luck.one(0.0, luck.spread(1e-3, 0.03)),
        force_drift_per_s=luck.one(0.0, luck.within(-0.01, 0.01)),
    )  # fmt: skip


def on_rail(numbers, length):
    """The same at a handle so far from the joint: in m and N."""
    return {name: value * length ** _OF_LENGTH.get(name, 0) for name, value in numbers.items()}
