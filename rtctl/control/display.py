"""What is displayed may be changed while it runs: the virtual mass a little at a time, the kind of display by
way of nothing.

Mass and damping follow the command within what the rig file allows, over `CHANGE_S` at least. The mass keeps
its speed, so no torque jumps; a heavier one at that speed has (m after - m before) v_r^2/2 more, which the
renderer's store pays first, as it pays a step of the environment (`environments.changes`). Damping takes
energy only. It rises no faster than the gate can follow what it does to the speed of the mass.

Between impedance and admittance there is nothing in between: the display that ends fades to nothing within
`stop_ticks`, the other begins at the joint and fades in as a soft start does, its stored energy paid
(`authority`). While a share h is felt, the world felt is h U, and so the accounts take it. A mass begins with
the joint's speed, as far as the store pays for it."""

from __future__ import annotations

import math

from rtctl.control.authority import affordable
from rtctl.control.environments.changes import HALVINGS, RAISE_SHARE, pay, towards
from rtctl.control.jit import compiled
from rtctl.control.records import Record
from rtctl.control.vocabulary import Display, State

CHANGE_S = 0.1
"""Least time in which mass and damping go from one end of what may be asked for to the other."""

_ACTIVE = int(State.ACTIVE)
_ADMITTANCE = int(Display.ADMITTANCE)


@compiled
def is_admittance(s: Record, axis: int) -> bool:
    """True while the axis is displayed as a virtual mass."""
    return s.display_kind[axis] == _ADMITTANCE


@compiled
def _asked_kind(p: Record, c: Record, axis: int) -> float:
    """The display to be in force: the rig file's, or the command's where it may change."""
    if p.display_change[axis] == 0:
        return float(p.display_kind[axis])
    return float(_ADMITTANCE) if c.display_kind[axis] == _ADMITTANCE else 0.0


@compiled
def begin_display(s: Record, p: Record, c: Record, axis: int) -> None:
    """Take the display that is asked for at once where nothing of it is felt: outside ACTIVE."""
    if s.state != _ACTIVE or s.ticks == 0:  # the zeroed state shows an impedance, whatever the rig file says
        s.display_kind[axis] = _asked_kind(p, c, axis)
        s.display_faded[axis] = 0.0


@compiled
def _exchange(s: Record, axis: int, kind: float) -> None:
    """Begin the other display at the joint: nothing of the last is left, and nothing of this one is felt
    yet."""
    s.display_kind[axis] = kind
    s.proxy_set_count[axis] = 0
    s.mass_injected_nms_rad[axis] = 0.0


@compiled
def fade_display(s: Record, p: Record, c: Record, axis: int) -> float:
    """Share of the display that is felt in this tick, 0 to 1; scales what is stored and granted by it.

    Notes
    -----
    After the display's torque, whose world `state.stored_energy_j` is. A command that is not finite changes
    nothing: the law stops on it."""
    kind = _asked_kind(p, c, axis)
    same = s.display_kind[axis] == kind
    if same and s.display_faded[axis] == 0.0:
        return 1.0
    rise = 0.0
    if not same:
        # out as quickly as a stop
        s.display_faded[axis] = min(1.0, s.display_faded[axis] + 1.0 / max(p.stop_ticks, 1))
    else:
        rise = min(s.display_faded[axis], 1.0 / max(p.soft_start_ticks, 1))  # in as slowly as a soft start
        rise = affordable(s, p, axis, rise)
        s.display_faded[axis] -= rise
    share = 1.0 - s.display_faded[axis]
    s.renderer_grant_j[axis] *= share  # granted and stored as far as they are felt
    if rise > 0.0:
        pay(s, axis, rise * s.stored_energy_j[axis])  # before it is scaled: a rise puts in U da (3.4)
    s.stored_energy_j[axis] *= share
    if not same and share == 0.0:
        _exchange(s, axis, kind)
    return share


@compiled
def felt_share(s: Record, axis: int) -> float:
    """Share of the display's torque that is sent, 0 to 1."""
    return float(s.authority * (1.0 - s.display_faded[axis]))


@compiled
def helped_share(s: Record, p: Record, axis: int) -> float:
    """Share of the help with friction that is in force, 0 to 1: while a mass is shown never more than is
    certified.

    An impedance that gives way to a mass, or follows it, has come down to that share by the time that nothing
    of it is felt."""
    mass = 1.0 if is_admittance(s, axis) else float(s.display_faded[axis])
    return 1.0 - (1.0 - float(p.mass_compensation[axis])) * mass


@compiled
def start_speed(s: Record, axis: int) -> float:
    """Speed with which a virtual mass begins, rad/s: the joint's, as far as the store pays for its energy."""
    mass, speed = s.mass_kgm2[axis], s.velocity_rad_s[axis]
    if not (s.state == _ACTIVE and mass > 0.0):
        return 0.0
    # a mass in motion is energy that no hand brought
    speed = towards(0.0, speed, math.sqrt(2.0 * max(s.renderer_store_j[axis], 0.0) / mass))
    pay(s, axis, 0.5 * mass * speed * speed)
    return speed


@compiled
def _within(asked: float, least: float, most: float) -> float:
    """`asked`, or the nearest that the rig file allows."""
    return min(max(asked, least), max(least, most))


@compiled
def follow_mass(s: Record, p: Record, c: Record, axis: int, resting: bool) -> None:
    """Bring mass and damping one tick nearer to those asked for; at once while the mass rests.

    Notes
    -----
    The command is finite (`environments.laws.finite_command`)."""
    mass = _within(c.mass_kgm2[axis], p.mass_kgm2[axis], p.mass_max_kgm2[axis])
    least, most = p.mass_damping_nms_rad[axis], p.mass_damping_max_nms_rad[axis]
    damping = _within(c.mass_damping_nms_rad[axis], least, most)
    if resting:
        s.mass_kgm2[axis], s.mass_damping_nms_rad[axis] = mass, damping
        return
    if s.mass_damping_nms_rad[axis] != damping:
        step = (most - least) * p.period_s / CHANGE_S
        slowed = p.servo_velocity_gain_nms_rad[axis] * p.period_s * abs(s.mass_velocity_rad_s[axis])
        if damping > s.mass_damping_nms_rad[axis] and slowed > 0.0:  # less damping brakes nothing
            step = min(step, RAISE_SHARE * p.torque_rate_nm[axis] * s.mass_kgm2[axis] / slowed)
        s.mass_damping_nms_rad[axis] = towards(s.mass_damping_nms_rad[axis], damping, step)
    if s.mass_kgm2[axis] != mass:
        _step_mass(s, p, axis, mass)


@compiled
def _step_mass(s: Record, p: Record, axis: int, wanted: float) -> None:
    """One paid step of the virtual mass at its speed."""
    before = s.mass_kgm2[axis]
    step = (
        towards(before, wanted, (p.mass_max_kgm2[axis] - p.mass_kgm2[axis]) * p.period_s / CHANGE_S) - before
    )
    for _ in range(HALVINGS):
        work = 0.5 * step * s.mass_velocity_rad_s[axis] ** 2
        if work <= s.renderer_store_j[axis]:
            s.mass_kgm2[axis] = before + step
            pay(s, axis, work)
            return
        step *= 0.5
