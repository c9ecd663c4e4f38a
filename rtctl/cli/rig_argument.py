"""CONFIG|RIG: how every command that talks to a rig is told which one, and how it gets there."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from hw.outside import read_toml, shown
from rtctl.errors import ClientError, ConfigError

if TYPE_CHECKING:
    from rtctl.client import RigClient


def _complete(_ctx: click.Context, _param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The rigs that run here, then files."""
    from rtctl.wire.protocol import running_rigs

    rigs = [CompletionItem(name) for name in running_rigs(None) if name.startswith(incomplete)]
    return [*rigs, CompletionItem(incomplete, type="file")]


def rig_argument(function: Callable[..., Any]) -> Callable[..., Any]:
    """The argument `rig`: a rig file, the name of a rig, or nothing where one runs."""
    return click.argument("rig", metavar="[CONFIG|RIG]", required=False, shell_complete=_complete)(function)


def runtime_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """The option `--runtime-dir`."""
    return click.option(
        "--runtime-dir",
        type=click.Path(path_type=Path),
        help="where the daemon listens, instead of the default",
    )(function)


def reach_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """`rig` and the options by which a rig is reached, here or on another machine: what `connect` takes."""
    # the last one wrapped around a command stands first in its help
    for option in (
        click.option("--key", type=click.Path(path_type=Path), help="key file for that (rtctl keys new)"),
        click.option("--address", help="HOST:PORT of a rig on another machine"),
        runtime_option,
        rig_argument,
    ):
        function = option(function)
    return function


def connect(rig: str | None, runtime_dir: Path | None, address: str | None, key: Path | None) -> RigClient:
    """A client of the rig that was named. Raises ClientError where none runs, or several and none was
    named."""
    from rtctl.client import RigClient

    # over TCP the address says which rig it is
    name = "" if address and not rig else rig_of(rig, runtime_dir)
    return RigClient(name, runtime_dir=runtime_dir, address=address, key=key)


def rig_of(rig: str | None, runtime_dir: Path | None = None) -> str:
    """Name of the rig of the argument: the only one that runs where it was left out."""
    return rig_name(rig) if rig else only_rig(runtime_dir)


def only_rig(runtime_dir: Path | None) -> str:
    """The one rig that runs on this machine."""
    from rtctl.wire.protocol import running_rigs, runtime_root

    running = running_rigs(runtime_dir)
    if not running:
        raise ClientError(
            f"no daemon runs (looked in {runtime_dir or runtime_root()}); start one with: rtctl run CONFIG"
        )
    # never the first of several: a stop must not go to another rig than the one that is meant
    if len(running) > 1:
        raise ClientError(f"several rigs run: name one of {', '.join(running)}")
    return running[0]


def is_rig_file(rig: str) -> bool:
    """Whether the argument is a rig file, and not the name of a rig."""
    if rig.endswith(".toml"):
        return True
    # pathlib tells of a name of 300 letters, or below a folder that is not for this user, by raising
    with suppress(OSError):
        return Path(rig).is_file()
    return False


def rig_name(rig: str) -> str:
    """Name of the rig: read from its file when `rig` is one, without judging the rest. Raises ConfigError."""
    path = Path(rig)
    if not is_rig_file(rig):
        return rig
    try:
        # not `load`: a file that was spoilt since must not keep anybody from stopping its rig
        table = read_toml(path).get("rig")
    except OSError as error:
        raise ConfigError(f"{rig}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"{rig}: not TOML: {shown(error)}") from error
    name = table.get("name") if isinstance(table, dict) else None
    if not isinstance(name, str):
        raise ConfigError(f"{rig}: [rig] name is missing; it names the rig to ask")
    return name
