"""Seeded bugs of the state machine: intake of requests and targets, transitions, fault table."""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/control"
STATES = (f"{UNIT}/test_states.py",)
SEQUENCES = (f"{UNIT}/test_state_sequences.py", f"{UNIT}/test_renderer_sequences.py")
DETECTORS = (f"{UNIT}/test_detectors.py",)
ARMING = (f"{UNIT}/test_arming.py",)
SAMPLE = (f"{UNIT}/test_sample.py",)

SEEDS = (
    Seed(
        "an arm request of an older epoch counts", "rtctl/control/intake.py",
        "return requests, c.epoch == s.epoch", "return requests, True", SEQUENCES,
    ),
    Seed(
        "anybody's target moves the proxy", "rtctl/control/intake.py",
        "if s.lease != 0 and s.lease != c.target_lease:", "if c.target_lease == 0:", SEQUENCES,
    ),
    Seed(
        "a target of an older epoch counts", "rtctl/control/intake.py",
        "if c.target_epoch != s.epoch or c.target_lease == 0:", "if c.target_lease == 0:", SEQUENCES,
    ),
    Seed(
        "a target's velocity may be NaN", "rtctl/control/intake.py",
        "if not (math.isfinite(c.target_position_rad[axis]) and "
        "math.isfinite(c.target_velocity_rad_s[axis])):",
        "if not math.isfinite(c.target_position_rad[axis]):", SEQUENCES,
    ),
    Seed(
        "the slot's old target counts as fresh in every tick", "rtctl/control/intake.py",
        "risen = c.target_count > s.target_seen", "risen = c.target_count > 0", SEQUENCES,
    ),
    Seed(
        "a silent renderer is followed five times longer", "rtctl/control/intake.py",
        "return _is_remote(c) and _silence(s) > p.target_hold_ticks",
        "return _is_remote(c) and _silence(s) > 5 * p.target_hold_ticks", SEQUENCES,
    ),
    Seed(
        "a renderer is silent before there is anything to move", "rtctl/control/intake.py",
        "return int(min(s.target_age_ticks, s.remote_ticks))", "return int(s.target_age_ticks)", SEQUENCES,
    ),
    Seed(
        "the rig locks out one fault too late", "rtctl/control/states.py",
        "s.fault_total >= LOCKOUT_FAULTS and", "s.fault_total > LOCKOUT_FAULTS and", SEQUENCES,
    ),
    Seed(
        "a later cause replaces the first one", "rtctl/control/states.py",
        "    if s.fault_first < 0:\n", "    if faults:\n", SEQUENCES,
    ),
    Seed(
        "a reset is accepted while the cause is fresh", "rtctl/control/states.py",
        "may_reset = (s.clear_ticks + 0.5) * p.period_s >= CLEAR_S or s.state == _ESTOP", "may_reset = True",
        SEQUENCES,
    ),
    Seed(
        "a stop does not begin a new epoch", "rtctl/control/states.py",
        "        s.epoch += 1\n        s.lease = 0\n        _latch", "        s.lease = 0\n        _latch",
        SEQUENCES,
    ),
    Seed(
        "the lease outlives a stop", "rtctl/control/states.py",
        "        s.epoch += 1\n        s.lease = 0\n        _latch", "        s.epoch += 1\n        _latch",
        SEQUENCES,
    ),
    Seed(
        "a stop at rest voids nothing", "rtctl/control/states.py",
        "if requests & STOP and not is_powered(s.state):", "if False:", SEQUENCES,
    ),
    Seed(
        "a cut during a ramp is ignored", "rtctl/control/states.py",
        "Transition(_POWERED, Event.CUT,", "Transition(_MOVING, Event.CUT,", STATES,
    ),
    Seed(
        "a stop in HOLD is ignored", "rtctl/control/states.py",
        "Transition(_MOVING, Event.STOP,", "Transition((_S.ARMING, _S.ACTIVE), Event.STOP,", STATES,
    ),
    Seed(
        "a renderer that comes back starts with full authority", "rtctl/control/states.py",
        "if state in (_ARMING, _ACTIVE):", "if state == _ARMING:", SEQUENCES,
    ),
    Seed(
        "a rig arms before it was good for long enough", "rtctl/control/states.py",
        "ready = s.good_ticks >= p.ready_ticks and not faults", "ready = not faults", SEQUENCES,
    ),
    Seed(
        "a jump ramps instead of cutting", "rtctl/control/faults.py",
        "Fault.JUMP,\n        Reaction.CUT,", "Fault.JUMP,\n        Reaction.RAMP,", SAMPLE,
    ),
    Seed(
        "heat only keeps a rig from arming", "rtctl/control/faults.py",
        "Fault.OVERTEMPERATURE,\n        Reaction.RAMP,", "Fault.OVERTEMPERATURE,\n        Reaction.REFUSE,",
        DETECTORS,
    ),
)  # fmt: skip
