"""Table of a rig file: a joint displayed as a virtual mass that the measured force moves."""

from __future__ import annotations

from rtctl.rig_file.fields import Table, number

REQUIRED = ("mass_kgm2", "damping_nms_rad", "velocity_gain_nms_rad")
"""Keys that must be above 0 where an axis is displayed as an admittance: no other value is safe for every
rig."""


class AdmittanceTable(Table):
    """[axis.admittance]: with display = "admittance": the measured force moves a virtual mass, and the joint
    follows it"""

    mass_kgm2: float = number(
        0, 1e3, "m: inertia of the virtual mass, what the hand feels in place of inertia_kgm2", default=0.0
    )
    damping_nms_rad: float = number(
        0, 1e3, "b_v: its damping, what the hand feels in place of friction and viscous damping", default=0.0
    )
    velocity_gain_nms_rad: float = number(
        0, 1e4, "K_v: torque per speed by which the joint lags behind the virtual mass", default=0.0
    )
    position_gain_nm_rad: float = number(
        0,
        1e6,
        "K_p: torque per angle by which it lags; 0: a hand that leans on a virtual wall drifts at its "
        "torque over K_v",
        default=0.0,
    )
    # 0: a joint that sticks is told by `rtctl check`, with the damping that calms it
    rest_damping_nms_rad: float = number(
        0,
        1e4,
        "damping of the virtual mass while dry friction holds the joint, of its motion above 4 Hz: what "
        "keeps mass and hand from ringing on a joint that sticks; the hand begins to move it later by that",
        default=0.0,
    )
    force_lowpass_hz: float = number(
        0, 5000, "low-pass of the hand's torque, after [axis.force]; 0 is off", default=150.0
    )
    force_deadband_nm: float = number(
        0,
        1e3,
        "hand torque that moves nothing: more than the force sensor may be off after its tare, "
        "else the virtual mass drifts at the rest over damping_nms_rad",
        default=0.003,
    )
    velocity_lowpass_hz: float = number(
        0, 5000, "low-pass of the joint's velocity in the servo; 0 is off", default=100.0
    )
    feedforward: float = number(
        0,
        1,
        "share of the torque that the virtual mass's own motion asks of the joint, J a + b v less the "
        "hand's, sent ahead: what is felt is then nearer to mass and damping asked for than the servo "
        "alone brings it; of a mass below the joint's, the share m/J of this",
        default=1.0,
    )
    feedforward_lowpass_hz: float = number(0, 5000, "its low-pass; 0 is off", default=20.0)
    # .7: with all of it 29 of 3,000 hands of certified rigs swung on, with .7 none (docs/theory.md 14)
    compensation_share: float = number(
        0,
        1,
        "share of the learned help with friction while the mass is shown (the observer sends nothing "
        "then): the servo takes out most of the friction as it is, and joints that were helped with all of "
        "it swung on in hands they are certified for",
        default=0.7,
    )
    # 0: only a range that is told is certified, and what is certified may be asked for
    mass_max_kgm2: float = number(
        0,
        1e3,
        "largest mass that a client may ask for while it runs, mass_kgm2 the least; 0: not to be changed",
        default=0.0,
    )
    damping_max_nms_rad: float = number(
        0, 1e3, "largest damping likewise, damping_nms_rad the least; 0: not to be changed", default=0.0
    )
    hand_stiffness_nm_rad: float = number(
        0, 1e5, "box of hands that `rtctl check` proves stable: stiffest", default=600.0
    )
    hand_damping_nms_rad: float = number(0, 1e3, "and the most damped", default=1.0)
    hand_inertia_kgm2: float = number(0, 1e3, "and the heaviest, at the joint", default=0.02)

    def sent_ahead(self, inertia_kgm2: float) -> float:
        """Share that is sent ahead, 0 to 1, on a joint of this inertia: of a mass below it m/J at most.

        The force of the hand that is sent with it, J/m - 1 of it, then stays below what the hand does itself.
        """
        return self.feedforward * min(1.0, self.mass_kgm2 / inertia_kgm2)
