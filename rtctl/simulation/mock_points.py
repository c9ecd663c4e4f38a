"""Measures friction points on the simulated rig as a laboratory would: from its sensors alone.

    python -m rtctl.simulation.mock_points OUT.csv [RIG.toml]

The hand is off. With the motor off the bias of the Hall sensor is read. Then, for each direction: after a
warm-up, the current is ramped open loop until the joint moves (break-away, the point at zero speed), and
a speed servo turns the joint at 54 speeds, where motor torque equals friction. Every point is the mean
of 100 measurements. Nothing here reads the plant's state or its friction law."""

from __future__ import annotations

import csv
import math
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from hw.jit import compiled, records
from hw.simulators.mock_plant import plant_read, plant_write
from hw.simulators.mock_records import plant_records
from rtctl.errors import DataError
from rtctl.friction.presliding import Presliding, Ramp, presliding, ramp_of
from rtctl.rig_file.config import LoadedConfig, load
from rtctl.simulation.shipped_files import shipped_config
from rtctl.tick import new_ticks

LEVELS = 54
SPEED_MIN_RAD_S, SPEED_MAX_RAD_S = 0.005, 2.0
MEASUREMENTS = 100
WINDOW_S = 0.1
"""Time over which one measurement averages the current: 12 encoder counts at the lowest speed."""
SETTLE_S, SETTLE_RAD = 0.3, 0.008
"""Both must pass before a measurement: dry friction settles over a distance, several bristle deflections."""
SETTLE_LENGTHS = 5.0
"""Presliding lengths that must pass, too, where they are known: e^-5 of the friction is left out."""
JOG_RAD_S = 0.5
ACCELERATION_RAD_S2 = 10.0
RAMP_NM_S = 0.05
MOVING_COUNTS = 8
"""Counts within 10 ms that mean the joint moves: .031 rad/s. At speed v the bristle, and the torque seen, is
still short of break-away by ramp / (sigma0 v): .6 % here; a quicker ramp or a lower speed reads low."""
PAUSE_S = 0.2
BIAS_S = 5.0
REST_COUNTS, REST_MOST_S = 4, 5.0
_LOOKS = 8
RAMP_MAX_S = 60.0
STIFFNESS_NM_RAD, DAMPING_NMS_RAD = 150.0, 3.0
"""Speed servo. Its damping must exceed the worst Stribeck slope (.81 N m s/rad), or it stick-slips."""
SPEED_FILTER_S = 0.8e-3


@dataclass(frozen=True)
class Point:
    """One friction point. Torque has the sign of the motion it opposes: both are below 0 in reverse.

    The last four are the columns of `learn.point_evidence`; None where there is nothing to say."""

    velocity_rad_s: float
    friction_torque_nm: float
    std_nm: float
    count: int
    direction: int
    weakest_place_nm: float | None = None
    presliding_rad: float | None = None
    presliding_spread_rad: float | None = None
    presliding_ramps: int | None = None


class Rig:
    """Axis 0 of the simulated rig of a rig file, reachable through ticks only."""

    def __init__(self, loaded: LoadedConfig) -> None:
        hardware = loaded.config.hardware()
        options = {**loaded.options, "hand": [{**hand, "kind": "none"} for hand in loaded.options["hand"]]}
        params, state = plant_records(options, hardware)
        self.plant = records(params), records(state)
        self.tick = records(new_ticks(1, hardware.n_axes))
        self.tick["enabled"] = 1  # a plant that is not enabled has no torque
        self.period_s = hardware.period_s
        self.torque_per_ampere = float(
            hardware.gear_ratio[0] * hardware.gear_efficiency[0] * hardware.torque_constant_nm_a[0]
        )
        self.count_rad = 2 * math.pi / float(hardware.encoder_counts_per_rev[0])
        self.bias_a = 0.0  # measured first of all
        self.settle_rad = SETTLE_RAD

    def ticks(self, seconds: float) -> int:
        """Whole control periods in `seconds`, at least one."""
        return max(1, round(seconds / self.period_s))


@compiled
def _cycle(tick: np.ndarray, state: np.ndarray, params: np.ndarray, current_a: float) -> None:
    """Read, send `current_a` to axis 0, let one period pass."""
    plant_read(tick, state, params)
    tick[0].current_command_a[0] = current_a
    plant_write(tick, state, params)
    tick[0].tick += 1


@compiled
def _rest(tick: np.ndarray, state: np.ndarray, params: np.ndarray, n_ticks: int) -> float:
    """Motor off for `n_ticks`; returns the mean current seen, A."""
    total = 0.0
    for _ in range(n_ticks):
        _cycle(tick, state, params, 0.0)
        total += tick[0].current_a[0]
    return total / n_ticks


