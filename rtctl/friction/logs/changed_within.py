"""A log that is of two parts: from some time on the torque has another zero or scale, the position another
scale, or another joint moves. Of several logs: one moves another load."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from rtctl.friction.logs.balance import Balance, Fit

# 33 fits, to a ninety-second of the log, in place of one fit for each row
TRIED, FINER = 24, 9
"""Times that are tried, and those between the best and its neighbours."""

PART_LEAST = 150
"""Fewest rows of a part."""

SAME = 0.1
"""Share by which Coulomb friction may differ to be the same."""

LOADED = 1.2
"""Factor between the inertias of several logs that is told."""

FACTOR_MOST = 5.0
"""Largest change of the inertia that is told: more is that of a part whose strokes, each at one speed, hardly
tell it."""

STILL = 0.75
"""What parts must leave over beside a friction that bends over speed, of what that leaves alone."""

ALIKE = 1.15
"""What a zero or a scale alone may leave over, of what parameters of their own leave, to be told for it."""


def changed_within(balance: Balance, plain: Fit) -> tuple[str, Fit] | None:
    """The time from which on a log has other parameters, that leaves least over; the parameters told are
    those before it."""
    # several logs may differ as a whole; a change within one of them is told when it is looked at alone
    n = len(balance.time_s)
    if len(balance.signals.sources) > 1:
        return _changed_between(balance, plain)
    if n < 3 * PART_LEAST:
        return None
    rows = np.linspace(PART_LEAST, n - PART_LEAST, TRIED).astype(int)
    best = int(np.argmin([_parted(balance, row).rest for row in rows]))
    # the rest over the time of a change has one valley as wide as the parts: a grid finds it
    near = np.linspace(rows[max(0, best - 1)], rows[min(TRIED - 1, best + 1)], FINER).astype(int)
    row = min(near, key=lambda each: _parted(balance, each).rest)
    what, fit = _what(balance, row)
    before = np.array([fit.inertia, fit.viscous, fit.coulomb])
    after = replace(fit, **dict(zip(("inertia", "viscous", "coulomb"), before + _more(fit), strict=True)))
    if not (fit.is_joint(balance.speed) and after.is_joint(balance.speed)) or _is_bent(balance, row):
        return None
    if not 1 / FACTOR_MOST < after.inertia / fit.inertia < FACTOR_MOST:
        return None
    return (
        f"{what} changes within the log, at about {balance.time_s[row]:.3g} s: with that, "
        f"{100 * fit.rest / balance.spread:.2g} % of the torque is left over instead of "
        f"{100 * plain.rest / balance.spread:.2g} %; cut the log there",
        fit,
    )


def _changed_between(balance: Balance, plain: Fit) -> tuple[str, Fit] | None:
    """Logs of which something else was moved in each; the parameters told are those of the first."""
    sources = balance.signals.sources
    own = np.hstack([balance.motion * (balance.log == k)[:, None] for k in range(1, len(sources))])
    fit, bends = balance.fit(added=own), balance.bends()
    first = np.array([fit.inertia, fit.viscous, fit.coulomb])
    each = np.vstack([first, first + fit.added.reshape(-1, 3)])
    joints = [replace(fit, inertia=j, viscous=b, coulomb=c) for j, b, c in each.tolist()]
    if not all(one.is_joint(balance.speed) for one in joints):
        return None
    # friction may differ from session to session of one joint; of what is moved only the inertia says that it
    # is another
    inertias = each[:, 0]
    if inertias.max() < LOADED * inertias.min() or not inertias.max() < FACTOR_MOST * inertias.min():
        return None
    bent = balance.fit(added=bends).rest
    if balance.fit(added=np.hstack([bends, own])).rest > STILL * bent:
        return None
    told = ", ".join(
        f"{inertia:.3g} kg m^2 in {Path(one).name}" for inertia, one in zip(inertias, sources, strict=True)
    )
    return (
        f"the inertia differs between the logs, {told} (another load, a part taken off, another joint, "
        f"a scale): with one of each {100 * fit.rest / balance.spread:.2g} % of the torque is left over "
        f"instead of {100 * plain.rest / balance.spread:.2g} %; give only logs of the same load at a time",
        fit,
    )


def _more(fit: Fit) -> np.ndarray:
    """By how much inertia, viscous and Coulomb friction are larger after it, where they were fitted."""
    # for a zero or a scale one or two columns were added, and the joint stayed
    return fit.added[:3] if len(fit.added) > 3 else np.zeros(3)


def _since(balance: Balance, row: int) -> np.ndarray:
    """1 from a row on, (n, 1)."""
    return (np.arange(len(balance.time_s)) >= row)[:, None].astype(float)


def _parted(balance: Balance, row: int) -> Fit:
    """The balance with parameters of their own from a row on."""
    return balance.fit(added=_own(balance, row))


def _own(balance: Balance, row: int) -> np.ndarray:
    """Columns of what parameters and a zero of their own add from a row on, (n, 1 + those of the motion)."""
    columns: np.ndarray = np.column_stack([balance.motion, np.ones(len(balance.time_s))])
    return np.asarray(_since(balance, row) * columns)


def _is_bent(balance: Balance, row: int) -> bool:
    """Whether friction that is not Coulomb + viscous explains most of it: parts of other speeds then look
    like other parameters."""
    bent = balance.bends()
    return (
        balance.fit(added=np.hstack([bent, _own(balance, row)])).rest > STILL * balance.fit(added=bent).rest
    )


def _what(balance: Balance, row: int) -> tuple[str, Fit]:
    """What changes there: the least that leaves hardly more over than parameters of their own, and that
    fit."""
    since, whole = _since(balance, row), _parted(balance, row)
    zero = balance.fit(added=since)
    # the least that explains it first: a button that was pressed is likelier than another joint
    if zero.rest < ALIKE * whole.rest:
        return f"the zero of the torque, by {zero.added[0]:.3g} N m,", zero
    before = np.array([whole.inertia, whole.viscous, whole.coulomb])
    wanted = (balance.motion @ before)[:, None]
    # what the balance wants, and not the record: the noise of that would explain itself
    torque = balance.fit(added=since * np.column_stack([wanted, np.ones(len(wanted))]))
    if torque.rest < ALIKE * whole.rest:
        return (
            f"the scale of the torque, by the factor {1 + torque.added[0]:.3g} (a range, a gain, a torque "
            "constant),",
            torque,
        )
    inertia, viscous, coulomb = 1 + whole.added[:3] / before
    if abs(inertia - 1) < SAME and abs(coulomb - 1) < SAME:
        return f"viscous friction, by the factor {viscous:.3g}, (a lubricant that warms up or cools),", whole
    if abs(coulomb - 1) < SAME:
        return (
            f"the inertia, by the factor {inertia:.3g}, and viscous friction, by {viscous:.3g}, but not "
            "Coulomb friction, (a load, a scale of the position, rows of another rate,)",
            whole,
        )
    return (
        f"what is moved, or how it rubs, (inertia by the factor {inertia:.3g}, Coulomb friction by "
        f"{coulomb:.3g}: two logs in one, a load, a part that was touched)",
        whole,
    )
