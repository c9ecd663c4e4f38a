"""`rtctl playback` without the command line: from its options to the report."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hw.motion import HANDLE_M, of_units
from rtctl.control.vocabulary import Fault, State
from rtctl.errors import ConfigError
from rtctl.friction import artefact
from rtctl.friction.guarantee import GATE_SHARE, INTENT_SHARE
from rtctl.friction.learn.point_evidence import with_presliding
from rtctl.friction.logs.dynamics import SPEED_MIN_RAD_S
from rtctl.friction.logs.log_input import of_file, radian_of
from rtctl.friction.logs.presliding_in_logs import presliding_of_logs
from rtctl.friction.model import FrictionModel
from rtctl.friction.presliding import Presliding
from rtctl.rig_file import config as rig_file
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation.playback_doubts import another_inertia
from rtctl.simulation.playback_figures import (
    EPSILON_NM,
    Judged,
    Learned,
    Settings,
    in_range_share,
    judge,
    learn,
)
from rtctl.simulation.playback_figures import prediction as predict
from rtctl.simulation.playback_interaction import Trace, interaction
from rtctl.simulation.playback_interaction import trace as trace_of
from rtctl.simulation.playback_picture import save_plot
from rtctl.simulation.playback_run import (
    changed,
    config_for_log,
    fault_names,
    load_log,
    require_playback,
    run_log,
    with_bias,
)


@dataclass(frozen=True)
class Job:
    """The options of the command, by their names there. Columns are option tables of the playback backend."""

    config: Path | None = None
    log: Path | None = None
    fit_from: tuple[Path, ...] = ()
    time: dict[str, Any] | None = None
    position: dict[str, Any] | None = None
    motor_torque: dict[str, Any] | None = None
    hand_torque: dict[str, Any] | None = None
    inertia_kgm2: float | None = None
    fit_inertia: bool = False
    torque_limit_nm: float = 1.0
    lever_m: float = 0.1
    counts_per_rev: float = 100_000.0
    bias: Literal["midpoint", "zero"] = "midpoint"
    train_share: float = 1.0
    cutoff_hz: float = 20.0
    speed_min_rad_s: float | None = None
    epsilon_nm: float | None = None
    presliding_rad: float | None = None
    save_model: Path | None = None
    plot: Path | None = None


def run(job: Job, progress: Callable[[float, str], None] = lambda _share, _text: None) -> dict[str, Any]:
    """Do the job; the result is plain numbers and text, ready for JSON. `progress` is told the share that is
    done, 0 to 1, and what comes next.

    Raises
    ------
    RtctlError
        Each kind by name: config, device, data, model."""
    loaded = _from_rig_file(job) if job.config else _from_options(job)
    rig = loaded.config.hardware()
    settings = _settings(job, loaded)
    # before minutes of learning: a log that cannot be judged is told at once
    progress(0.0, "reading")
    evaluated = judge(loaded.options, rig, settings)
    motion = loaded.config.axis[0].motion
    result: dict[str, Any] = {"rate_hz": loaded.config.loop.rate_hz, "motion": motion}
    result["log"] = evaluated.summary()
    result["warnings"] = [evaluated.spring.told] if evaluated.spring else []
    learned = None
    if job.fit_from:
        progress(0.2, "learning")
        learned = learn(job.fit_from, loaded.options, rig, settings, loaded.config.rig.name)
        progress(0.5, "how far the joint bends at rest")
        bent = _presliding(job, learned, settings)
        doubts = another_inertia(evaluated.regressed, [each.regressed for each in learned.logs])
        learned = replace(
            learned, model=with_presliding(learned.model, bent), warnings=(*learned.warnings, *doubts)
        )
        result["fit"] = {**_fit_summary(learned), "presliding": asdict(bent) if bent else None}
        if learned.held_out is not None:
            result["held_out"] = predict(learned, learned.held_out)
        result["prediction"] = {
            **predict(learned, evaluated.samples),
            # by content: one log may be given under two names
            "trained_on_it": evaluated.log.sha256 in {each.log.sha256 for each in learned.logs},
        }
        if job.save_model:
            artefact.save(learned.model, job.save_model)
    signals = None
    if _has_hand(loaded.options):
        progress(0.8, "the loop over the log")
        result["interaction"], signals = _interaction(job, loaded, evaluated, learned, settings)
    if job.plot and learned:
        save_plot(job.plot, learned, evaluated, signals, motion)
    return result


def _presliding(job: Job, learned: Learned, settings: Settings) -> Presliding | None:
    """As given, or from the turns in the logs that were learned from."""
    if job.presliding_rad is not None:
        # of no ramp: somebody has said it
        return Presliding(job.presliding_rad, None, 0)
    slowest = settings.speed_min_rad_s
    return presliding_of_logs([each.log for each in learned.logs], job.cutoff_hz, slowest)


def _has_hand(options: Mapping[str, Any]) -> bool:
    return bool(options["axis"][0].get("hand_torque") or options.get("force"))


def _settings(job: Job, loaded: LoadedConfig) -> Settings:
    inertia = job.inertia_kgm2
    if inertia is None and job.config and not job.fit_inertia:
        inertia = loaded.config.axis[0].inertia_kgm2
    linear, slowest = loaded.config.axis[0].motion == "linear", job.speed_min_rad_s
    if slowest is None:
        slowest = SPEED_MIN_RAD_S * (_radian(loaded) if linear else 1.0)
    return Settings(
        inertia_kgm2=inertia,
        bias=job.bias,
        cutoff_hz=job.cutoff_hz,
        speed_min_rad_s=slowest,
        epsilon_nm=job.epsilon_nm or (EPSILON_NM / HANDLE_M if linear else EPSILON_NM),
        train_share=job.train_share,
    )


def _radian(loaded: LoadedConfig) -> float:
    """What stands for a radian in the thresholds of a linear log: as `rtctl identify --log` takes it."""
    rig = loaded.config.hardware()
    return radian_of([load_log(loaded.options, rig)], rig)


def _from_rig_file(job: Job) -> LoadedConfig:
    loaded = rig_file.load(job.config or "")
    require_playback(loaded)
    if not job.fit_from and not loaded.config.axis[0].friction.model:
        raise ConfigError(f"{loaded.path}: axis[0].friction.model is empty: name a model, or give --fit-from")
    options = of_file(loaded.options, job.log) if job.log else loaded.options
    return changed(loaded, options, {})


def _from_options(job: Job) -> LoadedConfig:
    """Make up a rig for a log without a rig file: its rate is the log's, its limits and energy budget wide.

    What the observer would say of a device with unknown damping is no question to a log without a rig file.
    """
    assert job.log, "the command line asks for it, and for its columns"
    columns = (job.position, job.motor_torque, job.hand_torque)
    if of_units(column.get("unit") for column in columns if column) == "linear":
        raise ConfigError(
            "a log of a linear axis needs a rig file, for its mass, limits and travel: "
            'configs/playback.toml with motion = "linear" (docs/linear-axis.md)'
        )
    torques = {name: column for name in ("motor_torque", "hand_torque") if (column := getattr(job, name))}
    options = of_file({"time": job.time, "axis": [{"position": job.position, **torques}]}, job.log)
    axis: dict[str, Any] = {
        "inertia_kgm2": job.inertia_kgm2 or 1.0,  # the free environment does not use it
        "viscous_nms_rad": 0.0,  # nothing is known to be damped
        "encoder_counts_per_rev": job.counts_per_rev,
        "torque_constant_nm_a": 1.0,
        "lever_m": [0.0, job.lever_m, 0.0],
        "torque_limit_nm": job.torque_limit_nm,
        # from nothing to the limit in 10 ms: the gate must not be what the report is about
        "torque_rate_nm_s": 100 * job.torque_limit_nm,
        "velocity_limit_rad_s": 100.0,  # more no log of a hand-held joint has (`identify --log` refuses it)
        "current_limit_a": 1e3,
        "force": {"tare_s": 0.0, "limit_n": 1e4},
    }
    guess = config_for_log(options, 1000.0, axis)  # any rate: the log's own is not known before it is read
    rate_hz = load_log(options, guess.config.hardware()).rate_hz
    return config_for_log(options, round(rate_hz, 6), axis)


def _fit_summary(learned: Learned) -> dict[str, Any]:
    return {
        "logs": [each.summary() for each in learned.logs],
        "points": len(learned.points.count),
        "support_vectors": [len(branch.support_vectors) for branch in learned.model.branches],
        "C": [branch.hyper_parameters["C"] for branch in learned.model.branches],
        "validation_rmse_nm": [branch.validation_rmse_nm for branch in learned.model.branches],
        "speed_max_rad_s": [branch.speed_max_rad_s for branch in learned.model.branches],
        "warnings": list(learned.warnings),
    }


def _interaction(
    job: Job, loaded: LoadedConfig, evaluated: Judged, learned: Learned | None, settings: Settings
) -> tuple[dict[str, Any], Trace]:
    """Run the loop over the log with the model in force."""
    options: Mapping[str, Any] = loaded.options
    tables: dict[str, dict[str, Any]] = {"force": {"tare_s": 0.0}}  # a hand that moves cannot be tared away
    if evaluated.bias_nm:
        # the zero of the sensor is no force of the hand, and the gate would be opened by it
        options = with_bias(options, loaded.config.hardware(), evaluated.bias_nm)
    if learned is None:
        rows = run_log(changed(loaded, options, tables))
        path = loaded.model_path(loaded.config.axis[0])
        assert path is not None, "_from_rig_file has made sure"
        model = artefact.load(path)
    else:
        model = learned.model
        rows = _run_with(model, loaded, options, tables, None if job.config else learned)
    signals = trace_of(
        rows, loaded.config.loop.rate_hz, evaluated.inertia_kgm2, job.cutoff_hz, evaluated.spring
    )
    active = rows[rows["state"] == State.ACTIVE]
    return {
        "ticks": len(rows),
        "counted_ticks": len(signals.time_s),
        **_end_of(rows, loaded.config.loop.rate_hz),
        "limited_ticks": int((active["gate_flags"][:, 0] != 0).sum()),
        "in_range_share": in_range_share(model, signals.velocity_rad_s),
        **interaction(signals, settings.speed_min_rad_s),
    }, signals


def _end_of(rows: np.ndarray, rate_hz: float) -> dict[str, Any]:
    """Whether a fault ended the torque before the log ended, which, and when."""
    # every log ends: that is no fault of it
    faults = int(np.bitwise_or.reduce(rows["faults"])) & ~int(Fault.END_OF_LOG)
    stopped = np.flatnonzero(rows["fault_first"] >= 0)
    return {
        "faults": fault_names(faults),
        "first_fault": Fault(1 << int(rows["fault_first"][stopped[0]])).name if len(stopped) else None,
        "stopped_at_s": float((rows["sample_count"][stopped[0]] - 1) / rate_hz) if len(stopped) else None,
    }


def _run_with(
    model: FrictionModel,
    loaded: LoadedConfig,
    options: Mapping[str, Any],
    tables: dict[str, dict[str, Any]],
    scaled_by: Learned | None,
) -> np.ndarray:
    """Run with a model just learned, through its file as on any rig. `scaled_by` sets intent and gate."""
    with tempfile.TemporaryDirectory(prefix="rtctl-") as folder:
        path = Path(folder, "model.json")
        artefact.save(model, path)
        friction: dict[str, Any] = {"model": str(path)}
        if scaled_by is not None:
            coulomb = float(np.mean([each.dynamics.coulomb_nm for each in scaled_by.logs]))
            friction |= {"intent_nm": INTENT_SHARE * coulomb, "gate_nm": GATE_SHARE * coulomb}
        return run_log(changed(loaded, options, {**tables, "friction": friction}))
