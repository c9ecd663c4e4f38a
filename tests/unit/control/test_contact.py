"""The help in contact with a world."""

from law_rig import LawRig

from rtctl.control.vocabulary import Policy

HYBRID = {"friction_policy": int(Policy.HYBRID)}


def pressed(kind):
    """A rig in a wall that begins where it is, in a hand that presses; or in none."""
    rig = LawRig(**HYBRID, coupling_stiffness_nm_rad=60.0).friction().arm()
    rig.environment(kind, environment_stiffness_nm_rad=100.0, environment_side=1)
    rig.force_n[1] = 2.0
    for k in range(50):
        rig.tick(k * 1e-4)
    return rig


def test_the_law_knows_what_the_world_takes_of_the_hands_torque():
    rig = pressed("wall")
    assert rig["coupling_torque_nm"] < -0.05
    assert rig.state["calm_world_nm"][0, 0] == rig["coupling_torque_nm"]


def test_in_free_motion_it_is_nothing_not_by_one_bit():
    assert pressed("free").state["calm_world_nm"][0, 0] == 0.0
