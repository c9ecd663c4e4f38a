"""Engines that move a joint of `plants`, a row each, imported where one is asked for.

`Moved(joint, hand, world, device)` of a row's module has numbers that are changed in place: `ctrl` (N m of
the motor, then of the hand), `qpos`, `qvel` (motor first; `at`: where link and arm begin, and how many of the
arm), `sensed` (force of the hand, its second is `lever` times the torque at the handle over `LEVER_M`) and
`given` (N m of the motor, behind the current loop). `step(*pointers)` goes on by `device.step_s`; `sound()`
raises `DivergedError` where that is not to be trusted; `hold(share)` is how firmly the handle is held, 0 (let
go) to 1.
"""

from importlib import import_module

ROWS = {
    "mujoco": "foreign_engine.of_mujoco",
    "dart": "foreign_engine.of_dart",
    "bullet": "foreign_engine.of_bullet",
}
"""`pip install mujoco`, `dartpy` or `pybullet`: no dependencies of ours."""


def made(joint, hand, world, device):
    """The joint in the hand, moved by the device's engine."""
    return import_module(ROWS[device.engine]).Moved(joint, hand, world, device)
