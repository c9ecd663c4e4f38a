"""Virtual environments behind the virtual coupling, solved together for the position of the proxy.

The coupling is a spring and damper between joint x and a massless proxy p; the environment pushes on
the proxy. Symbols: k_c, b_c coupling; k, b environment; c its centre; T time since the last sample.

    f = k_c (x - p) + b_c ((x - x_before) - (p - p_before))/T = w - A p,     A = k_c + b_c/T
    f = f_env(p, p_before)                                     torque on the joint = -f

Solving both lines for p makes any environment stiffness stable: a wall of 1e6 N m/rad is felt as k_c.
Every environment satisfies f (p - p_before) >= V(p) - V(p_before) with a potential V bounded below, and
the coupling adds only stored and dissipated energy, so sum f (x - x_before) >= -const: the condition
under which the sampled-data bound (docs/theory.md 2.3 and 2.7) covers nonlinear environments."""

from __future__ import annotations

import math

from hw.jit import compiled, inlined
from hw.record_fields import Record
from rtctl.control.environments.changes import follow_world
from rtctl.control.environments.laws import environment_energy, finite_command, solve_proxy
from rtctl.control.environments.table import Environment
from rtctl.control.environments.targets import follow_target

_REMOTE = int(Environment.REMOTE)


@compiled
def _remote_force(s: Record, p: Record, axis: int, difference: float) -> float:
    """Coupling force towards the renderer's target (`targets.follow_target`)."""
    velocity = follow_target(s, p, axis, difference)
    stretch = s.position_rad[axis] - s.proxy_position_rad[axis]
    # the damper follows the target's velocity, as far as paid, not the proxy's steps
    slip = difference - velocity
    return p.coupling_stiffness_nm_rad[axis] * stretch + p.coupling_damping_nms_rad[axis] * slip


@compiled
def _store(s: Record, p: Record, axis: int) -> None:
    """Write the energy stored now, for the observer."""
    stretch = s.position_rad[axis] - s.proxy_position_rad[axis]
    own = environment_energy(s, axis, s.proxy_position_rad[axis])
    stored = own + 0.5 * p.coupling_stiffness_nm_rad[axis] * stretch * stretch
    # the fault is the torque's to raise (LAW_NOT_FINITE): NaN in here would reach the account, too
    s.stored_energy_j[axis] = stored if math.isfinite(stored) else 0.0


@inlined
def coupling_torque(
    s: Record, p: Record, c: Record, axis: int, elapsed: int, difference: float, disabled: bool
) -> float:
    """Torque of coupling and environment on the joint, N m; moves `state.proxy_position_rad`.

    The environment is the one in force, `state.world_*`, which follows the command's (`changes`).

    Parameters
    ----------
    elapsed : int
        Grid ticks since the last valid sample; 0 on a missed one, whose held position does not move.
    difference : float
        Plain backward difference of the position, rad/s: the velocity SD-1 assumes.
    disabled : bool
        True while no torque leaves: the proxy then starts each tick from the joint, so nothing winds up.

    Returns
    -------
    float
        Minus the opposing force; 0 without a coupling. NaN for a command that is not finite, of which nothing
        stays in the state; the proxy then returns to the joint."""
    x = s.position_rad[axis]
    if s.proxy_set_count[axis] == 0 or disabled:
        s.proxy_position_rad[axis] = x
        s.proxy_set_count[axis] = 1
    if not finite_command(c, axis):
        # before the state is touched: one NaN in proxy or store would outlast the fault
        s.proxy_position_rad[axis], s.stored_energy_j[axis], s.renderer_grant_j[axis] = x, 0.0, 0.0
        return math.nan
    follow_world(s, p, c, axis, abs(difference), disabled)
    dt = p.period_s * max(elapsed, 1)  # on a missed sample the proxy may still move: of one period
    b = p.coupling_damping_nms_rad[axis] / dt
    stiffness = p.coupling_stiffness_nm_rad[axis] + b
    if stiffness <= 0.0:  # no coupling: there is nothing to solve, and A would divide
        s.proxy_position_rad[axis] = x
        s.stored_energy_j[axis] = 0.0
        return 0.0
    if s.world_kind[axis] == _REMOTE:
        force = _remote_force(s, p, axis, difference)
    else:
        before = s.proxy_position_rad[axis]
        drive = p.coupling_stiffness_nm_rad[axis] * x + b * (x - s.position_before_rad[axis] + before)
        proxy = solve_proxy(s, axis, drive, stiffness, before, dt)
        force = drive - stiffness * proxy  # w - A p: equal to the environment's, without asking its kind
        s.proxy_position_rad[axis] = proxy
    if not math.isfinite(s.proxy_position_rad[axis]):
        s.proxy_position_rad[axis] = x
    _store(s, p, axis)
    return -force
