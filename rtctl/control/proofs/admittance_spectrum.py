"""The characteristic function of the admittance loop at a complex frequency, for all hands and worlds of a
cell at once.

The loop of `admittance_loop` with a fresh sample every tick has a root z = e^(sT) just where
(docs/theory.md 2.13)

    F = Z_v (p0 + p1 Z_h) - (q0 + q1 Z_h) = 0
    Z_h = b_h + m_h s + k_h/s                            the hand,
    Z_v = m (1 - 1/z)/T + b_v + b_e + k_e T/(1 - 1/z)    the virtual mass,

and p, q come from drive, filters and the aliases s + 2 pi j n/T, in which the hand takes part a little: of
those a disc is kept that holds them for all hands of the cell. Apart from that disc F is affine in each of
k_h, b_h, m_h, k_e, b_e and m.

Symbols: a_n spectrum of the held, late torque (current loop included) at an alias, per sample; D = d0 + d1
Z_h the impedance that the torque meets; x0 + x1 Z_h over D the velocity that the encoder sees, -t1 Z_h over D
the hand's torque, of which the sensor shows H(s) = w_s/(s + w_s) times z^-L."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtctl.control.proofs.admittance_loop import AdmittanceLoop
from rtctl.control.proofs.discs import Disc, exponential, one_less_exponential, point
from rtctl.control.proofs.drive_in_hand import BRISTLE_DAMPING_SHARE, ElasticJoint
from rtctl.control.velocity import lowpass_alpha

_ALIASES = 6
"""On each side; what is farther is bounded, by a disc that falls with 1/n. The shipped display would not need
so many: two a side prove it in as many cells."""

_APART = 0.95
"""A sensor whose cut-off is nearer to the current loop's is taken for one of this share of it: equal ones
would be a double pole."""


@dataclass(frozen=True)
class HandCell:
    """Hands from one corner to another, as columns."""

    k_h: np.ndarray
    """Shape (cells, 2), as the others: least and largest."""
    b_h: np.ndarray
    m_h: np.ndarray


@dataclass(frozen=True)
class Coefficients:
    """Coefficients of F at one frequency a cell, and 1 - 1/z."""

    p0: Disc
    p1: Disc
    q0: Disc
    q1: Disc
    back: Disc


@dataclass(frozen=True)
class Joint:
    """Joint and bristles as impedances."""

    loop: AdmittanceLoop
    joint: ElasticJoint
    bristle_nm_rad: float

    @property
    def rigid(self) -> bool:
        """One mass."""
        return self.joint.stiffness_nm_rad == 0.0

    @property
    def masses(self) -> tuple[float, float]:
        """Inertia of motor and link, kg m^2; of a rigid joint all and nothing."""
        J, share = self.loop.inertia_kgm2, 0.0 if self.rigid else self.joint.link_share
        return (1 - share) * J, share * J

    @property
    def dampings(self) -> tuple[float, float]:
        """Damping of motor and link, N m s/rad, that of the bristles included."""
        behind = 0.0 if self.rigid else self.loop.link_viscous_nms_rad
        own = BRISTLE_DAMPING_SHARE * 2 * math.sqrt(self.bristle_nm_rad * self.loop.inertia_kgm2)
        return self.loop.viscous_nms_rad - behind + own, behind

    def at(self, s: Disc, inverse: Disc) -> tuple[Disc, Disc, Disc, Disc, Disc]:
        """d0, d1, x0, x1, t1 at s, with 1/s."""
        (J_m, J_l), (b_m, b_l) = self.masses, self.dampings
        motor = s * J_m + inverse * self.bristle_nm_rad + b_m
        one, none = point(np.ones_like(s.center)), point(np.zeros_like(s.center))
        if self.rigid:
            return motor, one, one, none, one
        spring = inverse * self.joint.stiffness_nm_rad + self.joint.damping_nms_rad
        link = s * J_l + b_l
        d0, d1 = motor * (link + spring) + spring * link, motor + spring
        if self.loop.encoder == "motor":
            return d0, d1, link + spring, one, spring
        return d0, d1, spring, none, spring

    def far(self, least: float, k: float, b: float, m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of |x/D| |s| and of |t - t(infinity)| |s| for |s| beyond `least`, t the force's part; hands
        up to k and b, of masses m, shape (cells, 2)."""
        (J_m, J_l), (b_m, b_l) = self.masses, self.dampings
        # help may leave the motor less than none
        own, hand = abs(b_m) + self.bristle_nm_rad / least, b + k / least
        light, heavy = m[:, 0], m[:, 1]
        with np.errstate(divide="ignore"):
            if self.rigid:
                left = np.maximum(J_m + light - (own + hand) / least, 0.0)
                return 1 / left, (heavy * own + J_m * hand) / ((J_m + light) * left)
            spring = self.joint.damping_nms_rad + self.joint.stiffness_nm_rad / least
            e_m, e_l, e_j = own / least, (b_l + hand) / least, spring / least
            left = (J_m - e_m) * (J_l + light - e_l - e_j) - e_j * (J_l + light + e_l)
            left = np.maximum(left, 0.0)  # 0: no bound, infinite, which proves nothing
            return (J_l + heavy + e_l + e_j) / left, (heavy + hand / least) * spring / left


