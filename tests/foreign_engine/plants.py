"""Joints, hands and worlds in numbers, and as MuJoCo reads them: all that moves is the engine's, no line of
ours.

Dry friction is a constraint of the solver, without bristles; a soft gear is a tendon; a hand is an arm on a
grip that yields, two links with muscles, a palm that only pushes, fingers that slip, or one that leans; walls
and balls are contacts. The handle is .1 m from the axis; rad, N m, s.
"""

import math
from typing import NamedTuple

import numpy as np

LEVER_M = 0.1
YIELDS = 0.3
"""Impedance of the arm's grip, by MuJoCo's name."""
DRY = 'solreffriction="{0} 1" solimpfriction=".9995 .9999 1e-6"'
"""As little creep as the solver allows: 5e-5 of the joint's acceleration under its load, times {0}."""


class Joint(NamedTuple):
    """Motor and link (0: one with the motor); dry and viscous friction of both."""

    motor: float = 0.012
    viscous: float = 0.05
    dry: float = 0.25
    link: float = 0.0
    gear: float = 0.0
    gear_damping: float = 0.0
    link_viscous: float = 0.0
    link_dry: float = 0.0


class Hand(NamedTuple):
    """What holds the handle: `arm`, `muscles`, `palm`, `fingers`, `leans` or nobody; its mass in kg m^2 about
    the joint's axis, N m/rad, N m s/rad; the reflex as a share of the spring, s late; N m it leans with."""

    kind: str = "arm"
    mass: float = 0.01
    spring: float = 10.0
    damper: float = 0.2
    grip: float = 100.0
    grip_damping: float = 0.3
    reflex: float = 0.0
    reflex_s: float = 0.04
    leans: float = 0.0
    soft_s: float = 0.02


class World(NamedTuple):
    """`wall` or `ball` where the handle hits it, rad; soft by a time constant, s; the ball's mass, kg."""

    kind: str = ""
    at: float = 0.2
    soft_s: float = 0.005
    mass: float = 0.05


class Device(NamedTuple):
    """As in `foreign_arms`; `step_s` of the engine, a row of `engines`."""

    late_ticks: float = 0.0
    lag_s: float = 0.0
    sample_ticks: int = 1
    force_noise: float = 0.0
    current_noise: float = 0.002
    step_s: float = 1e-4
    engine: str = "mujoco"


def _links(j, step_s):
    """Motor and link; what is at the handle goes in at {}."""
    dry = DRY.format(2 * step_s)
    tiny = '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'

    def body(name, inertia, damping, friction, inside):
        return (
            f'<body name="{name}"><joint name="{name}" axis="0 0 1" armature="{inertia}" damping="{damping}" '
            f'frictionloss="{friction}" {dry}/>{tiny}{inside}</body>'
        )

    handle = (
        f'<body name="handle" pos="{LEVER_M} 0 0"><inertial pos="0 0 0" mass="2e-3" '
        'diaginertia="1e-8 1e-8 1e-8"/><site name="felt"/>'
        '<geom name="handle" type="capsule" size=".01 .02"/></body>'
    )
    if j.link == 0:
        return body("motor", j.motor, j.viscous, j.dry, handle), ""
    return (
        body("motor", j.motor, j.viscous, j.dry, "")
        + body("link", j.link, j.link_viscous, j.link_dry, handle),
        f'<fixed name="gear" stiffness="{j.gear}" damping="{j.gear_damping}" springlength="0">'
        '<joint joint="motor" coef="1"/><joint joint="link" coef="-1"/></fixed>',
    )


def _servo(joint, spring, damper):
    return f'<general joint="{joint}" biastype="affine" gainprm="1" biasprm="0 {-spring} {-damper}"/>'


def _hand(h):
    """(bodies, equalities, actuators) of a hand."""
    if h.kind == "nobody":
        return "", "", ""
    if h.kind == "muscles":
        return _muscles(h)
    inertia = f'armature="{h.mass}"'
    soft = f'solref="{h.soft_s} 1" solimp=".9 .98 .002"'
    tiny = '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'
    side = 'type="capsule" size=".012 .02" contype="2" conaffinity="1"'
    inside, held, servo = "", "", _servo("arm", h.spring, h.damper)
    if h.kind == "arm":
        inside = f'<site name="hold" pos="{LEVER_M} 0 0"/>'
        held = (
            f'<connect name="hold" site1="felt" site2="hold" solref="-1 -1" solimp="{YIELDS} {YIELDS} .001"/>'
        )
    elif h.kind == "fingers":  # from both sides along the axis: the handle slides between them
        for way in (1, -1):
            inside += (
                f'<body name="finger{way}" pos="{LEVER_M} 0 {0.04 * way}"><joint name="finger{way}" '
                'type="slide" axis="0 0 1" damping="2"/>'
                '<inertial pos="0 0 0" mass=".02" diaginertia="1e-6 1e-6 1e-6"/>'
                f'<geom type="box" size=".02 .03 .01" contype="2" conaffinity="1" {soft} friction=".8"/>'
                "</body>"
            )
        servo += "".join(f'<motor joint="finger{way}" gear="{-way}"/>' for way in (1, -1))
    else:  # palm, leans: on the side away from positive angles, and for a palm also on the other
        for way in (-1, 1) if h.kind == "palm" else (-1,):
            inside += f'<geom {side} {soft} pos="{LEVER_M} {0.0221 * way} 0"/>'
    body = f'<body name="arm"><joint name="arm" axis="0 0 1" {inertia}/>{tiny}{inside}</body>'
    return body, held, servo


