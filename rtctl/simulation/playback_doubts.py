"""Logs whose regression, as `rtctl playback` makes it, is not to be trusted: beside `rtctl identify --log`,
and beside each other.

The regression of the report counts turns, too, at which the low-pass blurs the jump of friction: in brisk
motion inertia and dry friction are told too small."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.friction.logs.dynamics import Dynamics
from rtctl.friction.logs.intervals import Estimate
from rtctl.friction.logs.regression import JointFit

BLURRED = 0.1
"""Share by which dry friction or inertia of a log may be another one than `rtctl identify --log` says before
that is told."""

ANOTHER = 3.0
"""Factor by which the inertia of two logs of one joint hardly differs, blurred as it is."""

Log = tuple[str, Dynamics]
"""File of a log, and its regression."""


def against_identify(fit: JointFit, logs: Sequence[Log], *, inertia_given: bool) -> tuple[str, ...]:
    """Logs whose dry friction, or inertia where nobody gave it, is none that `rtctl identify --log` says
    (`fit`)."""
    dry, inertia = (fit.symmetric.parameters[name] for name in ("coulomb_nm", "inertia_kgm2"))
    told = [
        f"{file}: the dry friction learned here, {1e3 * found.coulomb_nm:.4g} mN m, is not that of rtctl "
        f"identify --log ({1e3 * dry.low:.4g} to {1e3 * dry.high:.4g}): turns are counted here, and blurred; "
        "learn from its points (rtctl identify --log --out DIR, rtctl fit), and give that model by a rig file"
        for file, found in logs
        if _is_blurred(dry, found.coulomb_nm)
    ]
    if inertia_given:
        return tuple(told)
    return tuple(told) + tuple(
        f"{file}: the inertia taken here, {found.inertia_kgm2:.4g} kg m^2, is not that of rtctl identify "
        f"--log ({inertia.low:.4g} to {inertia.high:.4g}): turns are counted here, and blurred; inertia "
        f"and friction of the hand are then parted wrongly: give it (--inertia-kgm2 {inertia.value:.4g})"
        for file, found in logs
        if _is_blurred(inertia, found.inertia_kgm2)
    )


def _is_blurred(known: Estimate, here: float) -> bool:
    # both: an interval may be so narrow that nobody minds being beside it
    return not known.holds(here) and abs(here - known.value) > BLURRED * abs(known.value)


def another_inertia(judged: Log, logs: Sequence[Log]) -> tuple[str, ...]:
    """What is said of a log with another inertia than those that friction was learned from: units, above
    all."""
    file, found = judged
    # the median: one log in another unit among them does not shift what the others are
    times = found.inertia_kgm2 / float(np.median([one.inertia_kgm2 for _, one in logs]))
    if 1 / ANOTHER < times < ANOTHER:
        return ()
    return (
        f"{file}: its inertia by regression is {times:.3g} times that of the logs that friction was learned "
        "from: another unit of the torque or the position, another joint, or motion that does not tell it; "
        "the first two are not helped by this friction",
    )
