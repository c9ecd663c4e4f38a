"""Intermediate representations: what a renderer sets follows its command at a bounded rate and power.

A graphics program at 60 Hz describes the world near the joint (a wall's face, a spring, a moving proxy) and
the law renders it every tick. Each step of such a parameter does work on what the coupling and the
environment store. With p the proxy, x the joint, V the environment's potential and U = V + k_c (x - p)^2/2,

    W = U(x, p after; parameters after) - U(x, p before; parameters before)

is that work exactly, for the joint stands still while a parameter is stepped. It is paid from a store that
holds `renderer_store_j` at most and refills at `renderer_power_w`; a step that costs more than is there is
halved until it does not. Therefore, whatever the stream of parameters, with the torque -f_(k-1) that is held
while the joint moves by D_k, and d_0 the slip of the coupling's damper in the first torque held (derived in
`tests/properties/test_intermediate_passivity.py`),

    sum f_(k-1) D_k + (k_c/2 + b_c/T) D_k^2
        >=  -U_0 - b_c d_0^2/(2 T) - renderer_store_j - renderer_power_w t    (1)

What holding the torque costs, the second term, is what the device's own damping is there for (SD-1).
The gate's torque limit keeps (1): a spring that saturates gives out P <= U, and as long as only one number
moves at a time, P and U rise and fall together with |dP| <= |dU|. So stiffness and centre are stepped and
paid one after the other: what one gives back does not pay for the other.

The gate's rate limit r per tick does not: torque that lags behind a spring of stiffness K (coupling and
environment in series) is a source of energy, as soon as the joint is faster than v = r/(K T). Therefore a
step that costs energy or stiffens is taken only while it leaves

    U + J v_joint^2/2  <=  J v^2/2,   v = min(MOTION_SHARE r/(K T), v_max)                               (2)

(and U <= L^2/(2 K), beyond which the limit L hides it). What the renderer has set then cannot make the joint
outrun the gate, whatever is in the store; what is left of r beside motion is what the steps may use. A hand
that brings more energy than (2) finds a softer environment, until it is slower.

What a hand can be given at most, whatever is sent: since arming, beyond what it put in itself,
`renderer_store_j + renderer_power_w t + 1.5 budget_j` (`passivity`; the rise of the authority is paid too:
`authority`).

What has no way in between (the kind, and parameters that are a kind's own: side, pitch) is exchanged while
stiffness and damping are zero."""

from __future__ import annotations

import math

from hw.jit import compiled, inlined
from hw.record_fields import Record
from rtctl.control.environments.laws import (
    DAMPED,
    SNAPPING,
    environment_energy,
    free_center,
    potential,
    same_own,
    stretch,
    take_own,
)

_ADMITTANCE = 1
"""`vocabulary.Display.ADMITTANCE`."""

MOTION_SHARE = 0.6
RAISE_SHARE = 0.2
"""Shares of the gate's rate: of motion, and of each of stiffness and centre where a step raises |torque|. In
one tick a joint may move and both be stepped: .6 + .2 + .2 is all of the rate. A step of the damping, which
takes energy only, comes on top."""

LOWER_SHARE = 0.5
"""Share of the gate's rate of a step that lowers |torque|: the joint does not push then."""

HALVINGS = 8
"""Most times a step that costs too much is halved; then it is not taken in this tick. A 128th is the least
that is tried."""


@compiled
def felt_through(s: Record, p: Record, axis: int) -> float:
    """Stiffness through which the joint feels the world, N m/rad: the coupling's, or m/T^2 of a virtual mass;
    0: nothing is felt."""
    if s.display_kind[axis] == _ADMITTANCE:
        return s.mass_kgm2[axis] / (p.period_s * p.period_s)
    return p.coupling_stiffness_nm_rad[axis]


