"""Rows of the motion that a hand makes: what help with friction does in it was measured, as nothing is
proved; which of it lets the law know the places of a model; and how far it may go."""

from __future__ import annotations

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.check.verdicts_of_units import Band, judged
from rtctl.rounded import down

SHAKEN = {"hybrid": (36, 611), "observer": (16, 222)}
"""By policy: hands of the box that were shaken beyond both references, of so many that moved certified rigs
on joints of another make (`tests/foreign_shaken.py`, seeds that chose nothing: decision 0111)."""

IN_CONTACT = {"hybrid": (25, 270), "observer": (2, 28)}
"""By policy: those of hands that tap, press, let go and grip again in rendered worlds
(`tests/foreign_contact.py`, decisions 0128 and 0147)."""


def moved(s: Subject) -> list[Verdict]:
    """No figure of a rig file tells which hand is shaken, so that no rig passes, and none is refused."""
    policy = s.table.friction.policy
    # the other policies were not tried in these hands
    if not s.axis.compensates or policy not in SHAKEN:
        return []
    (shaken, hands), (leaning, leaners) = SHAKEN[policy], IN_CONTACT[policy]
    return [
        s.row(
            "help in the hand that moves the joint",
            f"{shaken / hands:.1%} of hands",
            "none shaken",
            Outcome.NOT_PROVED,
            f"{shaken} of {hands} random hands on certified rigs with this policy were shaken by 20 mrad/s "
            "(2 after the motion) more than without help, and with hardly any friction, in contact with a "
            f"rendered world {leaning} of {leaners}; no figure of a rig file tells which; moved freely, half "
            "of gain and observer.gain shakes a fifth as many",
        )
    ]


def places_seen(s: Subject) -> list[Verdict]:
    """Faster motion says nothing of the places: who turns the joint by more has a model that is never
    trusted."""
    from rtctl.check.place_plan import judged_by  # the names of a report must not load the compiler

    found = s.axis.friction
    if found is None or s.table.friction.place != "seen" or not max(found.place_waves_per_rad) > 0:
        return []
    bandwidth_hz = s.axis.observer.bandwidth_hz if s.axis.force_sensor else 0.0
    late_s = s.axis.observer.own_ticks * s.period_s  # seen as much later than the model is
    speed, judged = judged_by(s.table, found.place_waves_per_rad, found.speed_max_rad_s, bandwidth_hz, late_s)
    figure = f"{speed:.3g} rad/s"
    # told only, as a rig works without its places: they are just not trusted, and the weakest one counts
    if speed <= 0:
        meaning = 'no force sensor, so the places are never seen: friction.place = "given" or "off"'
        return [s.row("places that are seen", figure, "> 0", Outcome.WARN, meaning)]
    meaning = (
        "after power-up a whole turn to and fro, slower than this, lets the law trust the model's places"
        + ("" if judged else "; its conservative part passes too quick to be seen, and is not compensated")
    )
    return [s.row("places that are seen", figure, "told only", Outcome.PASS, meaning)]


TRAVEL_RAD = Band(0.0, 0.0, 30.0, 3e3)
"""From end to end: to five turns, a hundred of a winch are told; in degrees a joint has 57 times its own."""
TRAVEL_M = Band(0.0, 0.0, 5.0, 50.0)
"""From end to end of a carriage, m."""


def travel(s: Subject) -> list[Verdict]:
    """Ends that no joint reaches stop nothing: a place beyond them is what tells a wrong encoder."""
    table = s.table
    ends = table.position_min_rad, table.position_max_rad
    fields = type(table).model_fields
    # no travel was given: its default says nothing of units
    if ends == (fields["position_min_rad"].default, fields["position_max_rad"].default):
        return []
    return judged(
        s,
        "travel from end to end",
        ends[1] - ends[0],
        "rad",
        TRAVEL_M if table.motion == "linear" else TRAVEL_RAD,
        "position_min_rad to position_max_rad",
        f"position_max_rad: {ends[1]:g} is meant in rad at the link, and position_min_rad {ends[0]:g}, too; "
        "a joint that turns without end leaves both out",
    )


SLOPE_SHARE = 0.25
"""Least speed up to which the torque follows the coupling, as a share of the velocity limit: a hand swings a
joint at a quarter of that without thinking."""


