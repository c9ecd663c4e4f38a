"""`rtctl stop-rig`: make a rig torque-free, whoever runs it or ran it."""

from __future__ import annotations

from pathlib import Path

import click

from rtctl.cli.json_text import end_with


@click.command("stop-rig")
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout")
def command(config: Path, *, as_json: bool) -> None:
    """Open the actuators of CONFIG afresh and make them torque-free.

    For systemd's ExecStopPost, and for a person who finds a daemon dead. No lock is asked for: anybody may
    stop, also a rig that runs (its loop then latches a fault). Exit code 6 when an actuator could not be
    opened and told; simulated devices have no torque to take away."""
    from rtctl.errors import DeviceError
    from rtctl.host.safe_stop import SafeStop
    from rtctl.rig_file.config import load

    # no lock: whoever holds it may be the very process that hangs
    stopped = SafeStop(load(config)).now()
    bad = [one for one in stopped if not one.confirmed]
    if as_json:
        end_with({"ok": not bad, "devices": [one.as_dict() for one in stopped]}, DeviceError if bad else 0)
    for one in stopped:
        if one.confirmed:
            click.echo(one.text())
    if not stopped:
        click.echo("no actuator but simulated ones: nothing to stop")
    if bad:
        raise DeviceError("; ".join(one.text() for one in bad))
