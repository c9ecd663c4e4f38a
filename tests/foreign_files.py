"""Rig files for `tests/foreign_rig.py`: what somebody would write of such joints and devices, with friction
models that may be wrong.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from rtctl.check import stability_report
from rtctl.control.proofs import stability
from rtctl.friction import artefact
from rtctl.friction.kind_curve import Curve
from rtctl.friction.learn.fit import assemble, describe_branch
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import Config, load
from rtctl.simulation.family import merged

CONFIGS = Path(__file__).parents[1] / "configs"
DIRECTIONS = ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
"""In which a sensor of three forces feels the first, second and third axis."""


def model(joint, rig="mock", motion="rotary", factor=1.0, stribecks=40.0, **more):
    """The joint's own Stribeck curve, or one that is `factor` times too large, up to so many of its Stribeck
    speeds; `more` are fields of the model.
    """
    top = stribecks * joint["stribeck"]
    branches, rows = [], []
    for way, scale in ((1, factor), (-1, factor * joint["backward"])):
        curve = Curve.formula(
            "tustin",
            {"coulomb_nm": scale * joint["coulomb"], "breakaway_nm": scale * joint["breakaway"],
                "stribeck_rad_s": joint["stribeck"], "viscous_nms_rad": joint["viscous"]},
        )  # fmt: skip
        speed = np.concatenate([[0.0], np.geomspace(top / 400, top, 24)])
        friction = curve(speed)
        rows += [(way * v, f, way, np.nan, np.nan) for v, f in zip(speed, friction, strict=True)]
        errors = np.full(len(speed), 0.005 * joint["coulomb"])
        branches.append(describe_branch(curve, speed, friction, errors, {}))
    points = replace(FrictionPoints.from_rows(rows, "made", "0" * 64), motion=motion)
    made = assemble(points, tuple(branches), rig=rig)
    length = joint["breakaway"] / joint["bristle"]
    return replace(
        made, presliding_rad=length, presliding_spread_rad=0.05 * length, presliding_ramps=10, **more
    )


def rig_file(base, axes, folder, *, models=None, rate_hz=1000.0, device=None, **rig):
    """The shipped file `base` with these axes (changes of its first one), and a model for each, if there are
    any.
    """
    loaded = load(CONFIGS / base)
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["loop"]["rate_hz"] = rate_hz
    for key, value in rig.items():
        table[key] |= value
    first, table["axis"] = table["axis"][0], []
    for i, told in enumerate(axes):
        one = merged(first, {"name": f"axis{i}", **told})
        if models is not None:
            path = Path(folder) / f"model{i}.json"
            artefact.save(models[i], path)
            one["friction"]["model"] = str(path)
        table["axis"].append(one)
    options = merged(loaded.options, device or {})
    options = {**options, "axis": options["axis"][:1], "hand": options["hand"][:1]}
    return loaded.model_copy(update={"config": Config.model_validate(table), "options": options})


def fitted(base, axes, folder, share, **more):
    """The same with `share` of the stiffest coupling on each axis, softer and more gently helped as long as
    `check` refuses it; None where that is no use.
    """
    plain = rig_file(base, axes, folder, **more)
    axes = [dict(one) for one in axes]
    for index, one in enumerate(axes):
        k_c = min(share * stiffest(plain, index), 1e6)
        one["coupling"] = one["coupling"] | {"stiffness_nm_rad": k_c}
        # as steep as `check` asks for it, and no steeper (decision 0166)
        steep = 0.251 * k_c * plain.config.axis[index].velocity_limit_rad_s
        one["torque_rate_nm_s"] = max(plain.config.axis[index].torque_rate_nm_s, steep)
    for _ in range(3):
        loaded = rig_file(base, axes, folder, **more)
        if certified(loaded):
            return loaded
        for one in axes:
            k_c, friction = one["coupling"]["stiffness_nm_rad"], one["friction"]
            softer = {
                "gain": 0.9 * friction["gain"],
                "intent_lowpass_hz": 15.0,
                "observer": {"gain": 0.7, "bandwidth_hz": 10.0},
            }
            one["coupling"], one["friction"] = (
                one["coupling"] | {"stiffness_nm_rad": 0.7 * k_c},
                friction | softer,
            )
    return None


def stiffest(loaded, index):
    """Stiffest coupling of axis `index` that may pass, of which alone the other figures are not asked."""
    b, between, spring, load = stability_report.bearing(loaded, index)
    damping = (1 + load) * loaded.config.axis[index].coupling.damping_nms_rad
    most = stability.k_max_between(b, damping, loaded.config.period_s, between) - spring
    return max(most, 0.0) / (1 + load)


def certified(loaded):
    """True when `rtctl check` ends with OK."""
    return stability_report.examine(loaded, telling=False).ok
