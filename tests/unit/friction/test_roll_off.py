"""Help ends beyond the trained range as gently as the drive is late: what swings by a steeper end does not by
this one."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtctl.check import lateness, stability_report
from rtctl.check import law_plan as plan
from rtctl.control.proofs.stability import Between
from rtctl.friction import artefact
from rtctl.friction.kind_curve import Curve
from rtctl.friction.learn.fit import assemble, describe_branch
from rtctl.friction.margins import friction_figures
from rtctl.friction.points import FrictionPoints
from rtctl.friction.roll_off import rolled_off
from rtctl.rig_file.config import Config, load

CONFIGS = Path(__file__).parents[3] / "configs"
T = 1e-3
DRY, B, J = 0.25, 0.05, 0.012


def of(name, motor_share=1.0):
    loaded = load(CONFIGS / name)
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["axis"][0]["drive"]["motor_share"] = motor_share
    loaded = loaded.model_copy(update={"config": Config.model_validate(table)})
    axis = loaded.config.axis[0]
    return loaded, axis, artefact.load(loaded.model_path(axis))


def made(top=1.0, viscous=B, breakaway=0.35):
    """A model of a joint measured up to `top` rad/s, with Stribeck's speed at .1 rad/s."""
    curve = Curve.formula(
        "tustin",
        {"coulomb_nm": DRY, "breakaway_nm": breakaway, "stribeck_rad_s": 0.1, "viscous_nms_rad": viscous},
    )
    speed = np.concatenate([[0.0], np.geomspace(top / 100, top, 24)])
    rows = [
        (way * v, f, way, np.nan, np.nan) for way in (1, -1) for v, f in zip(speed, curve(speed), strict=True)
    ]
    errors = np.full(len(speed), 1e-3)
    branches = tuple(describe_branch(curve, speed, curve(speed), errors, {}) for _ in range(2))
    return assemble(FrictionPoints.from_rows(rows, "made", "0" * 64), branches, rig="mock")


def joint(inertia=J, viscous=B):
    axis = of("mock.toml")[1]
    return axis.model_copy(update={"inertia_kgm2": inertia, "viscous_nms_rad": viscous})


def slope(model):
    """Of help that takes all of the dry friction, N m s/rad."""
    dry = max(float(one.magnitude(one.speed_max_rad_s)) - B * one.speed_max_rad_s for one in model.branches)
    return dry / model.speed_fade_rad_s


def test_a_drive_that_is_prompt_ends_as_its_model_says():
    loaded, _, model = of("mock.toml")
    assert plan.build(loaded).model["speed_fade_rad_s"].tolist() == [[model.speed_fade_rad_s] * 2]


def test_law_and_check_end_a_late_drive_alike():
    for share in (1.0, 0.4):  # rigid, and elastic: the rest of its damping is a hand's to take away
        loaded, axis, model = of("mock-slow-drive.toml", share)
        between, period_s = lateness.of_axis(loaded, 0).between, loaded.config.period_s
        taken = (1 - share) * axis.viscous_nms_rad
        ended = rolled_off(model, axis, period_s, between, taken)
        assert ended.speed_fade_rad_s > 10 * model.speed_fade_rad_s / share
        fade = plan.build(loaded).model["speed_fade_rad_s"]
        assert fade == pytest.approx(np.full((1, 2), ended.speed_fade_rad_s), rel=1e-12)
        for gain in (0.3, axis.friction.gain):  # with little help the stretch beyond is the weaker
            table = axis.friction.model_copy(update={"gain": gain})
            less = axis.model_copy(update={"friction": table})
            one, other = (
                friction_figures(which, Path("m"), less, period_s, 4e-5, between, taken_nms_rad=taken)
                for which in (model, ended)
            )
            assert one == other
            assert one.beyond_damping_nms_rad > 0.9 * axis.viscous_nms_rad


