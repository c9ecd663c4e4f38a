"""`rtctl view` and `rtctl world`: the live page of a running rig."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


def _options(function: Callable[..., Any]) -> Callable[..., Any]:
    for option in reversed(
        (
            click.argument("rig", required=False),
            click.option("--runtime-dir", type=click.Path(path_type=Path), help="where the daemon listens"),
            click.option("--address", help="HOST:PORT of a rig on another machine"),
            click.option("--key", type=click.Path(path_type=Path), help="key file for that (rtctl keys new)"),
            click.option(
                "--host", default="127.0.0.1", show_default=True, help="address the page listens on"
            ),
            click.option(
                "--port",
                type=click.IntRange(0, 65535),
                default=8650,
                show_default=True,
                help="0: any free one",
            ),
        )
    ):
        function = option(function)
    return function


@click.command("view")
@_options
def command(**options: Any) -> None:  # noqa: ANN401
    """Show a running rig live in the browser: joint, scope, latency, faults, STOP.

    RIG is its name or rig file; not needed when one runs. The page is for this machine only unless --host says
    otherwise. Anyone who opens it may press STOP; arming needs the operator key that is part of the address
    shown here. Ctrl-C ends the page; the rig runs on.
    """
    _serve("", **options)


@click.command("world")
@_options
def world(**options: Any) -> None:  # noqa: ANN401
    """A virtual world to start from: wall, spring, detents, damper, a ball to push, in the browser.

    The same server as `rtctl view`, opened at its second page (docs/virtual-world.md).
    """
    _serve("world", **options)


def _serve(
    page: str,
    rig: str | None,
    runtime_dir: Path | None,
    address: str | None,
    key: Path | None,
    host: str,
    port: int,
) -> None:
    from rtctl.cli.monitor import only_rig
    from rtctl.cli.rig_argument import rig_name
    from rtctl.client import RigClient
    from rtctl.errors import ClientError
    from rtctl.view.server import ViewServer

    name = rig_name(rig) if rig else ("" if address else only_rig(runtime_dir))
    with RigClient(name, runtime_dir=runtime_dir, address=address, key=key) as client:
        try:
            server = ViewServer(client, host, port)
        except OSError as error:
            raise ClientError(
                f"cannot listen on {host}:{port}: {error.strerror}; choose another --port"
            ) from error
        click.echo(f"{server.url}{page}#key={server.key}   (operator: may arm)")
        click.echo(f"{server.url}{page}   (anyone: may look and STOP)")
        try:
            server.serve_forever(poll_interval=0.2)
        except KeyboardInterrupt:
            click.echo("", err=True)
        finally:
            server.close()
