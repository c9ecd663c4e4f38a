"""Seeded bugs of the simulated rig: a wrong plant lets a wrong controller pass."""

from __future__ import annotations

from seed import Seed

HW = "tests/unit/hw"
ELEMENTS = (f"{HW}/test_mock_elements.py",)
ENERGY = (f"{HW}/test_mock_joint.py::test_no_step_gives_energy",)
JOINT = (f"{HW}/test_mock_joint.py::test_two_masses_move_as_a_stiff_solver_says",)
TIMING = (f"{HW}/test_mock_timing.py",)
LOAD = (f"{HW}/test_mock_load_drift.py::test_the_closed_forms_are_the_published_ones",)
DRIFT = (
    f"{HW}/test_mock_load_drift.py::test_the_motors_sensor_shows_the_temperature_that_the_friction_follows",
)
PLANTS = (
    "tests/unit/test_campaign_plants.py"
    "::test_friction_from_below_damping_of_the_motor_and_all_that_is_late_are_true",
)

SEEDS = (
    Seed(
        "the series of a bristle's step ends too early", "hw/simulators/mock_bristles.py",
        "rest = low + (q_2 * q_2) * high", "rest = low",
        (f"{HW}/test_mock_friction.py::test_the_bristle_step_loses_no_digits_however_little_turns_over",),
    ),
    Seed(
        "an element that slides is damped as if it stuck", "hw/simulators/mock_elements.py",
        "reach * share + damping * w * share", "reach * share + damping * w", ELEMENTS,
    ),
    Seed(
        "an element keeps what it can no longer hold", "hw/simulators/mock_elements.py",
        "force = min(max(min(max(torques[i], low), high) + stiffness * h * w, low), high)",
        "force = torques[i] if w == 0.0 else min(max(torques[i] + stiffness * h * w, low), high)", ELEMENTS,
    ),
    Seed(
        "the elements' shares do not add up to one", "hw/simulators/mock_effects.py",
        "places / places.sum()", "places / count**2", ELEMENTS,
    ),
    Seed(
        "the elastic joint pulls at the motor only", "hw/simulators/mock_joint.py",
        "link[J] * push * link[V] + drive[1] + spring)", "link[J] * push * link[V] + drive[1])", JOINT,
    ),
    Seed(
        "the joint's torque is that of the start of a step", "hw/simulators/mock_joint.py",
        "c + share * h * k, k * (", "c, k * (",
        (f"{HW}/test_mock_joint.py"
         "::test_a_free_pair_of_masses_swings_at_its_own_frequency_and_decays_by_the_joints_damping",),
    ),
    Seed(
        "a bristle of a loaded joint stretches beyond break-away", "hw/simulators/mock_sides.py",
        "    if s0 * abs(z_new) <= highest:\n        return False\n",
        "    if z_new < 1.0:\n        return False\n", ENERGY,
    ),
    Seed(
        "the encoder turns with the link whatever is said", "hw/simulators/mock_sensors.py",
        "angle = s.position_rad[axis] + (1.0 - p.encoder_at_link[axis]) * s.joint_twist_rad[axis]",
        "angle = s.position_rad[axis]",
        (f"{HW}/test_mock_joint.py"
         "::test_the_hand_stands_on_the_link_and_the_encoder_on_the_side_it_is_said_to",),
    ),
    Seed(
        "the torque of a lagging current is that of the end of a step", "hw/simulators/mock_joint.py",
        "motor_nm = per_a * (wanted_a + (current - wanted_a) * lag_mean)",
        "motor_nm = per_a * (wanted_a + (current - wanted_a) * lag_keep)", TIMING,
    ),
    Seed(
        "a fraction of a delay is left out", "hw/simulators/mock_plant.py",
        "return int(whole), share if share > _AT_ONCE else 0.0", "return int(whole), 0.0", TIMING,
    ),
    Seed(
        "of two currents in a period the newer one comes first", "hw/simulators/mock_plant.py",
        "share * duration_s, late, line[whole + 1])", "share * duration_s, late, line[whole])", TIMING,
    ),
    Seed(
        "a current lives on in the current loop after the watchdog", "hw/simulators/mock_plant.py",
        "            s.current_a[axis] = 0.0  # the watchdog", "            pass  # the watchdog", TIMING,
    ),
    Seed(
        "a slow device counts a held sample as fresh", "hw/simulators/mock_sensors.py",
        "due = slot != s.sampled_slot", "due = True", TIMING,
    ),
    Seed(
        "the square of the load acts when both push the same way", "hw/simulators/mock_load.py",
        "if motor_nm * outside_nm < 0.0:", "if motor_nm * outside_nm > 0.0:", LOAD,
    ),
    Seed(
        "the motor's torque adds to the load as the hand's does", "hw/simulators/mock_load.py",
        "base = abs(p.load_outside[axis] * outside_nm - p",
        "base = abs(p.load_outside[axis] * outside_nm + p", LOAD,
    ),
    Seed(
        "viscous friction does not follow the temperature", "hw/simulators/mock_drift.py",
        "        viscous *= 1.0 + p.viscous_per_c[axis] * warmer_c\n", "", DRIFT,
    ),
    Seed(
        "a plant of the family loses its controller's damping", "rtctl/simulation/family.py",
        'merged(axis, plant.told) for axis in table["axis"]', 'axis for axis in table["axis"]',
        ("tests/unit/test_family.py::test_what_the_law_is_told_is_true_of_the_plant",),
    ),
    Seed(
        "a campaign's law is promised the damping of the link", "rtctl/simulation/campaign_plants.py",
        'plant["viscous_nms_rad"][axis] /= 1 - viscous', 'plant["viscous_nms_rad"][axis] /= 1.0', PLANTS,
    ),
    Seed(
        "a campaign's law is promised friction that a wave takes away", "rtctl/simulation/campaign_plants.py",
        "up = friction / ((1 - dry) * (1 - waves))", "up = friction / (1 - dry)", PLANTS,
    ),
)  # fmt: skip
