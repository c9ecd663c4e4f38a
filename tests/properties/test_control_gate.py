import math

from hypothesis import example, given, settings
from hypothesis import strategies as st

from rtctl.control.gate import gate_torque
from rtctl.control.vocabulary import GateFlag

anything = st.floats(allow_nan=True, allow_infinity=True)
CUT = GateFlag.DISABLED | GateFlag.NOT_FINITE | GateFlag.OVERSPEED | GateFlag.VIOLATION


@settings(max_examples=1000, deadline=None)
@given(
    wanted=anything | st.floats(-10, 10),
    previous=anything | st.floats(-3, 3),
    velocity=anything | st.floats(-20, 20),
    limit=anything | st.floats(1e-3, 5),
    allowed=anything | st.floats(0, 5),
    rate=anything | st.floats(1e-3, 1),
    v_limit=anything | st.just(10.0),
    enabled=st.booleans(),
)
@example(
    wanted=3.0, previous=0.0, velocity=0.0, limit=2.0, allowed=2.0, rate=0.1, v_limit=math.nan, enabled=True
)
@example(
    wanted=1.0, previous=1e300, velocity=0.0, limit=2.0, allowed=2.0, rate=0.1, v_limit=10.0, enabled=True
)
def test_whatever_goes_in_the_torque_is_finite_limited_and_slow(
    wanted, previous, velocity, limit, allowed, rate, v_limit, enabled
):
    torque, bits = gate_torque(wanted, previous, velocity, limit, allowed, rate, v_limit, enabled)
    flags = GateFlag(int(bits))
    assert math.isfinite(torque)
    assert abs(torque) <= (limit if limit > 0 else 0.0)
    if not enabled:
        assert torque == 0.0
        assert flags in (GateFlag.DISABLED, GateFlag.VIOLATION)
    ceiling = max(allowed if allowed > 0 else 0.0, abs(previous) - rate)
    if torque != 0.0:
        assert abs(torque) <= ceiling * (1 + 1e-12)
    if torque != 0.0:
        assert math.copysign(1.0, torque) in (math.copysign(1.0, wanted), math.copysign(1.0, previous))
        assert not flags & CUT
        assert abs(velocity) <= v_limit or torque * velocity <= 0.0
    if not math.isfinite(wanted) or not math.isfinite(velocity):
        assert torque == 0.0
    sound = limit > 0.0 and rate > 0.0 and math.isfinite(limit) and math.isfinite(rate)
    if sound and math.isfinite(previous) and abs(previous) <= limit and not flags & CUT:
        assert abs(torque - previous) <= rate * (1 + 1e-12) + 1e-12 * abs(previous)
    if sound and flags == GateFlag(0):
        assert torque == wanted


@given(st.floats(-2, 2), st.floats(-20, 20))
def test_inside_all_limits_nothing_is_changed_and_every_intervention_is_flagged(wanted, velocity):
    torque, flags = gate_torque(wanted, 0.0, velocity, 1.0, 1.0, 0.5, 10.0, True)
    assert (flags == 0) == (torque == wanted)
