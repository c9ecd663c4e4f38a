"""What the devices of an axis know of its joint and do to its commands, beside what the rig file says."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from hw import registry
from hw.interface import Joint, Shown
from hw.member import Member
from hw.rig_words import subset
from rtctl.rig_file.config import LoadedConfig

_COMMANDS = frozenset({"torque", "current_command"})


def joint_of_axis(loaded: LoadedConfig, axis: int) -> Joint:
    """The joint as the rig file has it or, where that is worse, as the devices know it."""
    drive = loaded.config.axis[axis].drive
    known = [
        registry.joint(member.kind, member.options, subset(loaded.config.hardware(), member.axes))[at]
        for member, at in members_of(loaded, axis)
    ]
    # a device that knows nothing of the joint contradicts nobody
    elastic = [one for one in known if one != Joint()]
    dampings = [one.damping_nms_rad for one in elastic]
    if drive.motor_share < 1 or not elastic:  # the file's number counts only where the file calls it elastic
        dampings.append(drive.joint_damping_nms_rad)
    return Joint(
        # the least damping on the motor's side counts, whoever says it
        motor_share=min([drive.motor_share, *(one.motor_share for one in elastic)]),
        dry_share=min([drive.motor_share, *(one.dry_share for one in elastic)]),
        damping_nms_rad=min(dampings),
        # two that differ: not known
        stiffness_nm_rad=elastic[0].stiffness_nm_rad if len(elastic) == 1 else 0.0,
        # half and half: where nobody says it
        link_inertia_share=elastic[0].link_inertia_share if len(elastic) == 1 else 0.5,
        # one that says link is enough: no damping proves such a joint
        encoder="link" if "link" in (drive.encoder, *(one.encoder for one in elastic)) else "motor",
    )


def sure_damping(b_nms_rad: float, joint: Joint) -> float:
    """Damping of `b_nms_rad` that no passive hand behind the joint can cancel, N m s/rad: b_m + b_j b_l /
    (b_j + b_l), and all of it where the joint is rigid (docs/theory.md 2.8)."""
    link, own = link_damping(b_nms_rad, joint), joint.damping_nms_rad
    return joint.motor_share * b_nms_rad + (link * own / (link + own) if link > 0 and own > 0 else 0.0)


def taken_damping(b_nms_rad: float, joint: Joint) -> float:
    """What of a damping of `b_nms_rad` a passive hand behind the joint can cancel, N m s/rad."""
    return b_nms_rad - sure_damping(b_nms_rad, joint)


def link_damping(b_nms_rad: float, joint: Joint) -> float:
    """Damping of `b_nms_rad` behind the joint's spring, N m s/rad: help, which acts at the motor, takes
    nothing of it."""
    return (1 - joint.motor_share) * b_nms_rad


def cut_a(loaded: LoadedConfig, axis: int) -> float:
    """What the device that takes the torque of the axis cuts larger currents to, A: `current_max_a` of its
    table of the axis; inf where it has none, or is simulated as ideal."""
    cuts = [math.inf]
    for member, at in members_of(loaded, axis):
        tables: Sequence[Mapping[str, Any]] = member.options.get("axis") or ({},)
        table = tables[at if len(tables) > 1 else 0]  # one table stands for all axes of a device
        if _COMMANDS & set(member.channels) and table.get("current_max_a") is not None:
            cuts.append(float(table["current_max_a"]))
    return min(cuts)


def members_of(loaded: LoadedConfig, axis: int) -> Iterable[tuple[Member, int]]:
    """Devices that give the position of the axis or take its torque, and its place among theirs."""
    for member in loaded.members():
        if axis in member.axes and ({"position", *_COMMANDS} & set(member.channels)):
            yield member, member.axes.index(axis)


def shown_of_axis(loaded: LoadedConfig, axis: int) -> Shown:
    """What the numbers of the devices can show of the axis: its steps alone, 0 where they are not known."""
    step_rad, counted, step_a, found = 0.0, False, 0.0, Shown()
    for member in loaded.members():
        one = registry.shown(member.kind, member.options, subset(loaded.config.hardware(), member.axes))
        at = member.axes.index(axis) if axis in member.axes else -1
        if "position" in member.channels and at >= 0 and one.step_rad:
            step_rad, counted = one.step_rad[at], one.counted
        if "current" in member.channels and at >= 0 and one.current_step_a:
            step_a = one.current_step_a[at]
        if "force" in member.channels:
            found = one
    return replace(found, step_rad=(step_rad,), counted=counted, current_step_a=(step_a,))
