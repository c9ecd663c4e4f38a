"""`rtctl keys`: who may reach a rig from another machine."""

from __future__ import annotations

from pathlib import Path

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.outputs import OutputFile
from rtctl.wire.protocol import ROLES

_FOLDER = click.option(
    "--dir", "folder", required=True, envvar="RTCTL_KEYS", show_envvar=True, type=click.Path(path_type=Path),
    help="folder of the rig's keys: [gateway] curve_dir of its file"
)  # fmt: skip
_JSON = click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout")


@click.group("keys")
def command() -> None:
    """Make, list and revoke the keys of clients on other machines.

    Each client has a key of its own and a role: an observer reads and may stop the rig; a renderer may also
    hold the lease and move the proxy; an operator may do everything. A running daemon takes up a change
    within a second; revoking a key cuts its connections. Clients of the daemon's own machine use ipc and need
    no key."""


@command.command("new", short_help="make a key for the client NAME")
@click.argument("name")
@click.option("--role", type=click.Choice(ROLES), required=True, help="what the client may do")
@click.option("--out", type=OutputFile(), help="file of the client's secret; default NAME.key")
@_FOLDER
@_JSON
def new(name: str, role: str, out: Path | None, folder: Path, *, as_json: bool) -> None:
    """Make a key for the client NAME; the first one also makes the daemon's own."""
    from rtctl.wire.keys import KeyStore

    # here, not in the folder of keys: it leaves this machine
    path = KeyStore(folder).new(name, role, out or Path(f"{name}.key"))
    if as_json:
        click.echo(json_text({"name": name, "role": role, "out": str(path), "dir": str(folder)}))
        return
    click.echo(f"{path}: secret of {role} {name}. Take it to the client's machine and delete it here;")
    click.echo(f'there: RigClient(address="HOST:PORT", key="{path.name}")')


@command.command("list", short_help="who is let in")
@_FOLDER
@_JSON
def show(folder: Path, *, as_json: bool) -> None:
    """Show who is let in."""
    from rtctl.wire.keys import KeyStore

    store = KeyStore(folder)
    server = store.server()
    keys, faults = store.clients()
    if as_json:
        body = [vars(key) for key in keys.values()]
        click.echo(json_text({"server_key": server.public_key, "keys": body, "unusable": faults}))
        return
    click.echo(f"{'name':<24} {'role':<10} {'made':<21} public key")
    for key in keys.values():
        click.echo(f"{key.name:<24} {key.role:<10} {key.created:<21} {key.public_key}")
    for fault in faults:
        click.echo(f"unusable: {fault}", err=True)


@command.command("revoke", short_help="let the client NAME in no more")
@click.argument("name")
@_FOLDER
@_JSON
def revoke(name: str, folder: Path, *, as_json: bool) -> None:
    """Let the client NAME in no more; a running daemon cuts its connections within a second."""
    from rtctl.wire.keys import KeyStore

    key = KeyStore(folder).revoke(name)
    click.echo(json_text({"revoked": vars(key)}) if as_json else f"revoked {key.role} {key.name}")
