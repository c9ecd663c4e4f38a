"""Is this rig file's coupling provably passive? Ties config, friction model and margins together.

`examine` reads the friction models and returns every figure; the daemon refuses to start where `.ok` is
false, and `rtctl check` prints the same report.

How the guaranteed damping comes about, per axis:

- without a friction model: `viscous_nms_rad` of the rig file;
- with one: no more than that either, as dry friction is a spring in motions smaller than its presliding and
  damps nothing there; and no more than the secant damping left after feed-forward (docs/theory.md 5.2) over
  the trained range, with the friction at its lower bound (model minus its largest known error minus
  `drift_nm`);
- where the feed-forward follows a friction that changes, it is judged at the largest factor that it may reach
  (`friction.adaptation`), and so is all else that rests on it;
- where the velocity limit lies beyond the trained range, friction there is taken to rise from that lower
  bound with `viscous_nms_rad` only, while the feed-forward fades out;
- of an elastic joint what a hand cannot cancel: the motor's b_m, and of link and joint b_l b_j/(b_l + b_j).

Behind the motor is the joint, b_j + k_j/s, in series with a link and a hand of any impedance whose real part
is at least b_l. Over these the least real part of 1/(Y_j + Y_l) is 1/(|Y_j|^2/Re Y_j + 1/b_l) =
1/(1/b_j + 1/b_l), at every frequency and stiffness: a hand can cancel spring and inertia, and all else."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hw.interface import Joint
from rtctl.check import force_way, lateness, observer_tuning
from rtctl.check.admittance_figures import AdmittanceFigures, figures_of, loop_of
from rtctl.check.axis_report import AxisFigures
from rtctl.check.devices_of_axis import cut_a, joint_of_axis, shown_of_axis, taken_damping
from rtctl.check.lateness import Lateness
from rtctl.check.verdict import Outcome, Subject, Verdict, ranked
from rtctl.check.verdicts import verdicts
from rtctl.check.verdicts_of_admittance_steps import moment_step_nm
from rtctl.control.environments.kind import STIFFNESS
from rtctl.control.environments.table import Environment, using
from rtctl.control.proofs import stability
from rtctl.errors import StabilityError
from rtctl.friction import artefact
from rtctl.friction.adaptation import largest_feedforward
from rtctl.friction.guarantee import Guarantee, guarantee
from rtctl.friction.margins import FrictionFigures, friction_figures
from rtctl.plain_data import as_data
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.config import LoadedConfig
from rtctl.rig_file.measured_timing import AxisTiming

if TYPE_CHECKING:
    from rtctl.control.proofs.admittance_loop import AdmittanceLoop


@dataclass(frozen=True)
class AxisReport(AxisFigures):
    """Figures of one axis and what the tests say of them."""

    verdicts: tuple[Verdict, ...] = ()  # the worst last
    admittance: AdmittanceFigures | None = None
    """What the certificate of an admittance display finds; None on an axis that displays an impedance."""
    loop: AdmittanceLoop | None = None
    motion: str = "rotary"
    impedance: bool = True
    """Whether an impedance may be displayed, too, or alone."""

    @property
    def ok(self) -> bool:
        """True when no test fails."""
        return all(row.outcome != Outcome.FAIL for row in self.verdicts)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        plain = {one.name: getattr(self, one.name) for one in fields(self)}
        sure = {**asdict(self.guarantee), "given_most_j": self.guarantee.given_most_j}
        for name in ("friction", "admittance", "loop", "force_way", "observer"):
            plain[name] = None if plain[name] is None else asdict(plain[name])
        plain["verdicts"] = [row.to_dict() for row in self.verdicts]
        return {**plain, "guarantee": sure, "ok": self.ok}


@dataclass(frozen=True)
class Report:
    """The check of a whole rig file."""

    path: Path
    rig: str
    period_s: float
    axes: tuple[AxisReport, ...]

    @property
    def ok(self) -> bool:
        """True when every axis passes."""
        return all(axis.ok for axis in self.axes)

    @property
    def verdicts(self) -> list[Verdict]:
        """The rows of all axes, the worst last."""
        return ranked(row for axis in self.axes for row in axis.verdicts)

    def refusal(self) -> str:
        """Why the file is refused: file, key, value, bound, remedy, one line per failing test; "" if ok."""
        return "\n".join(row.refusal for row in self.verdicts if row.outcome == Outcome.FAIL)

    def require(self) -> None:
        """Raise StabilityError unless every axis passes."""
        if not self.ok:
            raise StabilityError(self.refusal())

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; a number that is not finite becomes None."""
        body = {"file": str(self.path), "rig": self.rig, "period_s": self.period_s, "ok": self.ok}
        axes, rows = [axis.to_dict() for axis in self.axes], [row.to_dict() for row in self.verdicts]
        body |= {"refusal": self.refusal(), "axes": axes, "verdicts": rows}
        return {name: as_data(value) for name, value in body.items()}


