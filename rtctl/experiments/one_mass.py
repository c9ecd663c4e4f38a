"""A rig's first axis as a device of one mass with viscous damping, and what is proven of a coupling on it."""

from __future__ import annotations

from dataclasses import dataclass

from rtctl.control.proofs import stability
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation.certificate import sure_damping_nms_rad


@dataclass(frozen=True)
class Device:
    """J, b and T of the axis, and how it moves; of an elastic joint's b what no hand takes away."""

    inertia: float
    damping: float
    period_s: float
    motion: str


def device_of(loaded: LoadedConfig) -> Device:
    """The first axis of a rig."""
    axis = loaded.config.axis[0]
    return Device(axis.inertia_kgm2, sure_damping_nms_rad(loaded), loaded.config.period_s, axis.motion)


def proven(device: Device, share: float) -> float:
    """Largest proven k_c at b_c = share b, viscous damping alone, N m/rad."""
    return stability.k_max_sampled_data(device.damping, share * device.damping, device.period_s)
