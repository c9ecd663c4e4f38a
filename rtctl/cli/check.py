"""`rtctl check`: is this rig file's coupling provably passive?"""

from __future__ import annotations

import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hw.motion import words
from rtctl.check.verdict import Outcome
from rtctl.cli.json_text import json_text
from rtctl.cli.outputs import OutputFile
from rtctl.errors import StabilityError

if TYPE_CHECKING:
    from rtctl.check.stability_report import AxisReport, Report
    from rtctl.friction.margins import FrictionFigures
    from rtctl.rig_file.config import LoadedConfig

_File = click.Path(dir_okay=False, path_type=Path)
_MEMBER_KEYS = ("kind", "axes", "channels", "max_age_ticks", "budget_ns")


@click.command("check")
@click.argument("config", type=_File)
@click.option("--json", "as_json", is_flag=True, help="one JSON object with every figure, for scripts")
@click.option("--plot", type=OutputFile(picture=True), help="draw the region of passive couplings (PNG)")
def command(config: Path, *, as_json: bool, plot: Path | None) -> None:
    """Check a rig file: bounds, friction model, and whether its coupling is provably passive.

    Figures first, then what the tests say of them, the weakest last. What the last arming measured of the torque's
    delay on these devices counts where it is worse than declared. Exit code 5 when a test fails.
    """
    from rtctl.check import measured_timing as timing
    from rtctl.check import stability_report
    from rtctl.friction import advice
    from rtctl.recording.state_folder import written_folder
    from rtctl.rig_file.config import load

    loaded = load(config)
    pulse = timing.read(written_folder(loaded.config.rig.name), timing.devices_sha256(loaded))
    report = stability_report.examine(loaded, pulse)
    advices = advice.advise(loaded)
    if plot is not None:
        from rtctl.check import stability_figure

        stability_figure.draw(report, plot)
    if as_json:
        body = report.to_dict()
        body["devices"] = [{"kind": kind, "lines": lines} for kind, lines in loaded.device_report()]
        body["members"] = [
            {
                "device": member.label,
                **{key: value for key, value in asdict(member).items() if key in _MEMBER_KEYS},
            }
            for member in loaded.members()
        ]
        body["recommended"] = [asdict(one) for one in advices]
        body["warnings"] = [one.text for one in advices if not one.ok]
        if not report.ok:
            body |= {"error": StabilityError.__name__, "exit_code": StabilityError.exit_code}
        click.echo(json_text(body, indent=2))
        if not report.ok:
            sys.exit(StabilityError.exit_code)
        return
    click.echo(f"{report.path}\nrig {report.rig}, {1 / report.period_s:g} Hz")
    motion = {axis.name: axis.motion for axis in loaded.config.axis}
    for axis in report.axes:
        click.echo(f"\naxis {axis.name}")
        for label, figure, note in _lines(axis):
            own = words(figure, motion[axis.name])
            click.echo(words(f"  {label:<32}{own:>24}  {note}".rstrip(), motion[axis.name]))
    _echo_devices(loaded)
    for one in advices:
        if one.text:
            click.echo(f"\n{'note' if one.ok else 'WARNING'}: {one.text}")
        if one.temperature_min_c is not None and one.temperature_max_c is not None:
            at = f"{one.temperature_min_c:.0f}-{one.temperature_max_c:.0f} degC"
            click.echo(f"\naxis {one.axis}: friction was learned at {at}; the daemon warns outside")
    if plot is not None:
        click.echo(f"\nplot: {plot}")
    _echo_verdicts(report)
    report.require()


def _echo_verdicts(report: Report) -> None:
    """The table of verdicts, and a last line that says no more than it does."""
    click.echo("\nwhat the tests say, the weakest last")
    several = len(report.axes) > 1
    for row in report.verdicts:
        name = f"{row.axis}: {row.name}" if several else row.name
        click.echo(
            f"  {row.outcome.label:<12}{name:<42}{row.figure:>24}  {row.bound:<24}  {row.meaning}".rstrip()
        )
    if not report.ok:
        return
    told = [row for row in report.verdicts if row.outcome != Outcome.PASS]
    shown = _shown(report)
    given = [
        f"{axis.name} at most {axis.guarantee.given_most_j * 1e3:.3g} mJ"
        for axis in report.axes
        if axis.compensates
    ]
    help_ = f"; the help with friction gives a hand, over all time, on {', '.join(given)}" if given else ""
    if not told:
        if all(axis.admittance is None for axis in report.axes):
            shown = "passive with every passive hand and every passive virtual environment"
        click.echo(f"\nOK: {shown}{help_}")
        return
    click.echo(f"\nOK: no test fails; {shown}{help_}")
    for outcome, word in ((Outcome.NOT_PROVED, "but not proved"), (Outcome.WARN, "look again at")):
        names = "; ".join(f"{row.axis}: {row.name}" for row in told if row.outcome == outcome)
        if names:
            click.echo(f"{word}: {names}")


