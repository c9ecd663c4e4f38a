"""Is a run of MuJoCo's to be judged? One that diverged was begun anew by the engine, which only warns."""

import numpy as np


class DivergedError(ArithmeticError):
    """What the engine warned of, at which time."""


def refuse_diverged(d, kinds):
    """Raise `DivergedError` where the engine's data `d` tell a warning, or a number that is none; `kinds`:
    names of its warnings by their number (`mujoco.mjtWarning`).

    Any warning counts: a full buffer of contacts or constraints, too, makes another joint of it. The engine
    resets what it finds diverged to where the motion began, with `d.time`, and goes on."""
    said = [kinds(i).name for i, one in enumerate(d.warning) if one.number]
    if not (np.isfinite(d.qpos).all() and np.isfinite(d.qvel).all()):
        said.append("NOT_FINITE")
    if said:
        raise DivergedError(
            f"MuJoCo's simulation is not to be trusted: {', '.join(said)}, by {d.time:.4g} s of its clock"
        )