ELBOW, FORE, PALM = np.array([0.14, -0.34]), 0.25, 0.1
"""Where the forearm turns, its length and the hand's, m."""


def _arm_angles(q):
    """Elbow and wrist for the handle at these angles of the joint, shape (n, 2)."""
    at = LEVER_M * np.stack([np.cos(q), np.sin(q)], -1) - ELBOW
    far = np.hypot(*at.T)
    bend = np.arccos(np.clip((far**2 - FORE**2 - PALM**2) / (2 * FORE * PALM), -1, 1))
    first = np.arctan2(at[..., 1], at[..., 0]) - np.arctan2(PALM * np.sin(bend), FORE + PALM * np.cos(bend))
    return np.stack([first, bend], -1)


def _muscles(h):
    """Forearm and hand with two pairs of muscles; the handle is held by a soft constraint."""
    e, w = _arm_angles(np.zeros(1))[0]
    fore, palm = h.mass / LEVER_M**2, 0.3 * h.mass / LEVER_M**2

    def inertial(mass, length):
        about = " ".join([str(mass * length**2 / 12)] * 3)
        return f'<inertial pos="{length / 2} 0 0" mass="{mass}" diaginertia="{about}"/>'

    body = (
        f'<body name="fore" pos="{ELBOW[0]} {ELBOW[1]} 0" euler="0 0 {e}"><joint name="elbow" axis="0 0 1" '
        f'damping=".05"/>{inertial(fore, FORE)}'
        f'<body name="palm" pos="{FORE} 0 0" euler="0 0 {w}"><joint name="wrist" axis="0 0 1" damping=".01"/>'
        f'{inertial(palm, PALM)}<site name="hold" pos="{PALM} 0 0"/></body></body>'
    )
    held = f'<connect name="hold" site1="felt" site2="hold" solref="{h.soft_s} .8" solimp=".9 .95 .001"/>'
    made = ""
    for name, share in (("elbow", 4.0), ("wrist", 0.4)):
        for gear in (-1, 1):  # a muscle pulls
            made += (
                f'<muscle joint="{name}" gear="{gear}" force="{share * h.spring}" lengthrange="-1.5 1.5" '
                'range=".7 1.15" timeconst=".012 .04"/>'
            )
    return body, held, made


def _world(w):
    if not w.kind:
        return ""
    x, y = LEVER_M * math.cos(w.at), LEVER_M * math.sin(w.at)
    soft = f'contype="4" conaffinity="1" solref="{w.soft_s} 1" solimp=".9 .98 .001"'
    push = 0.01 + 0.0101
    at = f"{x - push * math.sin(w.at)} {y + push * math.cos(w.at)} 0"
    if w.kind == "wall":
        return f'<geom type="box" size=".05 .01 .05" pos="{at}" euler="0 0 {w.at}" {soft}/>'
    return (
        f'<body pos="{at}"><joint type="slide" axis="{-math.sin(w.at)} {math.cos(w.at)} 0" stiffness="60" '
        f'damping=".1"/><geom type="sphere" size=".01" mass="{w.mass}" {soft}/></body>'
    )


def xml(j, h, w, device):
    """The whole rig as MuJoCo reads it."""
    links, gear = _links(j, device.step_s)
    body, held, servos = _hand(h)
    lag = f'dyntype="filterexact" dynprm="{device.lag_s}"' if device.lag_s > 0 else ""
    return (
        f'<mujoco><compiler angle="radian" autolimits="true"/>'
        f'<option timestep="{device.step_s}" gravity="0 0 0" '
        'iterations="50" tolerance="1e-14"><flag eulerdamp="disable"/></option>'
        f"<worldbody>{links}{body}{_world(w)}</worldbody><tendon>{gear}</tendon>"
        f'<equality>{held}</equality><actuator><general joint="motor" {lag}/>{servos}</actuator>'
        '<sensor><force site="felt"/></sensor></mujoco>'
    )
