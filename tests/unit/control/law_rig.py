"""A rig around `law.step` for tests: nominal joint of docs/theory.md 1.3, one tick per call."""

import inspect
import math

import numpy as np

from rtctl.control import law
from rtctl.control.jit import compiled, plain, records
from rtctl.control.records import new_records
from rtctl.control.vocabulary import Environment, Fault, Policy, State
from rtctl.tick import new_ticks

T = 1e-3
J, B = 0.012, 0.05
COUNT = 2 * math.pi / 160_000
LEVER = 0.1
LEASE = 77

NOMINAL = {
    "inertia_kgm2": J,
    "viscous_nms_rad": B,
    "gear_ratio": 80.0,
    "gear_efficiency": 0.8,
    "torque_constant_nm_a": 0.02,
    "count_rad": COUNT,
    "position_min_rad": -100.0,
    "position_max_rad": 100.0,
    "force_limit_n": 50.0,
    "force_offset_limit_nm": 0.3,
    "current_gain_error": 0.3,
    "current_offset_nm": 0.3,
    "current_limit_a": 20.0,
    "torque_limit_nm": 3.0,
    "torque_continuous_nm": 3.0,
    "torque_rate_nm": 1.0,
    "arming_travel_rad": 0.1,
    "velocity_limit_rad_s": 10.0,
    "velocity_window_ticks": 16,
    "velocity_band_rad": COUNT,
    "velocity_alpha": 0.3,
    "force_alpha": 1.0,
    "tare_ticks": 10,
    "friction_policy": int(Policy.OFF),
    "friction_gain": 0.9,
    "friction_cap_nm": 0.9,
    "friction_ungated_cap_nm": 0.225,
    "friction_tanh_rad_s": 0.02,
    "friction_blend_rad_s": 0.05,
    "friction_deadband_rad_s": 0.01,
    "friction_dither_ticks": 12,
    "friction_intent_nm": 0.05,
    "rest_alpha": 1.0,
    "friction_intent_alpha": 1.0,  # no low-pass, and an account that does not bite: each policy by itself
    "assistance_bank_j": 1e3,
    "friction_gate_deadband_nm": 0.002,
    "friction_gate_nm": 0.03,
    "friction_brake_nm": 0.015,
    "tremble_turn_s": 1 / 16,
    "friction_gate_alpha": 0.1,
    "friction_stop_rad": 1e-3,
    "injected_damping_max_nms_rad": B,
    "hold_damping_nms_rad": 0.05,
}


def of_rows(function):
    """A function of records as one of arrays, of which it is given the first rows: many thousand calls in a
    moment.

    A record that is handed over alone describes all of its fields at each call: 100 us, where the function
    itself takes one.
    """
    parameters = inspect.signature(plain(function)).parameters
    given = ", ".join(f"{name}[0]" if of.annotation == "Record" else name for name, of in parameters.items())
    made = {"function": function}
    exec(f"def call({', '.join(parameters)}):\n    return function({given})", made)
    return compiled(made["call"])