def test_a_share_of_the_help_that_passes_leaves_what_a_hand_takes_away():
    (_, axis, model), T, between = of("mock.toml"), 1e-3, Between()
    passes = [
        friction_figures(model, Path("m"), axis, T, 4e-5, between, taken_nms_rad=taken).gain_max
        for taken in (0.0, 0.02)
    ]
    assert passes[1] < passes[0]
    elastic = of("mock.toml", 0.6)[0]
    found = stability_report.figures_alone(elastic, 0).friction
    assert found.gain_max < stability_report.figures_alone(of("mock.toml")[0], 0).friction.gain_max


@pytest.mark.parametrize("delay", [1.0, 3.0, 9.0, 30.0])
def test_on_no_gear_it_gives_more_than_the_joint_damps(delay):
    steep = slope(rolled_off(made(), joint(), T, Between(delay)))
    omega = 2 * math.pi * np.linspace(0, 250, 1000)
    assert (B + 1.001 * steep * np.cos(omega * (delay + 1) * T)).min() > 0
    assert steep * (delay + 1) * T / J <= 0.501
    assert steep == pytest.approx(B, rel=0.01)


def test_a_light_joint_is_ended_more_gently_than_its_gear_asks():
    light = rolled_off(made(), joint(inertia=1e-4), T, Between(4.0))
    assert slope(light) == pytest.approx(0.5e-4 / 5e-3, rel=0.01)
    prompt = rolled_off(made(), joint(inertia=1e-3), T, Between())
    assert slope(prompt) == pytest.approx(0.5, rel=0.01)


def test_what_a_model_says_itself_is_not_made_steeper():
    wide = replace(made(), speed_fade_rad_s=50.0)
    assert rolled_off(wide, joint(), T, Between(4.0)).speed_fade_rad_s == 50.0


def test_where_friction_still_falls_or_goes_by_place_it_ends_as_the_model_says():
    falling = made(top=0.1, breakaway=0.5)
    assert rolled_off(falling, joint(), T, Between(4.0)) is falling
    _, axis, by_place = of("mock-places.toml")
    assert rolled_off(by_place, axis, T, Between(4.0)) is by_place


def rings(model, delay, gear_hz=0.0, dt=5e-5, b=B):
    """RMS of a joint's speed beside its mean, pushed to where half of the help has gone; with a gear of
    `gear_hz` two equal masses, the link held at that speed by who pushes, `b` the motor's damping."""
    end, fade = model.branches[0].speed_max_rad_s, model.speed_fade_rad_s
    middle = end + 0.5 * fade
    late, help_nm = round((delay + 1) * T / dt), 0.9 * DRY
    motor, gear = (0.5 * J, 0.25 * J * (2 * math.pi * gear_hz) ** 2) if gear_hz else (J, 0.0)
    push, v, twist, seen = DRY + b * middle - 0.5 * help_nm, middle + 0.01, 0.0, []
    before = [0.5 * help_nm] * late
    for _ in range(round(2.0 / dt)):
        before.append(help_nm * min(max(1 - (v - end) / fade, 0.0), 1.0))
        twist += dt * (v - middle)
        v += dt / motor * (push + before.pop(0) - DRY - b * v - gear * twist)
        seen.append(v)
    return float(np.std(seen[len(seen) // 2 :]))


@pytest.mark.parametrize(("delay", "gear_hz"), [(12.0, 0.0), (4.0, 70.0), (8.0, 50.0), (2.0, 160.0)])
def test_a_joint_at_the_end_of_its_range_does_not_ring(delay, gear_hz):
    """With the tenth of its range it does."""
    model = made()
    assert rings(model, delay, gear_hz) > 0.02
    assert rings(rolled_off(model, joint(), T, Between(delay)), delay, gear_hz) < 0.005


def test_a_motor_whose_gear_is_declared_is_not_rung_by_the_damping_of_its_link():
    """A fifth of the damping is the motor's: an end as gentle as all of it allows drives the motor."""
    ends = [rolled_off(made(), joint(), T, Between(7.0), taken) for taken in (0.0, 0.8 * B)]
    assert slope(ends[1]) == pytest.approx(0.2 * B, rel=0.01)
    found = [rings(end, 7.0, 62.5, b=0.2 * B) for end in ends]
    assert found[0] > 0.05
    assert found[1] < 0.0075
