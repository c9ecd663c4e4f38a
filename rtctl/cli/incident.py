"""`rtctl incident`: the ticks around a fault, as text and as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.outputs import OutputFile

if TYPE_CHECKING:
    from rtctl.recording.incident import Incident


@click.command("incident")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--plot", type=OutputFile(picture=True), help="write a PNG of the signals around the fault")
@click.option("--json", "as_json", is_flag=True, help="one JSON object: about, trigger, events, extremes")
def command(file: Path, plot: Path | None, *, as_json: bool) -> None:
    """Show what led to the incident in FILE (`rtctl events` names the files)."""
    from rtctl.errors import DataError
    from rtctl.recording.incident import read_incident

    incident = read_incident(file)
    try:
        if plot is not None:  # first: a picture that fails must not follow a JSON object with another
            from rtctl.recording.incident_plot import plot_incident

            plot_incident(incident, plot)
        text = _json(incident) if as_json else _text(incident)
    # of a version that is to come, or edited: what it tells is taken as it comes
    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
        raise DataError(f"{file}: an incident that this version cannot tell ({error!r:.200})") from error
    click.echo(text)
    if plot is not None and not as_json:
        click.echo(f"\npicture: {plot}")


def _json(incident: Incident) -> str:
    from rtctl.recording.incident_report import extremes

    body = {"about": incident.about, "trigger": incident.trigger, "events": incident.events}
    return json_text({**body, "ticks": len(incident.ticks), "extremes": extremes(incident)})


def _text(incident: Incident) -> str:
    from rtctl.cli.events import line
    from rtctl.recording.incident_report import summary

    return "\n".join([*summary(incident), "", "events", *(f"  {line(event)}" for event in incident.events)])