class LawRig:
    """Records of a rig, and `tick()` to run the law once on given measurements."""

    def __init__(self, n_axes=1, **axis_params):
        made = new_records(n_axes)
        self.params, self.state, self.command, self.model = (records(array) for array in made)
        self.now = records(new_ticks(1, n_axes))
        for name, value in {
            "period_s": T,
            "ready_ticks": 20,
            "soft_start_ticks": 50,
            "stop_ticks": 50,
            "target_hold_ticks": 20,
            "target_stop_ticks": 100,
            "stale_limit_ticks": 3,
            "late_limit_ticks": 3,
            "waiver_share": 1.0,
            "arming_ticks": 3,
            "window_share": 0.008,
            "energy_budget_j": 0.02,
            "energy_bank_j": 0.02,
            "renderer_store_j": 0.1,
            "renderer_power_w": 1.0,
        }.items():
            self.params[name] = value
        self.params["lever_m"] = [0.0, LEVER, 0.0]
        for name, value in {**NOMINAL, **axis_params}.items():
            self.params[name] = value
        if "sure_viscous_nms_rad" not in axis_params:  # of a rigid joint
            self.params["sure_viscous_nms_rad"] = self.params["viscous_nms_rad"]
        self.position = np.zeros(n_axes)
        self.force_n = np.zeros(3)

    def tick(self, position=None, fresh=True, skipped=0, **measured):
        """Run one tick. `skipped` grid slots before it; other fields are written as given."""
        if position is not None:
            self.position = np.broadcast_to(np.asarray(position, dtype=float), self.position.shape)
        now = self.now
        now["tick"] += 1 + skipped
        now["missed_ticks"] += skipped
        now["sample_count"] += 1 if fresh else 0
        now["position_rad"] = self.position
        now["force_n"] = self.force_n
        now["current_a"] = 0.0
        now["link_faults"] = 0
        now["estop"] = 0
        for name, value in measured.items():
            now[name] = value
        law.step(now, self.state, self.params, self.command, self.model)
        return self

    def run(self, n, **measured):
        for _ in range(n):
            self.tick(**measured)
        return self

    def request(self, *names):
        """Raise request counters of the command. A target is one of the present epoch, by renderer
        `LEASE`.
        """
        for name in names:
            self.command[name] += 1
            if name == "target_count":
                self.command["target_epoch"] = self.state["epoch"]
                self.command["target_lease"] = LEASE

    def arm(self):
        """Bring the rig to ACTIVE with full authority at the present position."""
        self.run(40)
        self.command["epoch"] = self.state["epoch"]
        self.request("arm_count")
        self.run(4 * int(self.params["arming_ticks"][0]) + 2 + int(self.params["soft_start_ticks"][0]))
        for _ in range(2000):  # a stretched spring is paid for
            if self["authority"] == 1.0:
                break
            self.tick()
        assert self.mode is State.ACTIVE
        assert self["authority"] == 1.0
        return self

    def environment(self, kind, **values):
        self.command["environment_kind"] = int(Environment[kind.upper()])
        for name, value in values.items():
            self.command[name] = value
        return self

    def friction(self, stribeck=0.35, coulomb=0.25, viscous=B, speed=0.1, gain=1.0):
        """Give the rig a model: Gaussian Stribeck curve as cubics between 200 knots up to 4 rad/s."""
        v = np.linspace(0.0, 4.0, 201)
        f = gain * (coulomb + (stribeck - coulomb) * np.exp(-((v / speed) ** 2)) + viscous * v)
        self.model["n_segments"] = 200
        self.model["knot_rad_s"][..., :201] = v
        self.model["coefficient"][..., :200, 0] = f[:-1]
        self.model["coefficient"][..., :200, 1] = np.diff(f) / np.diff(v)
        self.model["lookup_scale"] = 1024 / 4.0
        self.model["lookup"] = np.minimum(np.arange(1024) * 200 // 1024, 199)
        self.model["speed_max_rad_s"] = 4.0
        self.model["speed_fade_rad_s"] = 0.5
        self.model["viscous_nms_rad"] = gain * viscous
        self.model["friction_min_nm"] = gain * coulomb
        self.params["friction_floor_nm"] = gain * coulomb
        self.command["compensation"] = 1.0
        return self

    def __getitem__(self, name):
        """Field of the present tick as a float (axis 0)."""
        return float(np.asarray(self.now[name]).reshape(1, -1)[0, 0])

    @property
    def mode(self):
        return State(int(self["state"]))

    @property
    def faults(self):
        return Fault(int(self["faults"]))


class Plant:
    """Inertia and viscous damping under held torque, integrated exactly; a hand may hold it."""

    def __init__(self, inertia=J, damping=B, velocity=0.0, position=0.0):
        self.x, self.v = position, velocity
        self.decay = math.exp(-damping * T / inertia)
        self.damping = damping
        self.inertia = inertia

    def advance(self, torque):
        final = torque / self.damping
        tau = self.inertia / self.damping
        self.x += final * T + (self.v - final) * tau * (1 - self.decay)
        self.v = final + (self.v - final) * self.decay
        return self.x