@compiled
def gate_room(s: Record, p: Record, axis: int, k: float) -> float:
    """Most energy, stored and of motion, that the gate can follow with an environment of stiffness `k`, J."""
    k_c = felt_through(s, p, axis)
    # the torque lags by what the joint feels, not by what was sent
    series = k_c * k / (k_c + k)  # a wall of 1e6 lags no more than the coupling does
    if series <= 0.0:
        return math.inf
    speed = min(MOTION_SHARE * p.torque_rate_nm[axis] / (series * p.period_s), p.velocity_limit_rad_s[axis])
    motion = 0.5 * p.inertia_kgm2[axis] * speed * speed
    return min(motion, 0.5 * p.torque_limit_nm[axis] ** 2 / series)  # beyond, the torque limit hides it


@compiled
def towards(value: float, wanted: float, step: float) -> float:
    """`wanted`, or as near to it as a step of this size brings."""
    return value + min(max(wanted - value, -step), step)


@compiled
def _take_shape(s: Record, c: Record, axis: int) -> None:
    """Take what has no way in between."""
    s.world_kind[axis] = c.environment_kind[axis]
    take_own(s, c, axis)


@compiled
def _take_all(s: Record, c: Record, axis: int) -> None:
    """Take everything as commanded, at once."""
    _take_shape(s, c, axis)
    s.world_stiffness_nm_rad[axis] = max(c.environment_stiffness_nm_rad[axis], 0.0)
    s.world_damping_nms_rad[axis] = max(c.environment_damping_nms_rad[axis], 0.0)
    s.world_center_rad[axis] = c.environment_center_rad[axis]


@compiled
def _same_shape(s: Record, c: Record, axis: int) -> bool:
    """True when what is in force differs from the command in numbers that have a way in between only."""
    return s.world_kind[axis] == c.environment_kind[axis] and same_own(s, c, axis)


@compiled
def _carried(s: Record, axis: int, k_c: float, k: float, center: float) -> float:
    """Where the proxy settles when stiffness and centre become these, to first order, rad: no step rings."""
    proxy = s.proxy_position_rad[axis]
    now, then = s.world_stiffness_nm_rad[axis], k
    way = stretch(s, axis, s.world_center_rad[axis])
    if way == 0.0:
        return proxy
    share = then / (then + k_c)
    moved = share * (center - s.world_center_rad[axis])
    if s.world_kind[axis] not in SNAPPING:  # of detents only a bound of the stretch is known
        moved -= (share - now / (now + k_c)) * way
    return proxy + moved


@compiled
def _take_step(s: Record, p: Record, axis: int, k: float, center: float) -> bool:
    """Set stiffness and centre, and the proxy that they carry, if store and gate allow; True when done."""
    k_c, x = felt_through(s, p, axis), s.position_rad[axis]
    before = s.proxy_position_rad[axis]
    proxy = before  # a mass is not carried along
    if s.display_kind[axis] != _ADMITTANCE:
        proxy = _carried(s, axis, k_c, k, center)
    stored = potential(s, axis, k, center, proxy) + 0.5 * k_c * (x - proxy) ** 2
    work = stored - environment_energy(s, axis, before) - 0.5 * k_c * (x - before) ** 2
    # what stiffens for nothing lags behind a fast joint as well
    if work > 0.0 or k > s.world_stiffness_nm_rad[axis]:
        motion = 0.5 * p.inertia_kgm2[axis] * s.velocity_rad_s[axis] ** 2
        if not (work <= s.renderer_store_j[axis] and stored + motion <= gate_room(s, p, axis, k)):
            return False
    s.world_stiffness_nm_rad[axis], s.world_center_rad[axis] = k, center
    s.proxy_position_rad[axis] = proxy
    pay(s, axis, work)
    return True


@compiled
def pay(s: Record, axis: int, work: float) -> None:
    """Take the renderer's work from its store as far as that goes, and grant it to the port."""
    paid = min(max(work, 0.0), s.renderer_store_j[axis])
    s.renderer_store_j[axis] -= paid
    s.renderer_grant_j[axis] += paid


