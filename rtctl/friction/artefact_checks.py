"""What a friction model must be to be believed, beyond the form of its file: every number agrees with the
curve it is of."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

import numpy as np

from hw.outside import shown
from rtctl.errors import ModelError
from rtctl.friction import mean_document
from rtctl.friction.document import BranchDocument
from rtctl.friction.kind_compile import TOLERANCE_SHARE, sampled_error
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_table import KINDS
from rtctl.friction.model import Branch, FrictionModel

_REMEDY = "fit the model again (rtctl fit) or restore the file from its source"

DERIVED = {
    "compile_bound_nm": "rounding_bound_nm",
    "friction_lower_nm": "friction_lower_nm",
    "secant_damping_nms_rad": "secant_damping_nms_rad",
    "slope_damping_nms_rad": "slope_damping_nms_rad",
}
"""Key of the file -> property of the branch it must equal."""


def refuse(path: Path, key: str, what: str, remedy: str = _REMEDY) -> NoReturn:
    """Raise ModelError: the file, the key, what is wrong with it, and the remedy."""
    raise ModelError(f"{path}: {shown(key)}: {shown(what, 500)}; {remedy}")


def _check_curve(path: Path, key: str, curve: Curve) -> None:
    kind, p = KINDS[curve.kind], curve.parameters
    if not kind.has_parameters(p):
        refuse(path, f"{key}.parameters", f"are not those of a {curve.kind} curve")
    if kind.is_formula and len(curve.support_vectors):
        refuse(path, f"{key}.support_vectors", f"a {curve.kind} curve has none")
    if len(curve.support_vectors) != len(curve.dual_coef):
        refuse(path, key, "support vectors and dual coefficients differ in number")
    for parameter in (one for one in kind.parameters if one.name in p):
        refusal = parameter.refusal(p[parameter.name])
        if refusal:
            refuse(path, f"{key}.parameters", refusal)
    refusal = mean_document.refusal(curve)
    if refusal:
        refuse(path, f"{key}.parts", refusal)
    for at, (_, part) in enumerate(curve.parts):
        _check_curve(path, f"{key}.parts.{at}", part)


def check_compiled(path: Path, key: str, branch: Branch, document: BranchDocument) -> None:
    """Raise ModelError unless the numbers stored with a branch are those that its compiled curve gives."""
    for name, derived in DERIVED.items():
        stored, found = getattr(document, name), getattr(branch, derived)
        if name == "compile_bound_nm" and found < stored <= _most_table_error_nm(branch):
            continue  # an older proof was coarser: it holds all the same
        # not `>`: a NaN of what overflowed is refused, too
        if not abs(stored - found) <= 1e-9 + 1e-6 * abs(found):
            refuse(path, f"{key}.{name}", f"is {stored:.6g}, the curve itself gives {found:.6g}")
    seen = sampled_error(branch.source, branch.curve, branch.speed_max_rad_s)
    if not seen <= document.compile_bound_nm * (1 + 1e-6) + 1e-12:
        refuse(
            path, f"{key}.coefficients", f"are off the learned curve by {seen:.3g} N m, more than was proved"
        )


def _most_table_error_nm(branch: Branch) -> float:
    """Bound of every table that was ever made, N m; 0 where the curve is compiled exactly."""
    if branch.source.exact is not None:
        return 0.0
    return TOLERANCE_SHARE * branch.friction_max_nm + 2 * branch.source.rounding(branch.speed_max_rad_s)


def check_branch(path: Path, key: str, branch: Branch) -> None:
    """Raise ModelError unless a branch is of its kind, rises from knot to knot, and is positive friction over
    its whole range."""
    _check_curve(path, key, branch.source)
    knots, coefficients = branch.curve.knots, branch.curve.coefficients
    if len(knots) != len(coefficients):
        refuse(path, key, "knots and coefficients differ in number")
    if knots[0] != 0 or not (np.diff(knots) > 0).all() or knots[-1] > branch.speed_max_rad_s:
        refuse(path, f"{key}.knots", "must begin at 0 and rise strictly within the trained range")
    if branch.band is not None and not branch.band.is_whole:
        refuse(path, f"{key}.band", "needs edges that rise and one half width more than edges")
    speeds = branch.curve.extreme_speeds(branch.speed_max_rad_s)
    values = branch.magnitude(speeds)
    if not (values > 0).all():
        at = speeds[int(np.argmin(values))]
        refuse(path, f"{key}.coefficients", f"the friction is not positive at {at:.4g} rad/s")
    # rounding of another machine's roots, and no more
    if not abs(values.max() - branch.friction_max_nm) <= 1e-9 * (1 + branch.friction_max_nm):
        refuse(path, f"{key}.friction_max_nm", "is not the largest value of the curve")
    # the dry part's are others
    speeds = branch.curve.extreme_speeds(branch.speed_max_rad_s, branch.viscous_nms_rad)
    dry = branch.magnitude(speeds) - branch.viscous_nms_rad * speeds
    if not abs(dry.min() - branch.friction_min_nm) <= 1e-9 * (1 + branch.friction_max_nm):
        refuse(path, f"{key}.friction_min_nm", "is not the least dry friction of the curve")


def check_whole(path: Path, model: FrictionModel, friction_max_nm: float) -> None:
    """Raise ModelError unless what is told of both branches together agrees with them; `friction_max_nm` as
    the file has it."""
    if model.presliding_rad is None and (model.presliding_spread_rad is not None or model.presliding_ramps):
        refuse(path, "presliding_rad", "is missing beside its own spread or number of ramps")
    if (model.presliding_spread_rad is None) != (model.presliding_ramps == 0):
        refuse(path, "presliding_spread_rad", "and presliding_ramps must both be given, or neither")
    if friction_max_nm != model.friction_max_nm:
        refuse(path, "friction_max_nm", "is not the larger of both branches")
    velocity, expected = model.self_test.T
    branch = (velocity < 0).astype(int)
    # beyond it the compiled curve is held and the learned one is not
    if not (np.abs(velocity) <= np.array([b.speed_max_rad_s for b in model.branches])[branch]).all():
        refuse(path, "self_test", "a vector lies outside the trained range")
    # a branch without a vector would be believed unseen
    if set(branch) != {0, 1}:
        refuse(path, "self_test", "the vectors cover one direction only")
    error = np.abs(model.magnitude(velocity) - expected)
    bound = np.array([b.rounding_bound_nm for b in model.branches])[branch]
    if not (error <= bound).all():
        at = int(np.argmax(error - bound))
        refuse(
            path,
            f"self_test.{at}",
            f"the compiled curve gives {model.magnitude(velocity[at]):.12g} N m at {velocity[at]:.6g} rad/s, "
            f"not {expected[at]:.12g}",
        )
