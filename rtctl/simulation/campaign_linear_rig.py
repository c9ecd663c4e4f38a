"""A linear rig in a linear hand, and whether it shakes: by the eigenvalues of what a frame of ticks does to
it.

A rig is a motor, rigid or behind an elastic joint, in a hand of masses on springs without any loss, under a
coupling to a wall, a spring, or the worst lossless world, behind a delay of any fraction, a first-order lag,
and samples that are fresh n-th tick, or in any pattern that repeats. All of it is linear and periodic, so the
eigenvalues of one frame of ticks tell exactly whether it shakes: none may lie outside the unit circle.

Written from first principles: nothing of `rtctl.control` is used here."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

GROWTH = 1e-7
"""An eigenvalue this far outside the unit circle counts: lossless parts lie on it."""


@dataclass(frozen=True)
class Law:
    """Coupling and world: a spring (infinite: a wall) as the law has it, or a lossless one by Tustin's rule,
    which wants a fresh sample in every tick."""

    k_c: float
    b_c: float
    spring: float = math.inf
    tustin_spring: float = 0.0
    tustin_mass: float = 0.0


@dataclass(frozen=True)
class Plant:
    """Motor and all that hangs on it: `q' = a q + b torque`, angle of the encoder = c q."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray


@dataclass(frozen=True)
class Case:
    """A whole rig: T in s, lag as a time constant in ticks, and what each tick of a frame is like."""

    T: float
    tau: float
    pattern: tuple[tuple[int, float], ...]
    """Per tick: ticks since the sample before, 0 where the last sample is held; delay of the tick's torque,
    ticks. All delays of a frame lie between the same two whole ticks."""
    plant: Plant
    law: Law


def regular(n: int, delay: float) -> tuple[tuple[int, float], ...]:
    """Pattern of a fresh sample every n ticks, behind a constant delay."""
    return ((n, delay), *((0, delay),) * (n - 1))


def network(J: float, b: float, w2: np.ndarray, p2: np.ndarray) -> Plant:
    """A mass J with damping b in a hand without loss, so that both resonate at w2 and the hand alone at p2
    between.

    In root energy coordinates: stretch of the spring to ground, speed of the mass, then stretch and speed of
    every further mass on its spring."""
    modes = len(w2)
    # Foster's form: poles and zeros in turn along the axis are a network of masses on springs
    ground = J * w2[0] * math.prod(w2[1:] / p2)
    a, rate = np.zeros((2 * modes, 2 * modes)), math.sqrt(ground / J)
    a[0, 1], a[1, 0], a[1, 1] = rate, -rate, -b / J
    for i, one in enumerate(p2):
        others = np.arange(len(p2)) != i
        ratio = float(np.prod((w2[1:][others] - one) / (p2[others] - one)))
        spring = J * (w2[0] - one) / -one * (w2[i + 1] - one) * ratio
        # max: rounding of a spring that is none
        stretch, own, to_mass = 2 + 2 * i, math.sqrt(one), math.sqrt(max(spring, 0.0) / J)
        a[stretch, stretch + 1], a[stretch + 1, stretch] = own, -own
        a[stretch, 1], a[1, stretch] = -to_mass, to_mass
    push, angle = np.zeros(2 * modes), np.zeros(2 * modes)
    push[1], angle[0] = 1 / math.sqrt(J), 1 / math.sqrt(ground)
    return Plant(a, push, angle)


def behind_a_joint(link: Plant, J: float, b: float, k: float, damping: float) -> Plant:
    """A motor (J, b) that turns `link` through a joint of stiffness k and a damping of its own; encoder at
    the motor."""
    m = len(link.b)
    a = np.zeros((m + 2, m + 2))
    a[:m, :m] = link.a
    speed = link.b  # of the link: push and speed are the same row in root energy coordinates
    root_j, root_k = math.sqrt(J), math.sqrt(k)
    a[m, m], a[m, m + 1], a[m + 1, m] = -b / J, -root_k / root_j, root_k / root_j
    a[m + 1, :m] = -root_k * speed
    a[:m, m + 1] = root_k * speed
    pull = np.zeros(m + 2)  # speed of the motor against the link's
    pull[m], pull[:m] = 1 / root_j, -speed
    a -= damping * np.outer(pull, pull)
    push, angle = np.zeros(m + 2), np.zeros(m + 2)
    push[m] = 1 / root_j
    angle[:m], angle[m + 1] = link.c, 1 / root_k
    return Plant(a, push, angle)


