"""Point-to-point and tracking on the real loop: the law's TRACK program, a session per friction model.

Nobody holds the handle: as in an identification, the law ends a motion when it feels a hand, leaves the
travel, or falls behind its reference. Between cases the joint goes back to where it began and rests. What was
measured before an error or Ctrl-C is kept (`kept_runs`): a person starts it again and it goes on."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rtctl.control.vocabulary import Program, ProgramFlag
from rtctl.errors import ConfigError, DataError
from rtctl.experiments import kept_runs, models
from rtctl.experiments.kept_runs import KeptRuns, Runs
from rtctl.experiments.models import Compared
from rtctl.experiments.order import Order
from rtctl.experiments.position_gains import gains_of
from rtctl.experiments.positioning import CONTROLLERS, Case, Experiment, Followed, Found, Judge
from rtctl.experiments.report import Outcome
from rtctl.host.supervisor import Host
from rtctl.identify.bias import read_bias
from rtctl.identify.motion import HandSeen, Motion, Steps
from rtctl.identify.motion import Order as Wish
from rtctl.identify.observer import Identifier
from rtctl.identify.session import arm
from rtctl.identify.settings import Rig, Settings, rig_of, without_feedforward
from rtctl.rig_file.config import LoadedConfig
from rtctl.rounded import up

BIAS_S = 1.0
HOME_RAD = 0.01
"""Nearer than this the joint is where it began."""
BEHIND_RAD = 0.25
"""Distance from the reference, beyond the step itself, that ends a motion."""
CHATTER_SHARE = 0.05
"""One encoder count may move the controller's torque by this share of the torque limit."""

MOST_PAUSES = 3
"""Times a case is begun again because of a hand or lost ticks."""


@dataclass
class Session:
    """Every controller and case with one friction model, without those in `done`; `runs` fills."""

    order: Order
    rig: Rig
    cases: Sequence[Case]
    model: Compared
    share: tuple[float, float]
    done: Collection[kept_runs.Key] = ()
    runs: Runs = field(default_factory=dict)

    @property
    def todo(self) -> list[tuple[str, Case]]:
        """What is still to be measured."""
        return [
            (controller, case)
            for controller in CONTROLLERS
            for case in self.cases
            if (controller, case.name, self.model.name) not in self.done
        ]

    def steps(self) -> Steps[None]:
        """The procedure, for a simulation or the loop. Raises DataError, FaultError, HandOnRigError."""
        motion = Motion(self.rig, settings_of(self.order.loaded), self.order.announce)
        yield from read_bias(motion)
        yield from arm(motion)
        motion.choose_travel()
        home_rad = _home(motion, self.cases)  # one place for all: friction differs over a turn
        todo = self.todo
        for at, (controller, case) in enumerate(todo):
            low, high = self.share
            self.order.progress(
                low + (high - low) * at / len(todo), f"{self.model.name}: {controller}, {case.name}"
            )
            key = controller, case.name, self.model.name
            self.runs[key] = yield from self._measured(motion, controller, case, home_rad)  # complete
        yield from motion.rest()

    def _measured(self, motion: Motion, controller: str, case: Case, home_rad: float) -> Steps[Followed]:
        """One case, begun again while a hand disturbs it or ticks of it are lost."""
        for pause in range(MOST_PAUSES + 1):
            try:
                yield from _go(motion, home_rad)
                found = yield from self._follow(motion, controller, case)
            except HandSeen:
                # the last one ends it: `PAUSES` are used up
                yield from motion.wait_for_free_rig(10 * (pause == MOST_PAUSES))
                continue
            if found is not None:  # else it is measured again
                return found
            self.order.announce(
                f"{controller}, {case.name}: ticks were lost on their way; it is measured again"
            )
        raise DataError(
            f"{controller}, {case.name}, {self.model.name}: ticks were lost between the loop and this "
            f"process {MOST_PAUSES + 1} times; take other load off this machine (rtctl doctor) and go on "
            "with --resume"
        )

    def _follow(self, motion: Motion, controller: str, case: Case) -> Steps[Followed | None]:
        """One run; None where ticks of it never came: another time's reference would be compared."""
        seconds = len(case.reference) * self.rig.period_s
        wish = motion.order(Program.TRACK, seconds, **fields_of(self.order, controller, case, self.model))
        rows = yield from motion.watch(seconds, Wish(wish, seconds))
        axis = self.rig.axis
        flags = ProgramFlag(int(np.bitwise_or.reduce(rows["program_flags"][:, axis])))
        rows = rows[rows["program_kind"][:, axis] == Program.TRACK]
        if flags & ~ProgramFlag.DONE or len(rows) == 0:
            raise DataError(
                f"{controller}, {case.name}, {self.model.name}: the loop ended the motion "
                f"({(flags & ~ProgramFlag.DONE)!r}) after {len(rows)} of {len(case.reference)} ticks; free "
                "the joint, or correct inertia, limits or travel in the rig file"
            )
        if len(rows) < len(case.reference):
            return None
        place = rows["position_rad"][:, axis]  # of the encoder
        return Followed(place - place[0], rows["torque_applied_nm"][:, axis].copy(), case.reference)


