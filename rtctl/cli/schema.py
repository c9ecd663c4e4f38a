"""`rtctl schema`: JSON Schema of the tick record and of the rig file."""

from __future__ import annotations

import click

from rtctl import tick
from rtctl.cli.json_text import json_text


@click.command("schema")
@click.option("--of", "subject", type=click.Choice(["tick", "config"]), default="tick", help="whose schema")
@click.option("--axes", type=click.IntRange(1, 8), default=1, help="axes of the rig")
@click.option(
    "--motion",
    type=click.Choice(["rotary", "linear"]),
    default="rotary",
    help="of the axes: units of m and N in the tick record, keys of m and N in the rig file",
)
@click.option("--json", "as_json", is_flag=True, help="JSON (the default)")
def command(subject: str, axes: int, motion: str, *, as_json: bool) -> None:
    """Print the JSON Schema of the tick record, or of the rig file for an editor."""
    # every command that says something takes the flag, so that a script need not know which
    del as_json
    if subject == "tick":
        click.echo(json_text(tick.json_schema(axes, [motion] * axes), indent=2))
        return
    from rtctl.rig_file.config import Config
    from rtctl.rig_file.linear_keys import schema_of

    click.echo(json_text(schema_of(Config.model_json_schema(), motion), indent=2))
