"""What an estimate of the friction's factor is worth saying: a warning, a STOP, or nothing."""

from __future__ import annotations

import math

from rtctl.friction.drift_deployed import Deployed
from rtctl.friction.drift_estimate import Estimate

NAME = "FRICTION_DRIFT"
STOPPED = "OVERCOMPENSATION"

TOLD_SHARE = 0.7
"""A change of `warn_share` is told for sure where the estimate errs by three in ten of it, hence from this
share of it on: two of them are the method's, the third is that part of the model's dry friction which is
viscous in truth and did not change."""

SURE_SHARE = 0.5
"""Least of the allowed change that lies beyond the interval's far side: else it might be none."""

GONE_SHARE = 0.6
"""A warning goes at this share of the allowed change."""

# ten hours without a false warning were asked for, and a tenth told within a minute (decision 0028)
SURE = 3.0
"""Standard errors of a factor that is acted upon."""

SESSION_S = 10.0
"""Sliding motion since the motor was switched on without which nothing is stopped."""


def allowed(found: Estimate, by: Deployed, warn_share: float) -> float:
    """Change of the factor that is no news: what is not warned of, and what the model says itself of
    sliding."""
    return max(TOLD_SHARE * warn_share, by.doubt_of_sliding_nm(found.place_trust) / found.dry_nm)


def of_a_place(found: Estimate, by: Deployed, warn_share: float) -> bool:
    """Whether a change that is warned of may be what places differ by."""
    return allowed(found, by, warn_share) > TOLD_SHARE * warn_share


def warning(
    found: Estimate, by: Deployed, warn_share: float, *, warned: bool, before: Estimate | None = None
) -> str:
    """What has changed, in words; empty where nothing has, for sure. `warned`: it was said before. `before`:
    what was found at this place.

    Both directions together decide: one of them alone is not told from an offset by motion."""
    most = allowed(found, by, warn_share)
    if _changed(found.factor, found.factor_error, most, warned=warned):
        return _said(found, 1.0, 0.0, "what was learned")
    if before is None or not of_a_place(found, by, warn_share):
        return ""
    # errors as of 1: factors are near it, and a ratio of two has both
    ratio, error = found.factor / before.factor, math.hypot(found.factor_error, before.factor_error)
    if _changed(ratio, error, TOLD_SHARE * warn_share, warned=warned):
        return _said(found, before.factor, before.factor_error, "what it was at this place before")
    return ""


def _changed(factor: float, error: float, most: float, *, warned: bool) -> bool:
    # either way: less friction may be helped too much, more is help that is missed
    change = abs(factor - 1.0)
    # a lower bound on the way back: a factor at the bound would come and go with each stroke
    if warned and change > GONE_SHARE * most:
        return True
    return change > most and change - SURE * error > SURE_SHARE * most


def _said(found: Estimate, of: float, of_error: float, what: str) -> str:
    factor, error = found.factor / of, math.hypot(found.factor_error, of_error)
    return (
        f"dry friction is {factor:.2f} ({factor - 2.0 * error:.2f} to {factor + 2.0 * error:.2f}) times "
        f"{what}, by {found.seconds:.0f} s of motion: learn it anew (rtctl identify)"
    )


def overcompensated(found: Estimate, by: Deployed, share: float) -> str:
    """Why the rig must not go on; empty where it may. `share` of the configured feed-forward is in force,
    0 to 1.

    The whole interval of the factor, three standard errors, must lie below what the proofs suppose and below
    what the feed-forward takes: then it gives more than the friction takes out, where it runs on."""
    # earlier sessions cannot stop a rig that was just armed: its sensors were zeroed since
    if not share > 0.0 or found.session_seconds < SESSION_S:
        return ""
    # both must be undercut: what proofs suppose, and what the help in force gives in fact
    bound = min(1.0 - by.doubt_nm / found.dry_nm, by.least_factor(share))
    high = found.factor + SURE * found.factor_error
    if not high < bound:
        return ""
    return (
        f"dry friction is at most {high:.2f} times what was learned; below {bound:.2f} the compensation "
        "gives more than friction takes: stopped; learn it anew (rtctl identify), or lower friction.gain"
    )