def _shown(report: Report) -> str:
    """What a report without a failing row says of each display."""
    parts = []
    if any(axis.impedance for axis in report.axes):
        parts.append("the coupling is passive with every passive hand and every passive environment")
    for axis in report.axes:
        if axis.admittance is not None and axis.loop is not None:
            box = axis.loop.box
            how = "stable" if axis.admittance.proved else "stable at every point tried"
            parts.append(
                f"{axis.name} as an admittance is {how} in hands to {box.stiffness_nm_rad:g} N m/rad, {box.damping_nms_rad:g} "
                f"N m s/rad, {box.inertia_kgm2:g} kg m^2 and in linear worlds"
            )
    return "; ".join(parts)


def _admittance_lines(axis: AxisReport) -> list[tuple[str, str, str]]:
    """Label, figure and note of an axis that is displayed as an admittance."""
    one, loop = axis.admittance, axis.loop
    if one is None or loop is None:
        return []
    return [
        (
            "virtual mass m",
            f"{loop.mass_kgm2:.4g} kg m^2",
            (f"up to {loop.mass_max_kgm2:g} while it runs; " if loop.mass_max_kgm2 > loop.mass_kgm2 else "")
            + f"least that passes {one.mass_min_kgm2:.3g}",
        ),
        ("virtual damping b_v", f"{loop.virtual_damping_nms_rad:.4g} N m s/rad", ""),
        (
            "velocity gain K_v",
            f"{loop.velocity_gain_nms_rad:.4g} N m s/rad",
            f"position gain K_p {loop.position_gain_nm_rad:.4g} N m/rad",
        ),
        (
            "stiffest hand that passes",
            f"{one.hand_stiffness_max_nm_rad:.4g} N m/rad",
            f"in any linear world; in free motion {one.hand_stiffness_max_free_nm_rad:.4g}; the box has {loop.box.stiffness_nm_rad:g}",
        ),
        (
            "least mass without lag",
            f"{one.mass_min_continuous_kgm2:.4g} kg m^2",
            "J K_v/(b + K_v): passive with any hand",
        ),
    ]


def _echo_devices(loaded: LoadedConfig) -> None:
    for member in loaded.members():
        age = f"a sample counts for {member.max_age_ticks} ticks" if member.max_age_ticks else ""
        budget = f"{member.budget_ns / 1000:g} us to read" if member.budget_ns else ""
        notes = "; ".join(note for note in (age, budget) if note)
        click.echo(
            f"\n{member.label} ({member.kind}): {', '.join(member.channels)}"
            + (f"  {notes}" if notes else "")
        )
    if view := loaded.config.view:
        click.echo(f"\nlive view, shown by the daemon: http://127.0.0.1:{view.port}/")
    for kind, lines in loaded.device_report():
        click.echo(f"\ndevice {kind}")
        for label, figure, note in lines:
            click.echo(f"  {label:<32}{figure:>24}  {note}".rstrip())


