"""A rig in a hand that rests, and the joint's way under it."""

from law_rig import LawRig, Plant

from rtctl.control.vocabulary import State

HAND_NM_RAD = 5.0


def held_rig(**params):
    rig = LawRig(coupling_stiffness_nm_rad=60.0, coupling_damping_nms_rad=0.01, **params).arm()
    rig.environment("remote", target_position_rad=0.0, target_velocity_rad_s=0.0)
    return rig, Plant(damping=0.3)  # with the hand's own damping


def follow(rig, plant, target, ticks, every=17, velocity=0.0):
    """Send `target(k)` every so many ticks while a resting hand holds the joint; largest torque, N m."""
    largest = 0.0
    for k in range(ticks):
        if k % every == 0:
            rig.command["target_position_rad"] = target(k)
            rig.command["target_velocity_rad_s"] = velocity
            rig.request("target_count")
        rig.tick(plant.x)
        largest = max(largest, abs(rig["torque_applied_nm"]))
        plant.advance(rig["torque_applied_nm"] - HAND_NM_RAD * plant.x)
        if rig.mode is not State.ACTIVE:
            break
    return largest