@compiled
def _step_stiffness(s: Record, p: Record, axis: int, wanted: float) -> None:
    """One paid step of the stiffness, equal in the share y = k/(k + k_c) of the coupling that is felt."""
    k, k_c = s.world_stiffness_nm_rad[axis], felt_through(s, p, axis)
    if k == wanted:
        return
    way = abs(stretch(s, axis, s.world_center_rad[axis]))
    rate = (RAISE_SHARE if wanted > k else LOWER_SHARE) * p.torque_rate_nm[axis]
    # even steps of the torque felt: k_c share way
    share, share_wanted = k / (k + k_c), wanted / (wanted + k_c)
    step = abs(share_wanted - share)
    if way > 0.0:
        step = min(step, rate / (k_c * way))
    for _ in range(HALVINGS):
        new = towards(share, share_wanted, step)
        # a share that is undone would miss by rounding
        k_new = wanted if new == share_wanted else k_c * new / (1.0 - new)
        if _take_step(s, p, axis, k_new, s.world_center_rad[axis]):
            return
        step *= 0.5


@compiled
def _step_center(s: Record, p: Record, axis: int, wanted: float) -> None:
    """One paid step of the centre: at once where nothing is felt of it, never faster than the joint may
    move."""
    k, k_c = s.world_stiffness_nm_rad[axis], felt_through(s, p, axis)
    s.world_center_rad[axis] = wanted if k == 0.0 else free_center(s, axis, wanted)
    center = s.world_center_rad[axis]
    if center == wanted:
        return
    # a bound has no direction
    lowers = s.world_kind[axis] not in SNAPPING and (wanted - center) * stretch(s, axis, center) > 0.0
    rate = (LOWER_SHARE if lowers else RAISE_SHARE) * p.torque_rate_nm[axis]
    step = min(p.velocity_limit_rad_s[axis] * p.period_s, rate * (k + k_c) / (k_c * k))
    step = min(step, abs(wanted - center))
    for _ in range(HALVINGS):
        if _take_step(s, p, axis, k, towards(center, wanted, step)):
            return
        step *= 0.5


@compiled
def _step_damping(s: Record, p: Record, axis: int, wanted: float, speed: float) -> None:
    """One step of the damping, which takes energy only; at once where nothing is felt of it."""
    felt = s.world_kind[axis] in DAMPED and speed > 0.0
    step = RAISE_SHARE * p.torque_rate_nm[axis] / speed if felt else math.inf
    s.world_damping_nms_rad[axis] = towards(s.world_damping_nms_rad[axis], wanted, step)


@inlined
def follow_world(s: Record, p: Record, c: Record, axis: int, speed: float, disabled: bool) -> None:
    """Bring the environment in force one tick nearer to the one commanded; writes the grant of this tick.

    Parameters
    ----------
    speed : float
        |plain backward difference| of the position, rad/s.
    disabled : bool
        True while no torque leaves: everything is then taken at once, and the store is full. So it is without
        a coupling, where nothing is felt.

    Notes
    -----
    The command is finite (`laws.finite_command`); `law.step` stops on one that is not."""
    s.renderer_grant_j[axis] = 0.0  # of this tick: `passivity.granted` has had the last one's
    if disabled or felt_through(s, p, axis) <= 0.0:
        _take_all(s, c, axis)
        s.renderer_store_j[axis] = p.renderer_store_j
        return
    refilled = s.renderer_store_j[axis] + p.renderer_power_w * p.period_s
    s.renderer_store_j[axis] = min(refilled, p.renderer_store_j)
    if not _same_shape(s, c, axis):
        _step_damping(s, p, axis, 0.0, speed)  # to nothing first: between two kinds nothing leads
        _step_stiffness(s, p, axis, 0.0)
        if s.world_stiffness_nm_rad[axis] != 0.0 or s.world_damping_nms_rad[axis] != 0.0:
            return
        _take_shape(s, c, axis)
    _step_damping(s, p, axis, max(c.environment_damping_nms_rad[axis], 0.0), speed)
    if s.world_stiffness_nm_rad[axis] == 0.0:  # it grows where it belongs, not where the last one was
        s.world_center_rad[axis] = c.environment_center_rad[axis]
    _step_stiffness(s, p, axis, max(c.environment_stiffness_nm_rad[axis], 0.0))
    _step_center(s, p, axis, c.environment_center_rad[axis])