def coefficients(drive: Joint, s: Disc, hands: HandCell) -> Coefficients:
    """Coefficients of F at one disc of frequencies a cell, each for all hands of its cell."""
    loop, T = drive.loop, drive.loop.period_s
    late = s * -T
    last, back = exponential(late), one_less_exponential(late)
    main = _held(loop, s, back)
    inverse = s.inverse()
    d0, d1, x0, x1, t1 = drive.at(s, inverse)
    shown = main * _sensor(loop, s)
    R_x, R_t = _aliases(drive, s, back, hands, _whole_sum(loop, last) - shown)
    sensor = _lowpass(loop.intake_lowpass_hz, T, last)
    for _ in range(loop.sensor_ticks):
        sensor = sensor * last
    C_x = (_lowpass(loop.velocity_lowpass_hz, T, last) * back) * (-loop.velocity_gain_nms_rad / T)
    C_x = C_x - loop.position_gain_nm_rad
    from_x = main * C_x * inverse
    felt = _lowpass(loop.force_lowpass_hz, T, last) * sensor
    ahead = _lowpass(loop.feedforward_lowpass_hz, T, last) * loop.feedforward
    moves = back * (loop.inertia_kgm2 / T) + loop.told_viscous_nms_rad
    reach = back.inverse() * (loop.position_gain_nm_rad * T) + loop.velocity_gain_nms_rad + ahead * moves
    C_f = ahead * felt * -1.0  # what the law sends of the force itself
    E = point(np.ones_like(s.center)) - C_x * R_x - C_f * R_t
    reach = reach * felt
    return Coefficients(
        p0=E * d0 - from_x * x0,
        p1=E * d1 - from_x * x1 + shown * C_f * t1,
        q0=reach * R_t * d0,
        q1=reach * (R_t * d1 - shown * t1),
        back=back,
    )


def _held(loop: AdmittanceLoop, s: Disc, back: Disc) -> Disc:
    """a_n at the alias s: (1 - 1/z) e^(-s d T) A(s)/(s T)."""
    T = loop.period_s
    out = back * exponential(s * (-loop.delay * T)) * (s * T).inverse()
    if loop.lag_hz > 0:
        out = out * (s * (1 / (2 * math.pi * loop.lag_hz)) + 1.0).inverse()
    return out


def _sensor(loop: AdmittanceLoop, s: Disc) -> Disc:
    """H at s."""
    if loop.sensor_hz == 0:
        return point(np.ones_like(s.center))
    return (s * (1 / (2 * math.pi * _sensor_hz(loop))) + 1.0).inverse()


def _sensor_hz(loop: AdmittanceLoop) -> float:
    near = _APART * loop.lag_hz < loop.sensor_hz < loop.lag_hz / _APART
    return _APART * loop.lag_hz if near else loop.sensor_hz