@compiled
def _turn(
    tick: np.ndarray,
    state: np.ndarray,
    params: np.ndarray,
    torque_per_ampere: float,
    servo: np.ndarray,
    velocities: np.ndarray,
    lengths: np.ndarray,
    means_a: np.ndarray,
) -> None:
    """Turn through the phases `velocities` (rad/s) of `lengths` (ticks); mean current of each, A.

    Notes
    -----
    torque = k (x_wanted - x) + d (v_wanted - v), v: low-passed difference. The wanted speed changes with
    bounded acceleration, so the joint never swings back. `servo`: x_wanted, v_wanted, x before, v; it
    carries over to the next call."""
    period = params[0].period_s
    share = period / (period + SPEED_FILTER_S)  # of a low-pass, per tick
    for phase in range(len(velocities)):
        total = 0.0
        for _ in range(lengths[phase]):
            plant_read(tick, state, params)
            x = tick[0].position_rad[0]
            total += tick[0].current_a[0]
            servo[3] += share * ((x - servo[2]) / period - servo[3])
            servo[2] = x  # for the next difference
            change = velocities[phase] - servo[1]
            servo[1] += math.copysign(min(abs(change), ACCELERATION_RAD_S2 * period), change)
            servo[0] += servo[1] * period
            torque = STIFFNESS_NM_RAD * (servo[0] - x) + DAMPING_NMS_RAD * (servo[1] - servo[3])
            tick[0].current_command_a[0] = torque / torque_per_ampere
            plant_write(tick, state, params)
            tick[0].tick += 1
        means_a[phase] = total / lengths[phase]


@compiled
def _break_away(
    tick: np.ndarray,
    state: np.ndarray,
    params: np.ndarray,
    step_a: float,
    moving_rad: float,
    look_back: int,
    positions_rad: np.ndarray,
    currents_a: np.ndarray,
) -> int:
    """Ramp the current by `step_a` a tick until the joint moves; the tick where motion began, or -1.

    Fills `positions_rad` and `currents_a`, whose length is the most ticks it takes."""
    for k in range(len(positions_rad)):
        _cycle(tick, state, params, step_a * k)
        positions_rad[k] = tick[0].position_rad[0]
        currents_a[k] = tick[0].current_a[0]
        # the bend of the bristles is no motion
        if k > 2 * look_back and abs(positions_rad[k] - positions_rad[k - look_back]) >= moving_rad:
            return k - look_back
    return -1


def _come_to_rest(rig: Rig) -> None:
    """Motor off until the joint has stayed within `REST_COUNTS` for `PAUSE_S`: soft bristles swing on."""
    params, state = rig.plant
    for _ in range(round(REST_MOST_S / PAUSE_S)):
        seen = []  # several looks: one may fall on a turn
        for _ in range(_LOOKS):
            _rest(rig.tick, state, params, rig.ticks(PAUSE_S / _LOOKS))
            seen.append(float(rig.tick["position_rad"][0, 0]))
        if max(seen) - min(seen) <= REST_COUNTS * rig.count_rad:
            return


def _point(
    samples_nm: np.ndarray, velocity_rad_s: float, direction: int, bent: Presliding | None = None
) -> Point:
    return Point(
        velocity_rad_s,
        float(samples_nm.mean()),
        float(samples_nm.std(ddof=1)),
        len(samples_nm),
        direction,
        float(direction * np.min(direction * samples_nm)),  # each was measured at a place of its own
        bent.length_rad if bent else None,
        bent.spread_rad if bent else None,
        bent.ramps if bent else None,
    )


def _break_away_point(rig: Rig, direction: int, measurements: int) -> Point:
    params, state = rig.plant
    # the ramp is of torque, and open loop: a servo would move the joint before it breaks away
    step_a = direction * RAMP_NM_S * rig.period_s / rig.torque_per_ampere
    samples = np.empty(measurements)
    positions_rad, currents_a = np.empty((2, rig.ticks(RAMP_MAX_S)))
    # the 10 ms of `MOVING_COUNTS`
    look_back, ramps = rig.ticks(0.01), list[Ramp | None]()
    for k in range(measurements):
        turn_through(rig, [(direction * JOG_RAD_S, 2 * math.pi / measurements / JOG_RAD_S), (0.0, PAUSE_S)])
        _come_to_rest(rig)
        moving_rad = MOVING_COUNTS * rig.count_rad
        began = _break_away(rig.tick, state, params, step_a, moving_rad, look_back, positions_rad, currents_a)
        if began < 0:  # a point of NaN would be learned from, or refused by a fit that does not know why
            most = f"{RAMP_NM_S * RAMP_MAX_S:g} N m, the most that is tried"
            raise DataError(f"the joint did not break away at {most}: measure it with rtctl identify")
        torque = (currents_a[: began + 1] - rig.bias_a) * rig.torque_per_ampere
        # averaged over the look-back, ending where the motion began, against the sensor's noise
        samples[k] = float(np.mean(torque[-look_back:]))
        ramps.append(ramp_of(positions_rad[: began + 1], torque, samples[k], rig.count_rad, rig.period_s))
    return _point(samples, 0.0, direction, presliding([ramp for ramp in ramps if ramp]))


