"""The help of the first releases, as parameters of today's law."""

AS_IN_THE_FIRST_RELEASES = {
    "observer_gain": 0.0,
    "assistance_bank_j": 1e3,
    "friction_intent_alpha": 1.0,
    "rest_alpha": 1.0,
    "friction_stop_rad": 1e-6,
    "friction_brake_nm": 0.0,
    "tremble_turn_s": 0.0,
    "paying_nm": 0.0,
    "friction_blend_rad_s": 0.05,
}
"""No observer, an account that never bites, the hand's torque unfiltered, the direction of the motion at
once, the blend of then, help for a hand that brakes or pays for nothing, and for strokes that shrink."""
FORGETS_S = 0.01


def forget(state):
    """Forget the strokes, and since when bristles are bent: done every `FORGETS_S`, the law cannot tell that
    the ones shrink, nor that the others have no speed.
    """
    state["stroke_reference_rad_s"] = state["stroke_wanted"] = 0.0
    state["bent_ticks"] = 0