def late_spring(k_c: float, torque: float, slope: float, speed: float) -> float:
    """Damping that a coupling takes which is answered by `slope` N m/s at most, N m s/rad, of a joint up to
    `speed` rad/s; `torque` N m is the limit.

    Notes
    -----
    docs/theory.md 2.18: a bound on a describing function, no proof."""
    beyond = k_c * speed / slope - 1.0
    return min(0.42 * beyond, 0.27) * k_c * torque / slope if beyond > 0 else 0.0


def slope_of_the_torque(s: Subject) -> list[Verdict]:
    """Faster than a joint may go before its coupling wants a steeper torque than the gate lets pass, the
    torque comes late: every other row of the coupling speaks of slower motion."""
    table, axis, found = s.table, s.axis, s.axis.friction
    k_c = axis.stiffness_nm_rad
    if found is not None:  # with what help by place and by load add
        k_c = (1 + found.load_loop) * k_c + found.place_stiffness_nm_rad
    if k_c == 0:
        return []
    slope, fast = table.torque_rate_nm_s, table.velocity_limit_rad_s
    follows = slope / k_c
    needed = late_spring(k_c, table.torque_limit_nm, slope, fast)
    calm = needed <= max(axis.sampled_data_margin_nms_rad, 0.0)
    refused = not calm and follows < SLOPE_SHARE * fast
    remedy = (
        f"torque_rate_nm_s = {k_c * fast:.4g} follows up to the limit, "
        f"{SLOPE_SHARE * k_c * fast:.4g} is not refused; or a softer coupling"
    )
    return [
        s.row(
            "slope of the torque against the coupling",
            f"{follows:.3g} rad/s",
            f">= {fast:.3g} rad/s",
            Outcome.PASS if calm else Outcome.FAIL if refused else Outcome.NOT_PROVED,
            "speed up to which torque_rate_nm_s follows the coupling's spring"
            + (
                ""
                if calm
                else f"; the torque of faster motion is late and may keep a hand swinging: {remedy}"
            ),
            0.0 if calm else SLOPE_SHARE * fast / follows,
            f"{s.where}.torque_rate_nm_s: axis {s.axis.name}: {slope:g} N m/s follows a coupling of "
            f"{k_c:.4g} N m/rad up to {follows:.3g} rad/s, the bound is {SLOPE_SHARE:g} "
            f"velocity_limit_rad_s = {SLOPE_SHARE * fast:.3g}: {remedy}"
            if refused
            else "",
        )
    ]


def count_is_no_jump(s: Subject) -> list[Verdict]:
    """A count that is further than the velocity limit allows in a period is a JUMP, and so is the next
    sample: on a quick loop any motion of a coarse encoder stops the rig."""
    from rtctl.control.sample import JUMP_FACTOR  # the names of a report must not load the compiler

    reach = JUMP_FACTOR * s.table.velocity_limit_rad_s * s.period_s
    ticks = s.axis.count_rad / reach  # as a count is seen: all of it in one tick
    # a count is within what a tick allows: none is taken for a jump
    if ticks <= 1.0:
        return []
    # two ticks: the second sample at the new place is what cuts (`sample.accept_sample`)
    most_hz = 2.0 * JUMP_FACTOR * s.table.velocity_limit_rad_s / s.axis.count_rad
    cuts = ticks > 2.0
    told = (
        f"{s.where}: axis {s.axis.name}: one encoder count is {s.axis.count_rad:.3g} rad, and in a tick the "
        f"joint may move by {reach:.3g} ({JUMP_FACTOR:g} velocity_limit_rad_s): each count counts as a jump"
        + (
            f", and the second sample of it cuts the torque; loop.rate_hz = {down(most_hz, 4)} at most"
            if cuts
            else ""
        )
    )
    return [
        s.row(
            "encoder count against a jump",
            f"{ticks:.3g} ticks",
            "<= 2",
            Outcome.FAIL if cuts else Outcome.WARN,
            f"one count over what the joint may move by in a tick, {JUMP_FACTOR:g} velocity_limit_rad_s",
            ticks / 2.0,
            told,
        )
    ]
