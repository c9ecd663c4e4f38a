"""Whatever happens in whatever order: the invariants of docs/safety.md hold in every tick (hypothesis,
stateful).
"""

import math

import numpy as np
from amounts import asked_often, some_of
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from watched_rig import CLOSED, LEASE, WatchedRig

from hw.jit import JIT_DISABLED
from rtctl.control.vocabulary import Environment, State

RIG = None
NUMBERS = st.sampled_from([0.0, 1e-3, -0.3, 2.0, 1e6, -1e9, math.nan, math.inf, -math.inf]) | st.floats(
    -1.0, 1.0
)
MEASURED = ("position_rad", "current_a", "force_n", "temperature_c")
DAMAGE = [
    ("params", "torque_limit_nm", math.nan),
    ("params", "torque_limit_nm", -1.0),
    ("params", "torque_limit_nm", math.inf),
    ("params", "torque_rate_nm", 0.0),
    ("params", "torque_rate_nm", math.nan),
    ("state", "torque_applied_nm", math.nan),
    ("state", "torque_applied_nm", 1e9),
]


def rig():
    global RIG
    RIG = RIG or WatchedRig()
    return RIG.begin_again()


class Machine(RuleBasedStateMachine):
    def __init__(self):
        super().__init__()
        self.rig = rig()

    @rule(n=st.integers(1, 150))
    def time_passes(self, n):
        self.rig.run(n)

    @rule()
    def somebody_arms_it(self):
        if self.rig.mode in CLOSED:
            self.rig.restart()
        for _ in range(40):
            if self.rig.mode is State.IDLE:
                self.rig.ask("arm_count")
            self.rig.run(20)
            if self.rig.mode is State.ACTIVE:
                break

    @rule(
        name=st.sampled_from(["arm_count", "stop_count", "reset_count", "tare_count"]),
        epoch=st.integers(-1, 1),
    )
    def a_request(self, name, epoch):
        self.rig.ask(name)
        self.rig.command["epoch"] += epoch
        self.rig.run()

    @rule()
    def the_process_is_ended(self):
        self.rig.ask("shutdown_count")
        self.rig.run(60)

    @rule(
        position=NUMBERS,
        lease=st.sampled_from([0, LEASE, 13]),
        epoch=st.integers(-1, 1),
        n=st.integers(1, 60),
    )
    def targets(self, position, lease, epoch, n):
        for _ in range(n):
            self.rig.target(position, lease, epoch)
            self.rig.run()

    @rule(kind=st.sampled_from(list(Environment)), stiffness=NUMBERS, center=NUMBERS, share=NUMBERS)
    def another_world(self, kind, stiffness, center, share):
        self.rig.world(kind, abs(stiffness), center)
        self.rig.command["compensation"] = share
        self.rig.run()

    @rule(name=st.sampled_from(MEASURED), value=NUMBERS, n=st.integers(1, 30))
    def a_sensor_lies(self, name, value, n):
        self.rig.run(n, **{name: value})

    @rule(by=st.floats(-2.0, 2.0), n=st.integers(1, 3))
    def the_position_jumps(self, by, n):
        for _ in range(n):
            self.rig.run(position_rad=self.rig["position_rad"] + by)

    @rule(bits=st.integers(0, 63), n=st.integers(1, 6))
    def the_link_reports(self, bits, n):
        self.rig.run(n, link_faults=bits & ~8)

    @rule(n=st.integers(1, 6))
    def samples_are_withheld(self, n):
        self.rig.run(n, fresh=False)

    @rule(slots=st.integers(1, 40), n=st.integers(1, 4))
    def the_loop_is_late(self, slots, n):
        self.rig.run(n, skipped=slots)

    @rule(n=st.integers(1, 30))
    def the_emergency_stop_is_pressed(self, n):
        self.rig.run(n, estop=1)
        assert self.rig["enabled"] == 0.0

    @rule(celsius=st.floats(20.0, 150.0), n=st.integers(1, 50))
    def it_gets_hot(self, celsius, n):
        self.rig.params["temperature_kind"] = 1
        self.rig.params["temperature_warn_c"], self.rig.params["temperature_trip_c"] = 70.0, 90.0
        self.rig.run(n, temperature_c=celsius)
        if celsius >= 90.0:
            assert self.rig.mode not in (State.ARMING, State.ACTIVE, State.HOLD)

    @rule(n=st.integers(1, 30))
    def the_device_hears_nothing(self, n):
        plant, params = self.rig.plant_state, self.rig.plant_params
        to_live = int(params["time_to_live_ticks"][0]) + int(params["torque_delay_ticks"][0, 0])
        for k in range(n):
            self.rig.run(heard=False)
            if k > to_live:
                assert not plant["motor_torque_nm"].any()

    @rule(damage=st.sampled_from(DAMAGE))
    def memory_is_damaged(self, damage):
        where, name, value = damage
        getattr(self.rig, where)[name] = value
        was_closed = self.rig.mode in CLOSED
        self.rig.step()
        assert self.rig["torque_applied_nm"] == 0.0
        assert self.rig["enabled"] == 0.0
        assert self.rig.mode in CLOSED
        assert was_closed or self.rig.mode is State.LOCKOUT or self.rig.command["shutdown_count"][0] > 0
        self.rig.restart()
        self.rig.run()
        assert self.rig.mode in (State.INIT, State.IDLE)

    @rule()
    def it_is_restarted(self):
        self.rig.restart()
        self.rig.run(40)
        assert self.rig["enabled"] == 0.0

    @rule()
    def the_cause_goes_and_somebody_resets(self):
        self.rig.run(1001)
        self.rig.ask("reset_count")
        self.rig.run(5)
        assert self.rig["enabled"] == 0.0 or self.rig.mode_before is not State.IDLE

    @invariant()
    def the_port_and_the_torque_are_numbers(self):
        assert np.isfinite(self.rig.tick["torque_applied_nm"]).all()


TestSafetyMachine = asked_often(Machine.TestCase)
TestSafetyMachine.settings = settings(
    max_examples=3 if JIT_DISABLED else some_of(80),
    stateful_step_count=30,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
