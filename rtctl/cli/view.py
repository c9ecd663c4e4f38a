"""`rtctl view` and `rtctl world`: the live page of a running rig."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any, TypedDict, Unpack

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.rig_argument import reach_options, rig_of

HOST, PORT = "127.0.0.1", 8650
# a page on this machine answers within milliseconds, if it is there
ANSWER_S = 1.0


class _Served(TypedDict):
    """What `_options` gives."""

    rig: str | None
    runtime_dir: Path | None
    address: str | None
    key: Path | None
    host: str | None
    port: int | None
    as_json: bool


def _options(function: Callable[..., Any]) -> Callable[..., Any]:
    for option in reversed(
        (
            reach_options,
            click.option("--host", help="address the page listens on; 127.0.0.1 unless given"),
            click.option(
                "--json", "as_json", is_flag=True, help="the addresses as one JSON object; then it serves"
            ),
            click.option("--port", type=click.IntRange(0, 65535), help="8650 unless given; 0: any free one"),
        )
    ):
        function = option(function)
    return function


@click.command("view")
@_options
def command(**options: Unpack[_Served]) -> None:
    """Show a running rig live in the browser: joint, scope, latency, faults, STOP.

    RIG is its name or rig file; not needed when one runs. The page is for this machine only unless --host
    says otherwise. Anyone who opens it may press STOP; arming needs the operator key that is part of the
    address shown here. Ctrl-C ends the page; the rig runs on. With `view = true` in the rig file the daemon
    shows the page itself, and this only tells its address."""
    _serve("", **options)


@click.command("world")
@_options
def world(**options: Unpack[_Served]) -> None:
    """A virtual world to start from: the environments of the law, a ball to push, in the browser.

    The same server as `rtctl view`, opened at its second page (docs/virtual-world.md)."""
    _serve("world", **options)


def _serve(
    page: str,
    rig: str | None,
    runtime_dir: Path | None,
    address: str | None,
    key: Path | None,
    host: str | None,
    port: int | None,
    *,
    as_json: bool,
) -> None:
    from rtctl.client import RigClient
    from rtctl.client.view_server import ViewServer
    from rtctl.errors import ClientError

    name = "" if address and not rig else rig_of(rig, runtime_dir)
    # who names a port or an address wants a page of their own, whatever the daemon shows
    if port is None and host is None and name and (shown := _shown_by_daemon(name, runtime_dir)):
        url, key_part = shown
        if not as_json:
            click.echo("the daemon shows it already (view = true):")
        _tell(f"{url}{page}", key_part, as_json=as_json)
        return
    host, port = host or HOST, PORT if port is None else port
    with RigClient(name, runtime_dir=runtime_dir, address=address, key=key) as client:
        try:
            server = ViewServer(client, host, port)
        except OSError as error:
            raise ClientError(
                f"cannot listen on {host}:{port}: {error.strerror}; choose another --port"
            ) from error
        _tell(f"{server.url}{page}", f"key={server.key}", as_json=as_json)
        try:
            server.serve_forever(poll_interval=0.2)
        except KeyboardInterrupt:
            click.echo("", err=True)
        finally:
            server.close()


def _tell(address: str, key_part: str, *, as_json: bool) -> None:
    if as_json:
        click.echo(json_text({"operator": f"{address}#{key_part}", "anyone": address}))
        return
    click.echo(f"{address}#{key_part}   (operator: may arm)")
    click.echo(f"{address}   (anyone: may look and STOP)")


def _shown_by_daemon(name: str, runtime_dir: Path | None) -> tuple[str, str] | None:
    """Address of the daemon's own view and its key part, if it answers."""
    from http.client import HTTPConnection, HTTPException

    from hw.outside import json_of
    from rtctl.wire.protocol import VIEW_NAME, client_directory

    try:
        address = (client_directory(name, runtime_dir) / VIEW_NAME).read_text().strip()
        url, _, key_part = address.partition("#")
        # the whole way, not the file alone: what answers there tells its rig
        with closing(HTTPConnection(url.removeprefix("http://").rstrip("/"), timeout=ANSWER_S)) as link:
            # the header that the page's own scripts send: without it the server refuses
            link.request("GET", "/hello", headers={"X-Rtctl": "view"})
            told = json_of(link.getresponse().read())
    except (OSError, ValueError, HTTPException):
        return None
    # a daemon that was killed leaves the file, and another rig's page may have taken its port since
    return (url, key_part) if isinstance(told, dict) and told.get("rig") == name else None