def settings_of(loaded: LoadedConfig) -> Settings:
    """Settings of the moves between cases."""
    most = min(2.0, 0.8 * loaded.config.axis[0].velocity_limit_rad_s)  # as an identification moves
    return Settings(bias_s=BIAS_S, speed_max_rad_s=most, speed_min_rad_s=min(0.005, most / 2))


def fields_of(order: Order, controller: str, case: Case, model: Compared) -> dict[str, float]:
    """What the TRACK program is told, without `program_`."""
    g = gains_of(order, controller)[0]
    return {
        "stiffness_nm_rad": g["kp_nm_rad"],
        "damping_nms_rad": g["kd_nms_rad"],
        "integral_nm_rad_s": g["ki_nm_rad_s"],
        "inertia_kgm2": g["inertia_kgm2"],
        "alpha": g["alpha"],
        "friction_gain": 0.0 if model.name == "none" else g["friction_gain"],  # its record is empty
        "error_rad": g["error_rad"],
        "shape": int(case.shape),
        "amplitude_rad": case.amplitude_rad,
        "rate": case.rate,
        "slip_rad": BEHIND_RAD + abs(case.amplitude_rad),  # a step begins all its amplitude behind
    }


def require(order: Order, cases: Sequence[Case]) -> Rig:
    """The rig's axis, if it can do all cases. Raises ConfigError naming what is missing."""
    loaded = order.loaded
    axis, path = loaded.config.axis[0], loaded.path
    if axis.motion == "linear":
        raise ConfigError(
            f"{path}: axis {axis.name} is linear, and the references of this experiment are angles: give it "
            "a rig whose axis 0 turns"
        )
    g = gains_of(order, "PD")[0]  # of both controllers: PID differs in the integral
    # k_d alpha Delta/T: what one count makes of the torque at once
    grain_nm = g["kd_nms_rad"] * g["alpha"] * 2 * np.pi / axis.counts_of_turn / loaded.config.period_s
    if grain_nm > CHATTER_SHARE * axis.torque_limit_nm:
        raise ConfigError(
            f"{path}: axis[0].encoder_counts_per_rev {axis.encoder_counts_per_rev:g}: one count would move "
            f"the controller's torque by {grain_nm:.2g} N m, more than {100 * CHATTER_SHARE:g} % of "
            "torque_limit_nm; this experiment needs a finer encoder"
        )
    fastest = max(float(np.abs(case.reference[:, 1]).max()) for case in cases)
    if fastest > 0.8 * axis.velocity_limit_rad_s:
        raise ConfigError(
            f"{path}: axis[0].velocity_limit_rad_s {axis.velocity_limit_rad_s:g}: the references move at up "
            f"to {up(fastest)} rad/s, which needs a limit of 1.25 times that; raise it if the rig bears it"
        )
    settings = settings_of(loaded)
    needed = max(high - low for low, high in (case.range_rad for case in cases)) + 4 * settings.margin_rad
    if axis.position_max_rad - axis.position_min_rad < needed:
        raise ConfigError(
            f"{path}: axis[0].position_min_rad to position_max_rad: the references travel {up(needed)} rad"
        )
    return rig_of(loaded, settings)


def run_all(order: Order, cases: Sequence[Case], judge: Judge, kept: KeptRuns) -> Found:
    """Every model of `kept` in a session of its own on the loop, but for the runs kept already.

    Raises
    ------
    DataError, FaultError, HandOnRigError, KeyboardInterrupt
        As `Session.steps`, or Ctrl-C; what was complete is in `kept`."""
    rig, bare = require(order, cases), without_feedforward(order.loaded)
    if "force" in order.loaded.config.rig.absent:
        order.announce(
            "this rig has no force sensor: nothing but its limits ends a motion when a hand is in the way"
        )
    for at, model in enumerate(kept.models):
        share = 0.1 + 0.9 * at / len(kept.models), 0.1 + 0.9 * (at + 1) / len(kept.models)
        session = Session(order, rig, cases, model, share, kept.runs.keys())
        if session.todo:  # a session arms the rig: not for nothing
            _hold(order, bare, session, kept)
    return found_of(cases, kept.models, kept.runs, judge)


