"""Small identifications for tests: few points, the simulated rig, a store in memory."""

from pathlib import Path

from shipped_friction import law_nm

from rtctl.experiments.simulated_identification import drive
from rtctl.identify.measurement_order import Known
from rtctl.identify.session import identify
from rtctl.identify.settings import Settings, rig_of, without_feedforward
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

CONFIG = Path(__file__).parents[3] / "configs" / "mock-identify.toml"
SMALL = Settings(
    train_levels=4,
    test_levels=2,
    measurements=12,
    spots=4,
    warm_up_s=2.0,
    speed_min_rad_s=0.02,
    lower_levels=0,
)


def variant(folder, *replacements, source=CONFIG):
    """The rig file with pieces of its text replaced, in `folder`."""
    text = source.read_text()
    for old, new in replacements:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = folder / "rig.toml"
    path.write_text(text)
    return path


def true_friction_nm(velocity_rad_s, direction):
    """Static friction of the mock of the rig file, averaged over a turn, signed."""
    return direction * law_nm(abs(velocity_rad_s), direction)


class Kept:
    """A store in memory that also follows what the joint did."""

    def __init__(self, present=()):
        self.points, self.measurements, self.sessions, self.warm_ups = [], [], [], 0
        self.present, self.skipped = set(present), []

    def has(self, task):
        return task.name in self.present

    def begin(self, bias):
        self.sessions.append(bias)

    def warmed_up(self):
        self.warm_ups += 1

    def ticks(self, rows):
        pass

    def skip(self, task, why):
        self.skipped.append((task, why))

    def known(self):
        return [
            Known(one.direction, abs(one.target_rad_s), abs(one.friction_torque_nm), one.presliding_rad)
            for one in self.points
        ]

    def add(self, point, measurements):
        self.points.append(point)
        self.measurements.append(measurements)
        self.present.add(point.name)


def run(path=CONFIG, settings=SMALL, store=None, watch=None):
    """Identify the simulated rig of `path`. `watch(rows)` sees every tick."""
    loaded = without_feedforward(load(path))
    rig = rig_of(loaded, settings)
    store = store or Kept()
    simulation = Simulation(loaded)
    notices = []
    steps = identify(rig, settings, store, lambda *_: None, notices.append)
    drive(simulation, steps if watch is None else _watched(steps, watch), rig.axis, store.ticks)
    store.notices, store.simulation = notices, simulation
    return store


def _watched(steps, watch):
    order = next(steps)
    while True:
        rows = yield order
        watch(rows)
        try:
            order = steps.send(rows)
        except StopIteration:
            return
