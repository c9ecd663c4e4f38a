"""`rtctl probe`: what the devices of a rig show, without arming anything."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hw.motion import words
from rtctl.cli import probe_shape
from rtctl.cli.json_text import end_with
from rtctl.cli.number import Number

if TYPE_CHECKING:
    from rtctl.host.probe_device_readings import DeviceProbe
    from rtctl.rig_file.config import LoadedConfig

# a script waits for an end; two seconds show a rate of some samples a second as well
JSON_SECONDS = 2.0


@click.command("probe")
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--device", metavar="N", help="only this one: its number or its name in the rig file")
@click.option(
    "--for",
    "--seconds",
    "seconds",
    type=Number(0.01, 1e6),
    help="stop after this long; default: Ctrl-C, with --json 2 seconds",
)
@click.option(
    "--poll",
    is_flag=True,
    help="send disabled zero commands; drives and boards on a CAN bus are asked without it",
)
@click.option(
    "--pulses",
    type=click.IntRange(5, 1000),
    help="arm and stop the rig so many times, and tell by its test pulses of what shape each current loop "
    "is: what to put into [axis.drive]",
)
@click.option("--yes", is_flag=True, help="with --pulses: do not ask whether nobody touches the rig")
@click.option("--runtime-dir", type=click.Path(), help="folder of the rig's lock, instead of the default")
@click.option("--json", "as_json", is_flag=True, help="end with one JSON object on stdout")
def command(
    config: Path,
    device: str | None,
    seconds: float | None,
    runtime_dir: str | None,
    *,
    pulses: int | None,
    yes: bool,
    poll: bool,
    as_json: bool,
) -> None:
    """Show what the devices of CONFIG measure: values, rate, age, damaged and lost frames.

    Nothing is armed and no torque is written, but with --pulses; drives that answer only when asked are
    asked. The force is tared over its first samples, as before arming: let go meanwhile. Refused while a
    daemon runs the rig. Beside it stands what the last arming measured of each axis' torque (delay, lag,
    gain, offset). Exit code 6 when a device cannot be opened, is lost, or shows no sample."""
    from rtctl.host.probe_device_readings import devices, watch
    from rtctl.recording.as_columns import register
    from rtctl.rig_file.config import load
    from rtctl.wire.endpoints import RuntimeDirectory

    register()
    loaded = load(config)
    if pulses is not None:
        probe_shape.tell(loaded, pulses, runtime_dir, as_json=as_json, yes=yes)
        return
    with _drivers_of(loaded.path):
        found = devices(loaded, device, poll=poll)
    in_place = not as_json and sys.stdout.isatty()
    drawn = 0

    def _show() -> None:
        nonlocal drawn
        lines = [line for one in found for line in _lines(one.report())]
        if in_place:  # a wrapped line would be left behind by the next drawing
            width = shutil.get_terminal_size().columns
            lines = [line[: width - 1] for line in lines]
        if drawn:
            # up to the first line of the last drawing, and clear from there
            click.echo(f"\x1b[{drawn}F\x1b[J", nl=False)
        drawn = len(lines) if in_place else 0
        click.echo("\n".join(lines))

    interrupted = False
    with RuntimeDirectory.acquire(loaded.config.rig.name, runtime_dir):  # to open a drive is to disarm it
        try:
            until = seconds if seconds is not None or not as_json else JSON_SECONDS
            watch(
                found,
                loaded.config.period_s,
                until,
                (lambda: None) if as_json else _show,
                0.2 if in_place else 1.0,
            )
        except KeyboardInterrupt:
            interrupted = True
    _end(found, loaded, _show, as_json=as_json, interrupted=interrupted)


def _end(
    found: list[DeviceProbe],
    loaded: LoadedConfig,
    show: Callable[[], None],
    *,
    as_json: bool,
    interrupted: bool,
) -> None:
    """The last look at the devices, and what the last arming measured; DeviceError where one is bad."""
    from rtctl.errors import DeviceError
    from rtctl.host.probe_actuator_delays import actuators
    from rtctl.recording.state_folder import written_folder

    reports = [one.report() for one in found]
    bad = [_trouble(one) for one in reports if one["error"] or not one["samples"]]
    torque = actuators(loaded, written_folder(loaded.config.rig.name))
    if as_json:
        body = {"ok": not bad, "devices": reports, "actuators": torque}
        end_with(body, DeviceError if bad else 130 if interrupted else 0)
    show()
    click.echo("\n".join(_actuator_line(one) for one in torque))
    if bad:
        raise DeviceError("; ".join(bad))


@contextmanager
def _drivers_of(path: Path) -> Iterator[None]:
    """A driver that cannot be made is an error of a device."""
    from hw.interface import BackendError
    from rtctl.errors import DeviceError

    try:
        yield
    except BackendError as error:
        raise DeviceError(f"{path}: {error}") from error


def _trouble(report: dict[str, Any]) -> str:
    return f"{report['device']}: {report['error'] or 'opened, but shows no sample'}"


def _actuator_line(one: dict[str, Any]) -> str:
    declared = (
        f"axis {one['axis']}: torque declared {one['declared_delay_ms']:g} ms late ({one['declared_by']})"
    )
    found = one["measured"]
    if found is None:
        return f"{declared}; not measured yet: the test pulse of arming does, where a current is measured"
    told = (
        f"{declared}, measured at least {found['delay_s'] * 1e3:.3g} ms (lag {found['lag_s'] * 1e3:.3g}) on "
        f"{found['date']}; current {found['gain']:.3g} of what was sent, {found['offset_nm']:+.3g} N m off; "
        f"a sample every {found['sample_period_s'] * 1e3:.4g} ms"
    )
    return words(told, one["motion"])


def _tare(value: dict[str, Any]) -> str:
    if "tare" not in value:
        return ""
    return ", untared yet: let go" if value["tare"] is None else f", tared by {value['tare']:.4g}"


def _lines(report: dict[str, Any]) -> list[str]:
    age = (
        "none yet"
        if report["age_ms"] is None
        else f"{report['age_ms']:.1f} ms, most {report['age_max_ms']:.1f}"
    )
    lines = [
        f"{report['device']} ({report['kind']}): {report['rate_hz']:.1f} samples/s seen, age {age}, "
        f"reading {report['read_us']['p50']:.1f} us, most {report['read_us']['max']:.0f}"
    ]
    if period := report["period_ms"]:
        lines.append(
            f"  a sample every {period['mean']:.4g} ms, jitter {period['jitter']:.3g}, longest "
            f"{period['max']:.4g}; declared: {report['declared']}"
        )
    lines += [
        f"  {value['channel']:<12}{value['of']:<10}{value['value']:>14.6g} {value['unit']:<5}"
        f" from {value['min']:.6g} to {value['max']:.6g}, std {value['std']:.3g}{_tare(value)}"
        for value in report["values"]
    ]
    faults = ", ".join(f"{name} {count}" for name, count in report["faults"].items() if count) or "none"
    lines.append(f"  link faults (cycles): {faults}")
    if report["counts"]:
        lines.append(
            "  link counts: " + ", ".join(f"{name} {count}" for name, count in report["counts"].items())
        )
    for said in report["words"]:
        axis = f" (axis {said['axis']})" if said["axis"] else ""
        when = f" in {said['fault_cycles']} cycles with a fault" if said["fault_cycles"] else ""
        lines.append(f"  {'says' if said['now'] else 'said'}{axis}{when}: {said['text']}")
    if report["error"]:
        lines.append(f"  ERROR {report['error']}")
    return lines
