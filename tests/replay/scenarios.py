"""Short runs of the simulated rig that together visit the law: what `make recordings` writes down."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hw.simulators.mock_options import VelocityOptions
from rtctl.control.vocabulary import Environment, Program
from rtctl.rig_file.config import Config, LoadedConfig, load
from rtctl.simulation.closed_loop import Simulation

CONFIGS = Path(__file__).parents[2] / "configs"


class Run:
    """A simulation that keeps its ticks and every command that was in force."""

    def __init__(self, loaded: LoadedConfig) -> None:
        self.loaded = loaded
        self.sim = Simulation(loaded)
        self._start()

    def _start(self) -> None:
        self.state = np.array(self.sim.state).copy()
        self.rows: list[np.ndarray] = []
        self.commands = [np.array(self.sim.command).copy()]

    def go(self, seconds: float, **fields: Any) -> np.ndarray:
        if fields:
            self.sim.change(**fields)
            self.commands.append(np.array(self.sim.command).copy())
        self.rows.append(np.array(self.sim.run(seconds)))
        return self.rows[-1][-1]

    def bump(self, seconds: float, name: str, **fields: Any) -> np.ndarray:
        """Raise a counter, in the present epoch."""
        count = int(np.max(self.sim.command[name])) + 1
        return self.go(seconds, **{name: count, "epoch": int(self.sim.state["epoch"][0])}, **fields)

    def armed(self) -> None:
        """Arm, and let the recording begin here: the law's state goes with it."""
        self.sim.arm()
        self._start()


@dataclass(frozen=True)
class Scenario:
    """One recording: rig file, changes to its tables, and what happens."""

    config: str
    happens: Callable[[Run], None]
    axis: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)

    def run(self) -> Run:
        loaded = load(CONFIGS / self.config)
        if self.axis:
            data = loaded.config.model_dump(mode="json", by_alias=True)
            for table, keys in self.axis.items():
                data["axis"][0][table].update(keys)
            loaded = loaded.model_copy(update={"config": Config.model_validate(data)})
        if self.options:
            loaded = loaded.model_copy(update={"options": {**loaded.options, **self.options}})
        made = Run(loaded)
        self.happens(made)
        return made


def from_power_up(run: Run) -> None:
    """INIT to ACTIVE, then a stop and its ramp."""
    run.go(0.45)
    for _ in range(40):
        if run.bump(0.025, "arm_count")["state"] == 3:
            break
    run.go(0.1)
    run.bump(0.1, "stop_count")


def swing(run: Run) -> None:
    """The hand swings the joint; compensation off, then on."""
    run.armed()
    run.go(0.2, compensation=0.0)
    run.go(0.4, compensation=1.0)


def environments(run: Run) -> None:
    """Every environment once."""
    run.armed()
    values = {
        "environment_stiffness_nm_rad": 8.0,
        "environment_damping_nms_rad": 0.02,
        "environment_pitch_rad": 0.1,
        "environment_side": 1,
    }
    for kind in (
        Environment.SPRING,
        Environment.WALL,
        Environment.DAMPER,
        Environment.DETENTS,
        Environment.FREE,
    ):
        run.go(0.12, environment_kind=kind, **values)


def renderer_falls_silent(run: Run) -> None:
    """Targets, then silence: HOLD, ramp, disabled."""
    run.armed()
    names = run.sim.command.dtype.names or ()
    lease = {name: 77 for name in ("lease", "target_lease") if name in names}
    run.bump(0.002, "target_count", environment_kind=Environment.REMOTE, **lease)
    start = float(run.sim.state["position_rad"][0, 0])
    for k in range(20):
        run.bump(0.005, "target_count", target_position_rad=start + 0.002 * k, target_velocity_rad_s=0.4)
    run.go(0.25)


def faults(run: Run) -> None:
    """Bad samples that are bridged, then a stale device: cut, and a reset that is not yet allowed."""
    run.sim.script(
        [
            {"channel": "link", "kind": "drop", "at_s": 3.0, "for_ticks": 1},
            {"channel": "link", "kind": "checksum", "at_s": 3.05, "for_ticks": 1},
            {"channel": "link", "kind": "drop", "at_s": 3.2, "for_ticks": 40},
        ]
    )
    run.armed()
    at_s = run.sim.time_s
    if at_s < 2.9:
        run.go(2.9 - at_s)
        run._start()
    run.go(0.4)
    run.bump(0.1, "reset_count")


def device_velocity(run: Run) -> None:
    """The feed-forward goes by a late, noisy tacho; then its wire is turned round: cut."""
    run.sim.script([{"channel": "velocity", "kind": "sign", "at_s": 3.2, "for_s": 1.0}])
    run.armed()
    at_s = run.sim.time_s
    if at_s < 2.9:
        run.go(2.9 - at_s)
        run._start()
    run.go(0.6)


def programs(run: Run) -> None:
    """Excitation: servo, then a ramp of torque."""
    run.armed()
    common = {
        "program_limit_ticks": 5000,
        "program_acceleration_rad_s2": 5.0,
        "program_stiffness_nm_rad": 20.0,
        "program_damping_nms_rad": 0.2,
        "program_alpha": 0.2,
        "program_torque_max_nm": 1.0,
        "program_min_rad": -10.0,
        "program_max_rad": 10.0,
        "program_hand_nm": 50.0,
    }
    run.bump(0.3, "program_count", program_kind=Program.SERVO, program_velocity_rad_s=0.3, **common)
    run.bump(0.1, "program_count", program_kind=Program.BRAKE)
    ramp = {"program_ramp_nm_s": 0.8, "program_fast_nm": 0.1, "program_slip_rad": 0.01}
    run.bump(0.25, "program_count", program_kind=Program.RAMP, **ramp)


def policy(name: str, **more: Any) -> Scenario:
    return Scenario("mock.toml", swing, {"friction": {"policy": name, **more}})


SCENARIOS: dict[str, Scenario] = {
    "from-power-up": Scenario("mock.toml", from_power_up),
    "swing-hybrid": Scenario("mock.toml", swing),
    **{
        f"swing-{name}": policy(name)
        for name in ("tanh", "deadband", "dither", "intent", "stop", "stop_gated")
    },
    "swing-kalman": Scenario(
        "mock.toml", swing, {"velocity": {"method": "kalman"}, "force": {"lowpass_hz": 200.0}}
    ),
    "swing-lowpass": Scenario("mock.toml", swing, {"velocity": {"method": "lowpass"}}),
    "two-axes": Scenario("mock-2axis.toml", swing),
    "environments": Scenario("mock.toml", environments),
    "renderer-falls-silent": Scenario("mock.toml", renderer_falls_silent),
    "faults": Scenario("mock.toml", faults),
    "device-velocity": Scenario(
        "mock.toml",
        device_velocity,
        {"velocity": {"device": "use", "device_tolerance_rad_s": 0.3}},
        {"velocity": VelocityOptions(lag_s=2e-3, noise_rad_s=0.01).model_dump()},
    ),
    "programs": Scenario("mock-identify.toml", programs),
}
