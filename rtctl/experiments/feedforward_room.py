"""How much of the hand's torque over a sine a feed-forward can take: a bound that no run is needed for."""

from __future__ import annotations

import math

from hw.simulators.mock_records import plant_records
from rtctl.experiments.virtual import Motion
from rtctl.rig_file.config import LoadedConfig


def most_taken_off(loaded: LoadedConfig, motion: Motion, share: float) -> float:
    """Share of the hand's RMS torque over a sine that a feed-forward takes off at most.

    Parameters
    ----------
    loaded
        A simulated rig; its first axis with F_c as all of its dry friction.
    motion
        A sine, as large as the rig has room for.
    share
        Of the dry friction that is compensated: of the model times the gain, 0 to 1.

    Notes
    -----
    Friction is in phase with the speed v0 sin(w t) and J a in quadrature to it (docs/experiments.md, "How
    much a feed-forward can take"), so RMS^2 = F^2 + 4/pi F b v0 + (b v0)^2 / 2 + (J w v0)^2 / 2."""
    sine, axis = motion.on(loaded), loaded.config.axis[0]
    w = 2 * math.pi * sine.frequency_hz
    top = w * abs(sine.amplitude_rad)
    dry = float(plant_records(loaded.options, loaded.config.hardware())[0]["coulomb_nm"][0, 0])
    dragged, inertial = axis.viscous_nms_rad * top, axis.inertia_kgm2 * w * top

    def rms(kept: float) -> float:
        force = kept * dry
        return math.sqrt(force**2 + 4 / math.pi * force * dragged + dragged**2 / 2 + inertial**2 / 2)

    return 1.0 - rms(1.0 - share) / rms(1.0)