def bearing(loaded: LoadedConfig, index: int) -> tuple[float, stability.Between, float, float]:
    """Damping of an axis that no hand can cancel, N m s/rad, what is declared to lie between law and joint;
    what compensation adds to the coupling: by place N m/rad, by load a share of it."""
    late, joint = lateness.of_axis(loaded, index), joint_of_axis(loaded, index)
    found, b, _, _ = _friction(loaded, loaded.config.axis[index], late, joint)
    spring, loop = (found.place_stiffness_nm_rad, found.load_loop) if found else (0.0, 0.0)
    return _left(b, loaded.config.axis[index], joint), late.between, spring, loop


def examine(
    loaded: LoadedConfig, pulse: Mapping[str, AxisTiming] | None = None, *, telling: bool = True
) -> Report:
    """Compute the margins of every axis of a rig file.

    Parameters
    ----------
    pulse
        What the last test pulses measured of each axis, by name: it counts where it is worse.
    telling
        With rows that refuse nothing and take long; False: `.ok` and `.refusal()` are all that is asked.

    Raises
    ------
    ModelError
        A friction model that cannot be believed, or is of another rig."""
    config, of = loaded.config, [(pulse or {}).get(axis.name) for axis in loaded.config.axis]
    reports = tuple(examine_axis(loaded, index, one, telling=telling) for index, one in enumerate(of))
    return Report(path=loaded.path, rig=config.rig.name, period_s=config.period_s, axes=reports)


def examine_axis(loaded: LoadedConfig, index: int, pulse: AxisTiming | None, *, telling: bool) -> AxisReport:
    """As `examine`, of axis `index` alone: the models of the others need not be there."""
    axis, joint, config = loaded.config.axis[index], joint_of_axis(loaded, index), loaded.config
    found, where = figures_alone(loaded, index, pulse), f"{loaded.path}: axis[{index}]"
    own = cut_a(loaded, index), moment_step_nm(config.force_sensor), shown_of_axis(loaded, index)
    subject = Subject(found, axis, config.period_s, where, joint, config.simulated, *own, config.passivity)
    loop = loop_of(found, axis, joint, config.period_s) if axis.may_show("admittance") else None
    return AxisReport(
        **vars(found),
        verdicts=tuple(verdicts(subject, telling=telling)),
        admittance=figures_of(loop) if loop else None,
        loop=loop,
        motion=axis.motion,
        impedance=axis.may_show("impedance"),
    )


def figures_alone(loaded: LoadedConfig, index: int, pulse: AxisTiming | None = None) -> AxisFigures:
    """Figures of axis `index` without a verdict, which searches for what would pass, too: far longer."""
    late, joint = lateness.of_axis(loaded, index, pulse), joint_of_axis(loaded, index)
    figures, b, dry, sure = _friction(loaded, loaded.config.axis[index], late, joint)
    return _figures(loaded, index, late, joint, figures, (b, dry, sure))


def admittance_loop(loaded: LoadedConfig, index: int) -> AdmittanceLoop:
    """The loop that axis `index` closes as an admittance, as its certificate has it."""
    joint = joint_of_axis(loaded, index)
    return loop_of(figures_alone(loaded, index), loaded.config.axis[index], joint, loaded.config.period_s)


def _friction(
    loaded: LoadedConfig, axis: AxisTable, late: Lateness, joint: Joint
) -> tuple[FrictionFigures | None, float, float, Guarantee]:
    """Figures of the friction model, if any; sure damping; the motor's dry friction; the account's facts."""
    if (path := loaded.model_path(axis)) is None:
        return None, axis.viscous_nms_rad, joint.dry_share * axis.dry_friction_nm, guarantee(axis, None)
    model = artefact.load(path)
    artefact.require_rig(model, loaded.config.rig.name, path, axis.motion)
    T, count = loaded.config.period_s, 2 * math.pi / axis.counts_of_turn
    axis, factor = largest_feedforward(axis, model, T)
    of_joint = joint.dry_share, taken_damping(axis.viscous_nms_rad, joint)
    plain = friction_figures(model, path, axis, T, count, late.between, *of_joint)
    found, beyond = replace(plain, factor_max=factor), plain.beyond_damping_nms_rad
    secant = min(found.secant_damping_nms_rad, math.inf if beyond is None else beyond)
    sure = guarantee(axis, model if loaded.model_in_use(axis) else None)  # what the law counts on
    # never more than b: within presliding dry friction is a spring (2.8)
    return found, min(secant, axis.viscous_nms_rad), found.dry_left_nm, sure


def _left(guaranteed_nms_rad: float, axis: AxisTable, joint: Joint) -> float:
    """Damping that no hand can cancel of what feed-forward leaves, N m s/rad."""
    # what help takes of it, it takes at the motor: behind the spring all of b_l stays, for a hand to cancel
    return guaranteed_nms_rad - taken_damping(axis.viscous_nms_rad, joint)