def _lines(axis: AxisReport) -> list[tuple[str, str, str]]:
    """Label, figure with unit, and note of every line of one axis."""
    shown = _admittance_lines(axis)
    if not axis.impedance:
        shown += _friction_lines(axis.friction) if axis.friction else []
        return shown + (_account_lines(axis) if axis.compensates else [])
    from rtctl.check.verdicts_of_loop import between_text

    exact, paper = axis.sampled_data_margin_nms_rad, axis.adams_hannaford_margin_nms_rad
    lines = [
        ("coupling stiffness k_c", f"{axis.stiffness_nm_rad:.4g} N m/rad", ""),
        ("coupling damping b_c", f"{axis.damping_nms_rad:.4g} N m s/rad", between_text(axis)),
        (
            "guaranteed device damping b",
            f"{axis.device_damping_nms_rad:.4g} N m s/rad",
            _source(axis),
        ),
        (
            "sampled-data margin",
            f"{exact:+.4g} N m s/rad",
            f"k_c up to {axis.sampled_data_k_max_nm_rad:.4g} at this b_c",
        ),
        (
            "Adams-Hannaford margin",
            f"{paper:+.4g} N m s/rad",
            f"as in the papers; k_c up to {axis.adams_hannaford_k_max_nm_rad:.4g} at this b_c",
        ),
    ]
    lines += _friction_lines(axis.friction) if axis.friction else []
    lines += _account_lines(axis) if axis.compensates else []
    felt, k_e = axis.felt_stiffness_nm_rad, axis.environment_stiffness_nm_rad
    lines += [
        (
            "encoder count",
            f"{axis.count_rad:.4g} rad",
            f"asks {axis.quantisation_torque_nm:.3g} N m of dry friction",
        ),
        (
            "recommended coupling",
            f"{axis.recommended_stiffness_nm_rad:.4g} N m/rad",
            f"with b_c = {axis.recommended_damping_nms_rad:.3g} N m s/rad",
        ),
        (
            "ring on the coupling, hand off",
            f"{axis.ring_hz:.3g} Hz",
            f"damping ratio {axis.ring_damping_ratio:.3g}",
        ),
        ("torque of an empty account", f"{axis.empty_account_torque_nm:.4g} N m", _account(axis)),
    ]
    if felt is not None:
        lines.append(("felt stiffness", f"{felt:.4g} N m/rad", f"of {k_e:.4g} in the virtual environment"))
    return shown + lines


def _account(axis: AxisReport) -> str:
    """What bounds the torque that the energy account can pay for, and what would raise it to the limit."""
    if axis.empty_account_torque_nm >= axis.torque_limit_nm:
        return "all of the limit can be taken back in time"
    needed = axis.torque_rate_needed_nm_s
    remedy = f"torque_rate_nm_s = {needed:.4g}" if math.isfinite(needed) else "a larger passivity.budget_j"
    return f"of {axis.torque_limit_nm:.4g}, the rest against what the hand puts in; all with {remedy}"


def _source(axis: AxisReport) -> str:
    """Where the guaranteed damping comes from."""
    found = axis.friction
    share = (
        ""
        if axis.motor_share == 1
        else f", of {axis.total_damping_nms_rad:.4g} behind and before the joint's spring"
    )
    if found is None:
        return f"viscous_nms_rad of the rig file; no friction model{share}"
    beyond = found.beyond_damping_nms_rad
    if axis.total_damping_nms_rad < min(found.secant_damping_nms_rad, math.inf if beyond is None else beyond):
        return f"viscous_nms_rad of the rig file: all that damps small motions{share}"
    if beyond is not None and beyond < found.secant_damping_nms_rad:
        return f"beyond the trained range; within it {found.secant_damping_nms_rad:.4g}{share}"
    return f"secant damping with feed-forward, least at {found.secant_speed_rad_s:.3g} rad/s{share}"


def _account_lines(axis: AxisReport) -> list[tuple[str, str, str]]:
    """What the account of the compensation rests on."""
    sure = axis.guarantee
    return [
        ("presliding length", f"{sure.length_rad * 1e3:.4g} mrad", sure.length_source),
        ("  credited to the bristles", f"{sure.credited_rad * 1e3:.4g} mrad", "1.5 times it and two spreads"),
        (
            "bank of the compensation",
            f"{sure.bank_j * 1e3:.3g} mJ",
            f"a hand is given at most {sure.given_most_j * 1e3:.3g} mJ",
        ),
    ]


def _friction_lines(found: FrictionFigures) -> list[tuple[str, str, str]]:
    two, capped = found.two_line_margin_nm, found.two_line_capped_margin_nm
    local = found.slope_damping_nms_rad
    return [
        (
            "two-line margin",
            f"{two:+.4g} N m",
            "whatever the feed-forward's sign errors (a force gate excludes most)",
        ),
        ("  capped below dry friction", f"{capped:+.4g} N m", ""),
        (
            "least local damping",
            f"{local:+.4g} N m s/rad",
            "below 0 stick-slip needs the hand's damping",
        ),
        (
            "least friction, lower bound",
            f"{found.friction_floor_nm:.4g} N m",
            f"model error {found.error_max_nm:.3g} N m",
        ),
        (
            "most feed-forward",
            f"{found.feedforward_max_nm:.4g} N m",
            f"share that surely passes {found.gain_max:.3g}",
        ),
    ]
