"""The test pulse is one that a good rig passes: strong, elastic, and slow ones."""

import numpy as np
import pytest

from rtctl.check import stability_report
from rtctl.check.law_plan import build
from rtctl.control.take_back import OVERSPEED_FACTOR, cost
from rtctl.control.vocabulary import State
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

RIG = """
schema = 1
[rig]
name = "pulsed"
[loop]
rate_hz = {rate}
[[axis]]
name = "joint"
inertia_kgm2 = {inertia}
viscous_nms_rad = {viscous}
dry_friction_nm = 0.1
encoder_counts_per_rev = 10000000
torque_constant_nm_a = {constant}
lever_m = [0.0, 0.3, 0.0]
torque_limit_nm = {limit}
torque_rate_nm_s = {slope}
velocity_limit_rad_s = {fast}
current_limit_a = 30.0
[axis.drive]
motor_share = {share}
[axis.coupling]
stiffness_nm_rad = 0.01
[[device]]
kind = "mock"
[device.options]
timing = {{ sample_every_ticks = {every}, transport_delay_ticks = {delay} }}
[[device.options.axis]]
inertia_kgm2 = {inertia}
[device.options.axis.friction]
coulomb_nm = 1e-6
breakaway_nm = 1e-6
viscous_nms_rad = {viscous}
"""
# quick, seldom sampled, strong; each was refused by its own test pulse: PASSIVITY, WIRING, WIRING
RIGS = {
    "strong": {
        "rate": 2000, "inertia": 0.33, "viscous": 0.6, "limit": 560.0, "fast": 3.9, "share": 1.0, "every": 1,
        "delay": 0.0,
    },
    "seldom": {
        "rate": 100, "inertia": 0.0062, "viscous": 0.02, "limit": 4.5, "fast": 16.0, "share": 1.0, "every": 2,
        "delay": 0.1,
    },
    "late": {
        "rate": 1000, "inertia": 0.84, "viscous": 1.0, "limit": 141.0, "fast": 12.2, "share": 1.0, "every": 3,
        "delay": 2.0,
    },
    "elastic": {
        "rate": 1000, "inertia": 0.1, "viscous": 0.2, "limit": 29.0, "fast": 10.0, "share": 0.5, "every": 1,
        "delay": 0.0,
    },
}  # fmt: skip


def loaded(tmp_path, name):
    """The rig file of that name, which `rtctl check` lets pass."""
    table = RIGS[name]
    text = RIG.format(**table, constant=table["limit"] / 10, slope=100 * table["limit"])
    (tmp_path / "rig.toml").write_text(text)
    found = load(tmp_path / "rig.toml")
    assert stability_report.examine(found, telling=False).ok
    return found


@pytest.mark.parametrize("name", RIGS)
def test_a_pulse_leaves_the_account_alone(tmp_path, name):
    plan = build(loaded(tmp_path, name))
    p, table = plan.params[0], RIGS[name]
    tau, part_s = p["arming_torque_nm"][0], p["arming_ticks"] * plan.period_s
    motor = table["inertia"] * (1.0 if table["share"] == 1 else 1 / 16)
    moved_j = (tau * part_s) ** 2 / (2 * motor)
    way = OVERSPEED_FACTOR * table["fast"] * plan.period_s
    late = p["acting_delay_s"][0] / plan.period_s
    held_j = cost(tau, p["torque_rate_nm"][0], way) + late * way * tau
    assert moved_j + held_j <= 1.5 * p["energy_budget_j"] * (1 + 1e-9)
    assert tau * part_s / motor <= table["fast"]
    # and no smaller than need be: one of its bounds is reached
    gentle = table["inertia"] * min(1.0, 16 * motor / table["inertia"] / 4) * table["fast"] / (4 * part_s)
    full = (0.25 * p["energy_budget_j"] / moved_j, 1.25 * p["energy_budget_j"] / held_j)
    assert tau == pytest.approx(0.05 * table["limit"]) or tau == pytest.approx(gentle) or min(full) < 1.6


@pytest.mark.parametrize("name", ["strong", "seldom", "late"])
def test_a_good_rig_passes_its_own_test(tmp_path, name):
    simulation = Simulation(loaded(tmp_path, name))
    period_s = simulation.plan.period_s
    # ready, and at the place among its samples that hides the pulse
    ready = max(505, round(0.505 / period_s))
    simulation.run((ready * RIGS[name]["every"] + 1) * period_s)
    simulation.change(arm_count=1, epoch=int(simulation.state["epoch"][0]))
    simulation.run((4 * int(simulation.params["arming_ticks"][0]) + 10) * period_s)
    assert int(simulation.state["fault_first"][0]) == -1
    assert np.all(simulation.state["state"] == State.ACTIVE)
