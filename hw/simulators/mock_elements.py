"""Maxwell-slip friction: elements in parallel, each a spring that sticks until it slides.

| symbol | meaning | unit |
|---|---|---|
| F | torque of an element's spring at the start of a step | N m |
| k, s1 | its stiffness, and its bristle damping while it sticks | N m/rad, N m s/rad |
| L | what it holds at most: its share of the static curve g(v) | N m |
| w, h | velocity of a step, its length | rad/s, s |

The shares of all elements add up to 1: in steady sliding the joint has the static curve, whichever model it
has. What the elements hold remembers every place where the motion turned, which one bristle cannot.

References
----------
Al-Bender, Lampaert, Swevers: The generalized Maxwell-slip model, 2005. Here an element that slides takes the
torque L(v) at once (their attraction C without bound), and one whose torque is below L sticks, whatever it
did before: with a finite C an element would give energy while L rises."""

from __future__ import annotations

import numpy as np

from hw.simulators.jit import compiled


@compiled
def element_torque(
    w: float,
    torques: np.ndarray,
    up: float,
    down: float,
    size: float,
    h: float,
    end: float,
    p: np.record,
    axis: int,
) -> tuple[float, float]:
    """Torque of all elements in a step at velocity `w`, N m, and its derivative by `w`. Changes nothing.

    Parameters
    ----------
    torques : array, shape (ELEMENTS,)
        F of each.
    up, down : float
        Static curve of the two directions, N m: an element stays within [-share down, share up].
    size : float
        Share of the joint's stiffness and damping that these elements have together.
    end : float
        Weight of the torque at the end of the step against its mean over the step.

    Notes
    -----
    Under constant w an element reaches L after the share r = (L - F) / (k w h) of the step; its mean is then
    L - (L - F) r / 2, its damper gives s1 w r. The torque never falls with w: the step has one solution."""
    torque, slope = 0.0, 0.0
    for i in range(p.element_count[axis]):
        stiffness = p.bristle_stiffness_nm_rad[axis] * size * p.element_stiffness[axis, i]
        damping = p.bristle_damping_nms_rad[axis] * size * p.element_stiffness[axis, i]
        high, low = p.element_strength[axis, i] * up, -p.element_strength[axis, i] * down
        # the curve may have fallen since the last step: what an element holds no longer is let go at once
        force = min(max(torques[i], low), high)
        most = high if w >= 0.0 else low
        reach, stretch = most - force, stiffness * h * w
        if abs(stretch) <= abs(reach):
            torque += force + 0.5 * (1.0 + end) * stretch + damping * w
            slope += 0.5 * (1.0 + end) * stiffness * h + damping
        else:
            # it sticks for this share of the step, and slides for the rest of it
            share = reach / stretch
            torque += most - 0.5 * (1.0 - end) * reach * share + damping * w * share
            # the damper acts for the share r alone, and w r is the same at every w: the mean of the spring is
            # left
            slope += 0.5 * (1.0 - end) * stiffness * h * share * share
    return torque, slope


@compiled
def settle_elements(
    w: float,
    v_new: float,
    torques: np.ndarray,
    up: float,
    down: float,
    size: float,
    h: float,
    p: np.record,
    axis: int,
) -> float:
    """Let the step at velocity `w` pass in `torques`; returns the torque at its end, at velocity `v_new`, N
    m."""
    total = 0.0
    for i in range(p.element_count[axis]):
        stiffness = p.bristle_stiffness_nm_rad[axis] * size * p.element_stiffness[axis, i]
        high, low = p.element_strength[axis, i] * up, -p.element_strength[axis, i] * down
        force = min(max(min(max(torques[i], low), high) + stiffness * h * w, low), high)
        torques[i] = force
        total += force
        # at the end of its range it slides, and a damper beside a spring that slides is not stretched
        if (force < high and v_new > 0.0) or (force > low and v_new < 0.0):
            total += p.bristle_damping_nms_rad[axis] * size * p.element_stiffness[axis, i] * v_new
    return total
