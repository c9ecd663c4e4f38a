"""Renderers that want the hand's energy, and know everything: where the joint is and how fast it goes, in
every tick.

Each sends what a client may send, and nothing else: targets of a remote proxy, environments, the share of the
help, masses and displays.
"""

import math

from rtctl.control.jit import compiled
from rtctl.control.vocabulary import Environment

FOE = (
    ("foe", "<i8", 0), ("reach", "<f8", 0.3), ("rate", "<f8", 12.0), ("follow", "<f8", 0.0),
    ("push", "<f8", 1e3),
    ("every", "<i8", 1), ("silent", "<i8", 0), ("between", "<i8", 1000), ("moods", "<i8", 0),
    ("shows", "<i8", 0),
)  # fmt: skip
"""Scheme; how far ahead, how quick, velocity of its targets as a share of the joint's, stiffness; a change
every so many ticks, silence in so many of so many; whether it plays with the help; and with mass, damping and
display."""

NONE, SWING, LEAD, PUSH, SPRING, WALL, PUMP, JUGGLE, TURNCOAT = range(9)
LEASE = 7

_REMOTE, _FREE, _SPRING, _WALL = (
    int(Environment.REMOTE), int(Environment.FREE), int(Environment.SPRING), int(Environment.WALL),
)  # fmt: skip
_DAMPER, _DETENTS = int(Environment.DAMPER), int(Environment.DETENTS)


@compiled
def _aim(s, p, c, a, i, x, v, now_s):
    """A target ahead of the motion, or one that swings in resonance."""
    ahead = 1.0 if v >= 0.0 else -1.0
    c.environment_kind[i] = _REMOTE
    if a.foe == SWING:
        c.target_position_rad[i] = a.reach * math.sin(a.rate * now_s)
        c.target_velocity_rad_s[i] = a.follow * a.reach * a.rate * math.cos(a.rate * now_s)
    elif a.foe == LEAD:
        c.target_position_rad[i] = x + a.reach * v / p.velocity_limit_rad_s[i] * 10.0
        c.target_velocity_rad_s[i] = a.follow * v
    else:
        c.target_position_rad[i] = x + a.reach * ahead
        c.target_velocity_rad_s[i] = a.follow * ahead * p.velocity_limit_rad_s[i]


@compiled
def _world(c, a, i, kind, x, v, chance):
    """A world that pushes the way the joint goes: a spring ahead, a wall behind, detents that slope down."""
    ahead = 1.0 if v >= 0.0 else -1.0
    c.environment_kind[i], c.environment_stiffness_nm_rad[i] = kind, a.push
    c.environment_damping_nms_rad[i] = 0.0 if chance < 0.5 else 0.1
    c.environment_pitch_rad[i] = max(4.0 * a.reach, 2e-3)
    c.environment_side[i] = 1 if ahead < 0.0 else -1
    c.environment_center_rad[i] = x + a.reach * ahead


@compiled
def _pump(c, a, i, x, v):
    """Stiff on the way to the middle, gone on the way out: as a child on a swing."""
    c.environment_kind[i], c.environment_center_rad[i] = _SPRING, a.reach
    c.environment_stiffness_nm_rad[i] = a.push if (x - a.reach) * v < 0.0 else 0.0


@compiled
def _moods(c, a, i, luck):
    """Help that goes and comes, masses, dampings and displays that change."""
    if a.moods != 0 and luck[2] < 0.01:
        c.compensation[i] = 1.0 if c.compensation[i] < 0.5 else 0.0
    if a.shows != 0:
        c.mass_kgm2[i], c.mass_damping_nms_rad[i] = 1e3 * (luck[3] < 0.5), 1e3 * (luck[4] < 0.5)
        if a.shows > 1 and luck[5] < 0.005:
            c.display_kind[i] = 1 - int(c.display_kind[i])


@compiled
def scheme(t, s, p, c, axes, ys, luck):
    """What the renderers of all axes send in this tick."""
    sent = False
    for i in range(len(axes)):
        a, x, v = axes[i], ys[i, 0], ys[i, 1]
        if a.foe == NONE:
            continue
        _moods(c, a, i, luck[i])
        if t.tick % a.every != 0 or t.tick % a.between < a.silent:
            continue
        draw = luck[i, 0]
        if a.foe <= PUSH or (a.foe == TURNCOAT and draw < 0.3):
            _aim(s, p, c, a, i, x, v, t.tick * p.period_s)
            sent = True
        elif a.foe == SPRING:
            _world(c, a, i, _SPRING, x, v, 0.0)
        elif a.foe == WALL:
            _world(c, a, i, _WALL if draw < 0.7 else _FREE, x, v, 0.0)
        elif a.foe == PUMP:
            _pump(c, a, i, x, v)
        else:
            kind = int(5.0 * luck[i, 1])
            worlds = (_FREE, _SPRING, _WALL, _DAMPER, _DETENTS)
            _world(c, a, i, worlds[kind], x, v, draw)
    if sent:
        c.target_count += 1
        c.target_epoch, c.target_lease = s.epoch, LEASE
