"""`rtctl incident`: the ticks around a fault, as text and as a picture."""

from __future__ import annotations

from pathlib import Path

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.outputs import OutputFile


@click.command("incident")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--plot", type=OutputFile(picture=True), help="write a PNG of the signals around the fault")
@click.option("--json", "as_json", is_flag=True, help="one JSON object: about, trigger, events, extremes")
def command(file: Path, plot: Path | None, *, as_json: bool) -> None:
    """Show what led to the incident in FILE (`rtctl events` names the files)."""
    from rtctl.cli.events import line
    from rtctl.recording.incident import read_incident
    from rtctl.recording.incident_report import extremes, summary

    incident = read_incident(file)
    if plot is not None:  # first: a picture that fails must not follow a JSON object with another
        from rtctl.recording.incident_plot import plot_incident

        plot_incident(incident, plot)
    if as_json:
        body = {"about": incident.about, "trigger": incident.trigger, "events": incident.events}
        click.echo(json_text({**body, "ticks": len(incident.ticks), "extremes": extremes(incident)}))
    else:
        click.echo("\n".join(summary(incident)))
        click.echo("\nevents")
        for event in incident.events:
            click.echo(f"  {line(event)}")
        if plot is not None:
            click.echo(f"\npicture: {plot}")