def _whole_sum(loop: AdmittanceLoop, last: Disc) -> Disc:
    """Sum of all a_n H(s_n): the torque at the moment of a sample, as the sensor's low-pass would show it, by
    the commands before.

    Behind both current loop and sensor, of cut-offs l and s: 1/((1 + jf/l)(1 + jf/s)) = (s/(1 + jf/l) -
    l/(1 + jf/s))/(s - l)."""
    lag_hz, sensor_hz = loop.lag_hz, _sensor_hz(loop)
    if lag_hz == 0 or sensor_hz == 0:
        return _held_sum(loop, lag_hz or sensor_hz, last)
    by_lag, by_sensor = _held_sum(loop, lag_hz, last), _held_sum(loop, sensor_hz, last)
    return by_lag * (sensor_hz / (sensor_hz - lag_hz)) - by_sensor * (lag_hz / (sensor_hz - lag_hz))


def _held_sum(loop: AdmittanceLoop, hz: float, last: Disc) -> Disc:
    """The held, late commands behind one low-pass (0: none), at the moment of a sample."""
    whole = math.floor(loop.delay + 1e-9)
    rest = max(loop.delay - whole, 0.0)
    kept = math.exp(-2 * math.pi * hz * loop.period_s) if hz > 0 else 0.0
    newer = kept ** (1 - rest)
    out = last * (newer - kept) + (1 - newer)
    for _ in range(whole + 1):
        out = out * last
    return out * (last * -kept + 1.0).inverse()


def _aliases(drive: Joint, s: Disc, back: Disc, hands: HandCell, rest: Disc) -> tuple[Disc, Disc]:
    """What position and force of all aliases but the first add, for all hands of a cell; `rest`: sum of their
    a_n H(s_n)."""
    loop, T = drive.loop, drive.loop.period_s
    (k, w_k), (b, w_b), (m, w_m) = (_middle(one) for one in (hands.k_h, hands.b_h, hands.m_h))
    mass, J = Disc(m + 0j, w_m), loop.inertia_kgm2
    # the force of a rigid joint's hand has a part that no alias weakens: it is summed apart
    share = mass * (mass + J).inverse() if drive.rigid else point(np.zeros_like(s.center))
    R_x, R_t = point(np.zeros_like(s.center)), -(share * rest)
    (_, _), (own, _) = drive.masses, drive.dampings
    for n in (*range(-_ALIASES, 0), *range(1, _ALIASES + 1)):
        alias = s + 2j * math.pi * n / T
        inverse = alias.inverse()
        soft = inverse * Disc(k + 0j, w_k) + Disc(b + 0j, w_b)
        hand = soft + alias * mass
        d0, d1, x0, x1, t1 = drive.at(alias, inverse)
        D = (d0 + d1 * hand).inverse()
        a = _held(loop, alias, back)
        shown = a * _sensor(loop, alias)
        if drive.rigid:
            R_x = R_x + a * inverse * D
            held = inverse * drive.bristle_nm_rad + own
            R_t = R_t + shown * (mass * held - soft * J) * (mass + J).inverse() * D
            continue
        top = d1.inverse()
        R_x = R_x + a * inverse * (x1 * top + (x0 - x1 * d0 * top) * D)
        R_t = R_t + shown * (t1 * d0 * top * D - t1 * top)
    least = (2 * _ALIASES + 1) * math.pi / T - float(np.max(s.radius, initial=0.0))
    # of |a_n| <= |1 - 1/z| |e^(-s d T)|/(|s_n| T), and the sum of 1/|s_n|^2 beyond: 2 (T/2 pi)^2/(n - 1/4)
    rate = 2 * (T / (2 * math.pi)) ** 2 / (_ALIASES - 0.25)
    grow = np.exp((np.abs(s.center.real) + s.radius) * loop.delay * T)
    x_far, t_far = drive.far(least, float(np.max(hands.k_h)), float(np.max(hands.b_h)), hands.m_h)
    tail = back.most * grow / T * rate
    return Disc(R_x.center, R_x.radius + tail * x_far / least), Disc(R_t.center, R_t.radius + tail * t_far)


def _middle(pair: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return 0.5 * (pair[:, 0] + pair[:, 1]), 0.5 * (pair[:, 1] - pair[:, 0])


def _lowpass(hz: float, T: float, last: Disc) -> Disc:
    """Transfer function of `velocity.lowpass_alpha`."""
    alpha = lowpass_alpha(hz, T)
    return (last * (alpha - 1) + 1.0).inverse() * alpha