def turn_through(rig: Rig, phases: list[tuple[float, float]]) -> np.ndarray:
    """Turn through `phases` of (velocity rad/s, seconds) from rest; returns each one's mean current, A."""
    params, state = rig.plant
    position_rad = float(rig.tick["position_rad"][0, 0])
    servo = np.array([position_rad, 0.0, position_rad, 0.0])  # from rest, where it is
    velocities = np.array([velocity for velocity, _ in phases])
    lengths = np.array([rig.ticks(seconds) for _, seconds in phases])
    means_a = np.zeros(len(phases))  # filled in place
    _turn(rig.tick, state, params, rig.torque_per_ampere, servo, velocities, lengths, means_a)
    return means_a


def rested_a(rig: Rig) -> float:
    """What the current sensor reads with the motor off, A."""
    params, state = rig.plant
    return float(_rest(rig.tick, state, params, rig.ticks(BIAS_S)))


def constant_velocity_point(rig: Rig, velocity_rad_s: float, measurements: int) -> Point:
    """Measure at one speed; slow runs jog on between measurements, so that all see the whole turn."""
    # never slower than the run itself
    jog = math.copysign(max(JOG_RAD_S, abs(velocity_rad_s)), velocity_rad_s)
    jog_s = 2 * math.pi / measurements / abs(jog)  # a share of a turn: all of them make one
    settle_s = SETTLE_S + rig.settle_rad / abs(velocity_rad_s)  # a way takes its time at low speed
    cycle = [(jog, jog_s), (velocity_rad_s, settle_s), (velocity_rad_s, WINDOW_S)]
    means_a = turn_through(rig, [(velocity_rad_s, SETTLE_S), *(cycle * measurements)])[3::3]
    samples_nm = (means_a - rig.bias_a) * rig.torque_per_ampere
    return _point(samples_nm, velocity_rad_s, int(math.copysign(1, velocity_rad_s)))


def measure(loaded: LoadedConfig, levels: int = LEVELS, measurements: int = MEASUREMENTS) -> list[Point]:
    """Measure both directions of axis 0 of the simulated rig of `loaded`.

    Returns `2 (levels + 1)` points: per direction break-away at zero speed, then rising speed. Raises
    DataError for a joint that does not break away."""
    rig = Rig(loaded)
    rig.bias_a = rested_a(rig)
    points = []
    for direction in (1, -1):
        constant_velocity_point(rig, 0.5 * direction, 10)  # warm-up
        points.append(_break_away_point(rig, direction, measurements))  # first: it tells how long to settle
        rig.settle_rad = max(rig.settle_rad, SETTLE_LENGTHS * (points[-1].presliding_rad or 0.0))
        speeds = np.geomspace(SPEED_MIN_RAD_S, SPEED_MAX_RAD_S, levels)  # dense where friction bends
        points += [constant_velocity_point(rig, direction * float(speed), measurements) for speed in speeds]
    return points


def write_csv(points: list[Point], path: Path) -> None:
    """Write `points` with a header that names each column with its unit."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Point.__dataclass_fields__)
        for point in points:
            writer.writerow([_cell(name, value) for name, value in asdict(point).items()])


def _cell(column: str, value: float | None) -> str:
    if value is None:  # an empty cell: nothing was measured
        return ""
    if column == "velocity_rad_s":
        return f"{value:.9g}"
    return str(value) if isinstance(value, int) else f"{value:.7f}"


def main(arguments: list[str]) -> None:
    """Entry point of `python -m rtctl.simulation.mock_points OUT.csv [RIG.toml]`."""
    if len(arguments) not in (1, 2):
        sys.exit("usage: python -m rtctl.simulation.mock_points OUT.csv [RIG.toml]")
    loaded = load(arguments[1] if len(arguments) == 2 else shipped_config("mock.toml"))
    write_csv(measure(loaded), Path(arguments[0]))


if __name__ == "__main__":
    main(sys.argv[1:])
