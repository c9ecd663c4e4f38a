"""Detents: a periodic potential behind the coupling, with a force that cannot create energy.

V(p) = -k (P/2 pi)^2 cos(2 pi (p - c)/P), slope V' = k (P/2 pi) sin(...), greatest stiffness k, pitch P.

Plain backward pairing, f = V'(p_k), creates energy on the crest between two detents, where the slope
falls: f (p_k - p_{k-1}) < V(p_k) - V(p_{k-1}). The secant force (V(p_k) - V(p_{k-1}))/(p_k - p_{k-1})
never does, but rings in a stiff valley. The larger of the two in the direction of motion does neither:

    f = max(V', secant) for a proxy moving up, min(V', secant) for one moving down      (derived here)

so f (p_k - p_{k-1}) >= V(p_k) - V(p_{k-1}) always, and a quiet proxy feels V' exactly."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rtctl.control.environments.kind import CENTER, STIFFNESS, Kind, Parameter, Slider

if TYPE_CHECKING:
    from hw.record_fields import Record

PITCH = Parameter("pitch_rad", "rad", 1e-3, 100, 0.2, (0.02, 0.3), Slider("pitch", 0.05, 0.5, 0.2))

ABOUT = Kind(
    meaning="Detents: the joint snaps from one to the next.",
    force="V' of a periodic potential, section 3.2",
    solution="Newton's method with a bracket",
    parameters={STIFFNESS: "greatest slope", CENTER: "centre of one", PITCH: "distance"},
    snaps=True,
)

NEWTON_STEPS = 20
MAX_STEPS = 64
"""Bound on the solver's work: Newton first, then bisection, which leaves 2^-44 of the bracket."""


def energy(s: Record, axis: int, k: float, center: float, proxy: float) -> float:
    """V above its valley, J: k (P/2 pi)^2 (1 - cos(2 pi (p - c)/P)), >= 0."""
    offset, pitch = proxy - center, s.world_pitch_rad[axis]
    if not (pitch > 0.0 and math.isfinite(offset)):
        return 0.0
    # 1 - cos by half the angle: no digits are lost in a valley
    half_sine = math.sin(math.pi * offset / pitch)
    return 2.0 * k * (pitch / (2.0 * math.pi) * half_sine) ** 2


def stretch(s: Record, axis: int, center: float) -> float:
    """Bound of the stretch: a proxy is never more than half a pitch from a valley."""
    behind = abs(s.position_rad[axis] - s.proxy_position_rad[axis])
    return behind + 0.5 * s.world_pitch_rad[axis]


def force(p: float, before: float, k: float, center: float, pitch: float) -> tuple[float, float]:
    """Force opposing a proxy that went from `before` to `p`, N m, and its slope in p, N m/rad.

    Notes
    -----
    secant = k (P/2 pi) sin(m) sin(h)/h with m the mean phase and h half the phase step: no cancellation."""
    scale = 2.0 * math.pi / pitch
    peak = k / scale
    phase = scale * (p - center)
    half = 0.5 * scale * (p - before)
    mean = phase - half
    if abs(half) < 1e-4:  # sin(h)/h by its series: exact to 1e-17 there
        sinc, sinc_slope = 1.0 - half * half / 6.0, -half / 3.0
    else:
        sinc = math.sin(half) / half
        sinc_slope = (math.cos(half) - sinc) / half
    slope_force = peak * math.sin(phase)
    secant = peak * math.sin(mean) * sinc
    if (slope_force - secant) * half >= 0.0:  # the larger of both in the direction of the motion
        return slope_force, k * math.cos(phase)
    return secant, 0.5 * k * (math.cos(mean) * sinc + math.sin(mean) * sinc_slope)


def proxy(s: Record, axis: int, drive: float, stiffness: float, before: float, dt: float) -> float:
    """Where detents and coupling are in balance."""
    k, center, pitch = s.world_stiffness_nm_rad[axis], s.world_center_rad[axis], s.world_pitch_rad[axis]
    return solve(drive, stiffness, k, center, pitch, before)


def solve(drive: float, stiffness: float, k: float, center: float, pitch: float, before: float) -> float:
    """Proxy position where the coupling force `drive - stiffness p` meets the detent force, rad.

    Safeguarded Newton from the last position: the bracket runs from there in the direction the coupling
    pulls, as far as the greatest detent force allows, so an answer always exists and the nearest one in
    that direction is preferred (a step is at most an eighth of the pitch)."""
    if not (pitch > 0.0 and k > 0.0 and math.isfinite(drive + center + before)):
        return drive / stiffness
    push, slope = force(before, before, k, center, pitch)
    residual = stiffness * before - drive + push
    if residual == 0.0:
        return before
    direction = -1.0 if residual > 0.0 else 1.0
    near = before
    # where even the greatest force balances
    far = (drive + direction * k * pitch / (2.0 * math.pi)) / stiffness
    p = before
    for i in range(MAX_STEPS):
        slope += stiffness
        step = -residual / slope if slope > 0.0 else direction * pitch  # on a crest Newton's step points back
        # an eighth is half the way from a valley to where its force begins to fall
        step = min(max(step, -0.125 * pitch), 0.125 * pitch)  # or it would jump over the nearest answer
        trial = p + step
        if i >= NEWTON_STEPS or (trial - near) * direction <= 0.0 or (far - trial) * direction <= 0.0:
            trial = 0.5 * (near + far)
        if trial == p:  # the bracket is as narrow as numbers are
            break
        p = trial
        push, slope = force(p, before, k, center, pitch)
        residual = stiffness * p - drive + push
        if residual * direction < 0.0:
            near = p
        else:
            far = p
        if residual == 0.0:
            break
    return p