def frame(case: Case) -> np.ndarray:
    """What a frame does to plant, lag, line of torques, and law."""
    steps = {share: _steps(case, share) for _, delay in case.pattern for share in _shares(delay)}
    whole: np.ndarray | None = None
    for elapsed, delay in case.pattern:
        tick = _tick(case, elapsed, delay, steps)
        whole = tick if whole is None else tick @ whole
    if whole is None:
        raise ValueError("a frame has at least one tick")
    return whole


def largest_pole(case: Case) -> float:
    """Largest magnitude of an eigenvalue of a frame."""
    return float(np.abs(np.linalg.eigvals(frame(case))).max())


def grows(case: Case) -> bool:
    """Whether it shakes: an eigenvalue outside the unit circle."""
    return largest_pole(case) > 1 + GROWTH


def _shares(delay: float) -> tuple[float, float]:
    f = delay - math.floor(delay)
    return f, 1 - f


def _tick(
    case: Case, elapsed: int, delay: float, steps: dict[float, tuple[np.ndarray, np.ndarray]]
) -> np.ndarray:
    """One tick: the law on the newest sample, then the plant with the torques that are in force meanwhile."""
    k0 = math.floor(delay)
    early, late = (steps[share] for share in _shares(delay))
    m, line = len(case.plant.b) + (case.tau > 0), k0 + 1
    law = _law(case, elapsed)  # rows: torque, then new states; columns: angle of the encoder, states
    size = m + line + law.shape[0] - 1
    eye, angle = np.eye(size), np.zeros(size)
    angle[: len(case.plant.c)] = case.plant.c
    see = np.vstack([angle, eye[m + line :]])
    torques = np.vstack([law[0] @ see, eye[m : m + line]])  # of this tick, of the last one, ...
    out = np.zeros((size, size))
    middle = early[0] @ eye[:m] + np.outer(early[1], torques[k0 + 1])
    out[:m] = late[0] @ middle + np.outer(late[1], torques[k0])
    out[m : m + line] = torques[:line]  # the line of torques under way moves on
    out[m + line :] = law[1:] @ see
    return out


def _steps(case: Case, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Exact step of plant and lag over a share of a tick: state, and a torque that is held."""
    from scipy.linalg import expm

    plant, m = case.plant, len(case.plant.b)
    size = m + (case.tau > 0) + 1
    a = np.zeros((size, size))
    a[:m, :m], a[:m, m] = plant.a, plant.b
    if case.tau > 0:
        a[m, m], a[m, m + 1] = -1 / (case.tau * case.T), 1 / (case.tau * case.T)
    exact = expm(a * case.T * share)  # of state and held torque together
    return exact[:-1, :-1], exact[:-1, -1]


def _law(case: Case, elapsed: int) -> np.ndarray:
    """Torque and new states over angle and states, as the law has it: the proxy is solved for in every
    tick."""
    law, T = case.law, case.T
    if law.tustin_spring > 0 or law.tustin_mass > 0:
        return _worst_world(law, T)
    # states: held angle, proxy
    damping = law.b_c / (T * max(elapsed, 1))
    stiffness = law.k_c + damping
    x = np.array([1.0, 0, 0]) if elapsed > 0 else np.array([0, 1.0, 0])
    before, proxy_before = np.array([0, 1.0, 0]), np.array([0, 0, 1.0])
    drive = law.k_c * x + damping * (x - before + proxy_before)
    proxy = np.zeros(3) if math.isinf(law.spring) else drive / (stiffness + law.spring)
    return np.vstack([-(drive - stiffness * proxy), x, proxy])


def _worst_world(law: Law, T: float) -> np.ndarray:
    """Coupling in series with a lossless spring or mass by Tustin's rule, as a filter of the velocity; every
    tick fresh."""
    top = np.array([law.b_c + law.k_c * T, -law.b_c])
    minus, plus = np.array([1.0, -1.0]), np.array([1.0, 1.0])
    if law.tustin_mass > 0:
        over = np.polymul(top, minus)
        under = np.polyadd(np.polymul(minus, minus), law.tustin_mass * np.polymul(plus, top))
    else:
        over = np.polymul(top, plus)
        under = np.polymul(minus, plus + law.tustin_spring * top)
    over, under = over / under[0], under / under[0]
    # states: angle before, two of the filter
    velocity = np.array([1 / T, -1 / T, 0, 0])
    filtered = np.array([0, 0, over[1] - under[1] * over[0], over[2] - under[2] * over[0]])
    new = velocity + np.array([0, 0, -under[1], -under[2]])
    return np.vstack([-(over[0] * velocity + filtered), np.eye(4)[0], new, np.eye(4)[2]])