def _hold(order: Order, bare: LoadedConfig, session: Session, kept: KeptRuns) -> None:
    """One session of the daemon; whatever ends it, its runs are kept."""
    watcher = Identifier(session.steps(), session.rig.axis)
    try:
        with Host(
            bare,
            observers=[watcher],
            runtime_dir=order.runtime_dir,
            announce=order.announce,
            model=session.model.record,
        ) as host:
            host.run()
    finally:
        if session.runs:  # after a fault, too
            kept.add(session.runs)
        if not watcher.complete and kept.runs:
            order.announce(f"{len(kept.runs)} runs are kept in {kept.path}: go on with --resume")
    if not watcher.complete:
        raise KeyboardInterrupt  # Ctrl-C was the loop's: the caller must not go on to the next model


def reported(order: Order, experiment: Experiment) -> Outcome:
    """Run on the loop, and the page of it, with every angle and torque measured beside it."""
    cases = experiment.chosen(order)  # a misspelled one costs no time
    require(order, cases)  # before models are learned, which takes minutes
    kept = KeptRuns(order.out, belonging(order, experiment.name), resume=order.resume)
    if not kept.models:
        kept.models = models.compared(order)  # else those of the start before, whatever changed
    compared = kept.models
    if order.resume and kept.runs.keys() >= set(keys_of(cases, compared)):
        order.announce("nothing is left to do: every run is kept, and reported again")
    found = run_all(order, cases, experiment.judge, kept)
    runs = {key: kept.runs[key] for key in keys_of(cases, compared)}
    made = experiment.page(
        order, cases, compared, found, lambda controller, case, model: runs[controller, case.name, model.name]
    )
    title = f"{made.title} on rig {order.loaded.config.rig.name}"
    said = "Measured on the loop of the rig, each case once: angle from its encoder, torque as sent. "
    files = {kept_runs.REPORTED: kept.packed(small=True)}
    return replace(made, title=title, key=said + made.key, files=files, written=kept.remove)


def belonging(order: Order, name: str) -> dict[str, str]:
    """What runs belong to, and cannot be mixed across. Raises DataError when the points cannot be read."""
    path = models.points_path(order)
    return {
        "experiment": name,
        "rig file (sha256)": order.loaded.sha256,
        "set of points (sha256)": models.digest(path) if path else "measured on the simulated rig",
        "choice of models": ", ".join(order.models) or "all",
    }


def keys_of(cases: Sequence[Case], compared: Sequence[Compared]) -> list[kept_runs.Key]:
    """Every run of the comparison."""
    return [
        (controller, case.name, model.name)
        for controller in CONTROLLERS
        for case in cases
        for model in compared
    ]


def found_of(cases: Sequence[Case], compared: Sequence[Compared], runs: Runs, judge: Judge) -> Found:
    """Figures of every run, as arrays of one value."""

    def of(controller: str, case: Case, model: Compared) -> dict[str, np.ndarray]:
        figures = judge(case, runs[controller, case.name, model.name])
        return {name: np.array([value]) for name, value in figures.items()}

    return {
        controller: {
            case.name: {model.name: of(controller, case, model) for model in compared} for case in cases
        }
        for controller in CONTROLLERS
    }


def _home(motion: Motion, cases: Sequence[Case]) -> float:
    """Where every case begins: here if all fit, else amid the place they leave. Raises DataError."""
    low = min(case.range_rad[0] for case in cases)
    high = max(case.range_rad[1] for case in cases)
    least, most = motion.low_rad - low, motion.high_rad - high
    if least > most:
        raise DataError(
            f"the travel in reach ({motion.low_rad:.3f} to {motion.high_rad:.3f} rad) is too short for "
            f"references from {low:g} to {high:g} rad; move the joint towards the middle of its travel"
        )
    return min(max(motion.position_rad, least), most)  # the nearest such place to here


def _go(motion: Motion, home_rad: float) -> Steps[None]:
    """Turn back to where the cases begin, and rest."""
    distance = home_rad - motion.position_rad  # of where it came to rest
    if abs(distance) > HOME_RAD:
        speed = min(motion.jog_speed_rad_s(), 2 * abs(distance))
        yield from motion.advance(distance - np.sign(distance) * motion.stopping_rad(speed) / 2, speed)
    yield from motion.rest()