def _figures(  # longer than 50 lines: one figure a line
    loaded: LoadedConfig,
    index: int,
    late: Lateness,
    joint: Joint,
    figures: FrictionFigures | None,
    guaranteed: tuple[float, float, Guarantee],
) -> AxisFigures:
    """Every figure of one axis; `guaranteed`: damping, dry friction, what the account rests on."""
    axis, T, between = loaded.config.axis[index], loaded.config.period_s, late.between
    k_c, b_c = axis.coupling.stiffness_nm_rad, axis.coupling.damping_nms_rad
    count = 2 * math.pi / axis.counts_of_turn
    b = _left(guaranteed[0], axis, joint)
    spring, more = (figures.place_stiffness_nm_rad, 1 + figures.load_loop) if figures else (0.0, 1.0)
    stiffer = more * k_c + spring  # what compensation by place and by load add (8.9, 8.10)
    needed = stability.damping_needed_between(stiffer, more * b_c, T, between)
    any_world = stability.damping_needed_between(stiffer, more * b_c, T, between, any_world=True)
    advised = stability.recommended_coupling(b, T, between)
    k_e = _environment_stiffness(axis)
    held, rate_needed = _empty_account(loaded, axis)
    ring, ratio = stability.coupling_ring(axis.inertia_kgm2, max(b, 0.0), k_c, b_c)
    return AxisFigures(
        index=index,
        name=axis.name,
        stiffness_nm_rad=k_c,
        damping_nms_rad=b_c,
        delay_ticks=between.delay,
        delay_from=late.delay_from,
        jitter_ticks=between.jitter,
        sample_ticks=between.sample_ticks,
        sample_from=late.sample_from,
        current_loop_hz=between.lag_hz,
        lag_from=late.lag_from,
        current_overshoot=between.overshoot,
        undeclared_devices=late.undeclared,
        motor_share=joint.motor_share,
        joint_encoder=joint.encoder,
        total_damping_nms_rad=guaranteed[0],
        device_damping_nms_rad=b,
        damping_needed_nms_rad=needed,
        damping_needed_any_world_nms_rad=any_world,
        sampled_data_margin_nms_rad=b - needed,
        sampled_data_k_max_nm_rad=max(0.0, stability.k_max_between(b, more * b_c, T, between) - spring)
        / more,
        adams_hannaford_margin_nms_rad=stability.margin_adams_hannaford(b, k_c, b_c, T),
        adams_hannaford_k_max_nm_rad=stability.k_max_adams_hannaford(b, b_c, T),
        recommended_stiffness_nm_rad=max(0.0, advised[0] - spring) / more,  # compensation brings the rest
        recommended_damping_nms_rad=advised[1] / more,
        environment_stiffness_nm_rad=k_e,
        felt_stiffness_nm_rad=None if k_e is None else stability.felt_stiffness(k_c, k_e),
        ring_hz=ring / (2 * math.pi),
        ring_damping_ratio=ratio,
        count_rad=count,
        quantisation_torque_nm=k_c * count / 2 + b_c * count / T,
        dry_friction_nm=guaranteed[1],
        torque_limit_nm=axis.torque_limit_nm,
        empty_account_torque_nm=held,
        torque_rate_needed_nm_s=rate_needed,
        friction=figures,
        guarantee=guaranteed[2],
        compensates=_compensates(loaded, axis, figures),
        force_sensor="force" not in loaded.config.rig.absent,
        force_way=force_way.of_axis(loaded, index),
        observer=observer_tuning.of_axis(loaded, index),
    )


def _compensates(loaded: LoadedConfig, axis: AxisTable, figures: FrictionFigures | None) -> bool:
    """Whether anything helps with the friction: a feed-forward needs a model, the observer a force sensor."""
    policy, sensor = axis.friction.policy, "force" not in loaded.config.rig.absent
    observes = sensor and axis.friction.observer.gain > 0 and (figures is not None or policy == "observer")
    return policy != "off" and (observes or (figures is not None and figures.feedforward_max_nm > 0))


def _empty_account(loaded: LoadedConfig, axis: AxisTable) -> tuple[float, float]:
    """Torque that an empty account can pay for, N m, and the slope at which that is the limit, N m/s."""
    from rtctl.control import take_back  # reading a report's names must not load the compiler
    from rtctl.control.jit import plain

    most_torque = plain(take_back.most_torque)
    T, limit = loaded.config.period_s, axis.torque_limit_nm
    way = take_back.OVERSPEED_FACTOR * axis.velocity_limit_rad_s * T
    left = take_back.FLOOR_FACTOR * loaded.config.passivity.budget_j
    held = min(limit, most_torque(left, axis.torque_rate_nm_s * T, way))
    if most_torque(left, limit, way) < limit:  # a slope of the limit a tick is none: no gate is quicker
        return held, math.inf
    low, high = 0.0, limit
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if most_torque(left, middle, way) < limit else (low, middle)
    return held, high / T


def _environment_stiffness(axis: AxisTable) -> float | None:
    shown = axis.environment
    return shown.stiffness_nm_rad if Environment[shown.kind.upper()] in using(STIFFNESS) else None
