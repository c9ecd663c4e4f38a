"""`rtctl check`: is this rig file's coupling provably passive?"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hw.motion import words
from rtctl.check.verdict import Outcome, named
from rtctl.cli.check_lines import axis_lines
from rtctl.cli.json_text import end_with
from rtctl.cli.outputs import OutputFile
from rtctl.errors import StabilityError
from rtctl.rounded import up

if TYPE_CHECKING:
    from rtctl.check.stability_report import Report
    from rtctl.rig_file.config import LoadedConfig

_File = click.Path(dir_okay=False, path_type=Path)
_MEMBER_KEYS = ("kind", "axes", "channels", "max_age_ticks", "budget_ns")


@click.command("check")
@click.argument("config", type=_File)
@click.option("--json", "as_json", is_flag=True, help="one JSON object with every figure, for scripts")
@click.option("--plot", type=OutputFile(picture=True), help="draw the region of passive couplings (PNG)")
def command(config: Path, *, as_json: bool, plot: Path | None) -> None:
    """Check a rig file: bounds, friction model, and whether its coupling is provably passive.

    Figures first, then what the tests say of them, the weakest last. What the last arming measured of the
    torque's delay on these devices counts where it is worse than declared. Exit code 5 when a test fails."""
    from rtctl.check import stability_report
    from rtctl.friction import advice
    from rtctl.recording.state_folder import written_folder
    from rtctl.rig_file import measured_timing as timing
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
        body["not_proved"] = named(report.verdicts, Outcome.NOT_PROVED)
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
        end_with(body, 0 if report.ok else StabilityError, indent=2)
    click.echo(f"{report.path}\nrig {report.rig}, {1 / report.period_s:g} Hz")
    for axis in report.axes:
        click.echo(f"\naxis {axis.name}")
        for label, figure, note in axis_lines(axis):
            own = words(figure, axis.motion)
            click.echo(words(f"  {label:<32}{own:>24}  {note}".rstrip(), axis.motion))
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
    report.require()  # last: of what fails the table above says why


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
        f"{axis.name} at most {up(axis.guarantee.given_most_j * 1e3)} mJ"
        for axis in report.axes
        if axis.compensates
    ]
    help_ = f"; the help with friction gives a hand, over all time, on {', '.join(given)}" if given else ""
    if not told:
        if all(axis.admittance is None for axis in report.axes):
            shown = "passive with every passive hand and every passive virtual environment"
        click.echo(f"\nOK: {shown}{help_}")
        return
    unproved, odd = named(told, Outcome.NOT_PROVED), named(told, Outcome.WARN)
    if odd:
        click.echo(f"\nlook again at: {'; '.join(odd)}")
    # "no test fails", not "passes": some rows could not be proved, and stand last, where a hurried eye ends
    but = ", but for what is not proved" if unproved else ""
    click.echo(f"\nOK: no test fails; {shown}{but}{help_}")
    if unproved:
        click.echo(f"{Outcome.NOT_PROVED.label}: {'; '.join(unproved)}")


def _shown(report: Report) -> str:
    """What a report without a failing row says of each display."""
    parts = []
    if any(axis.impedance for axis in report.axes):
        parts.append("the coupling is passive with every passive hand and every passive environment")
    for axis in report.axes:
        if axis.admittance is not None and axis.loop is not None:
            box = axis.loop.box
            how = "stable" if axis.admittance.proved else "stable at every point tried"
            hands = (
                f"{box.stiffness_nm_rad:g} N m/rad, {box.damping_nms_rad:g} N m s/rad, "
                f"{box.inertia_kgm2:g} kg m^2"
            )
            hands = words(hands, axis.motion)
            parts.append(f"{axis.name} as an admittance is {how} in hands to {hands} and in linear worlds")
    return "; ".join(parts)


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
