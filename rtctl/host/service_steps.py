"""What `rtctl service install` puts where: a list of steps, made before anything is touched."""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path

from hw import registry
from rtctl.errors import ConfigError
from rtctl.host.service_files import named_files, names, rig_file
from rtctl.rig_file.config import LoadedConfig
from rtctl.wire.protocol import rig_directory
from rtctl.wire.unix_group import group_id

UNIT = "rtctl@.service"
NETWORK_DROP_IN = "rtctl-network.conf"
LOOPBACK_DROP_IN = "rtctl-loopback.conf"
OURS = ("10-network.conf", "10-loopback.conf", "20-core.conf", "30-group.conf")
"""Drop-ins of a rig by their names in its folder; what else is there is the administrator's."""

COMPILER = "systemd-run"
"""Program of the step that compiles: it takes a minute and tells how far it is, and an installation goes on
without it."""

HIDDEN = ("/home", "/root", "/run/user", "/tmp", "/var/tmp")
"""Folders that the unit hides from the daemon."""


_GROUP_DROP_IN = """\
# [gateway] group of the rig file: its members reach the rig by the sockets in /run/rtctl.
# The daemon gives it these: @chown.
[Service]
SupplementaryGroups={group}
SystemCallFilter=@chown
# in a user namespace of its own there is no other group
PrivateUsers=no
"""


@dataclass(frozen=True)
class File:
    """A file to write, if it is not there already with this text."""

    path: Path
    content: bytes
    mode: int = 0o644

    @property
    def up_to_date(self) -> bool:
        """Already there, as it should be."""
        try:
            return self.path.read_bytes() == self.content and self.path.stat().st_mode & 0o777 == self.mode
        except OSError:
            return False

    def write(self) -> None:
        """Write it whole, then put it in place."""
        self.path.parent.mkdir(parents=True, exist_ok=True, mode=0o755)
        # a name that systemd and udev do not read
        temporary = self.path.with_name(f".{self.path.name}.new")
        temporary.unlink(missing_ok=True)  # a link there would lead the writing elsewhere
        with os.fdopen(
            os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600), "wb"
        ) as file:
            file.write(self.content)
            os.fchmod(file.fileno(), self.mode)
        temporary.replace(self.path)


@dataclass
class Installation:
    """Everything an installation consists of."""

    name: str
    root: Path
    files: list[File] = field(default_factory=list)
    stale: list[Path] = field(default_factory=list)
    commands: list[list[str]] = field(default_factory=list)

    @property
    def live(self) -> bool:
        """True when it goes into the running system, not into a folder for packaging."""
        return self.root == Path("/")


def shipped(name: str) -> bytes:
    """A file of the folder `systemd/`, in a checkout or in an installed package."""
    package = Path(__file__).parents[1]
    inside = package / "systemd" / name
    return (inside if inside.exists() else package.parent / "systemd" / name).read_bytes()


def unit_text(command: str) -> bytes:
    """The unit, with the command that starts rtctl here in place of /usr/bin/rtctl."""
    return shipped(UNIT).replace(b"/usr/bin/rtctl", command.encode())


def _hidden(place: Path) -> str:
    """The folder that hides a place from the daemon; empty for none."""
    return next((hidden for hidden in HIDDEN if place.is_relative_to(hidden)), "")


def own_command() -> str:
    """How this very rtctl is started. Raises ConfigError when the daemon's user could not reach it."""
    python = Path(sys.executable)
    # the environment's python, what that links to, and the package may lie in three places
    for place in (python, python.resolve(), Path(__file__).resolve()):
        if hidden := _hidden(place):
            raise ConfigError(
                f"{place} lies below {hidden}, which the service cannot see (ProtectHome=yes, "
                "PrivateTmp=yes): install rtctl for all users, then call its own program:\n"
                f"{for_all_users()}"
            )
    return f"{shlex.quote(str(python))} -m rtctl"  # systemd reads quotes as a shell does (systemd.syntax(7))


def install_command(config: Path | None) -> str:
    """The command line that makes the rig of `config` a service here; from elsewhere, where its user could
    not reach rtctl."""
    rig = "RIG.toml" if config is None else shlex.quote(str(config))
    try:
        return f"sudo {own_command()} service install {rig}"
    except ConfigError:
        return "; ".join(line.strip() for line in for_all_users(rig).splitlines())


def for_all_users(rig: str = "RIG.toml") -> str:
    """The commands that install this very rtctl to /opt/rtctl and make `rig` a service, one a line."""
    python = Path(sys.executable).resolve()
    base = "python3" if _hidden(python) else shlex.quote(str(python))
    # by which this rtctl reaches devices, named as their modules: the service needs them, too
    extras = ",".join(name for name in ("can", "serial") if find_spec(name) is not None)
    return (
        f"  sudo {base} -m venv /opt/rtctl\n  sudo /opt/rtctl/bin/python -m pip install "
        f"{shlex.quote(source() + (extras and f'[{extras}]'))}\n"
        f"  sudo /opt/rtctl/bin/rtctl service install {rig}"
    )


def source() -> str:
    """What pip can install this rtctl from: the checkout it runs from, or the file or address it was
    installed from."""
    checkout = Path(__file__).resolve().parents[2]
    if (checkout / "pyproject.toml").is_file():
        return str(checkout)
    try:
        # PEP 610: pip writes it for a folder, file or address, and not for what came from an index
        told = distribution("rtctl").read_text("direct_url.json")
    except PackageNotFoundError:
        told = None
    url = str(json.loads(told)["url"]) if told else ""
    return url.removeprefix("file://") or "RTCTL_WHEEL_OR_CHECKOUT"


def plan(loaded: LoadedConfig, root: Path, command: str, *, start: bool) -> Installation:
    """The installation of a rig.

    Raises
    ------
    ConfigError
        [gateway] group is none of this machine, or a file the rig file names lies outside its folder by a
        relative path, is a link, is no regular file, or has the name of another rig's."""
    name = loaded.config.rig.name
    etc, made = root / "etc", Installation(name, root)
    made.files += [
        File(etc / "systemd/system" / UNIT, unit_text(command)),
        File(etc / "sysusers.d/rtctl.conf", shipped("rtctl.sysusers")),
        File(etc / "udev/rules.d/60-rtctl.rules", shipped("60-rtctl.rules")),
        File(etc / "rtctl" / f"{name}.toml", rig_file(loaded)),
    ]
    for part, content in named_files(loaded):
        file = File(etc / "rtctl" / part, content)
        if other := _loser(name, file, etc / "rtctl"):
            raise ConfigError(
                f"{loaded.path}: {part}: rig {other} would lose its own file of this name there; "
                f"give this one another name (in {etc / 'rtctl'} all rigs have theirs)"
            )
        made.files.append(file)
    drop_in = etc / f"systemd/system/rtctl@{name}.service.d"
    if needs_network(loaded):
        made.files.append(File(drop_in / OURS[0], shipped(NETWORK_DROP_IN)))
    elif needs_loopback(loaded):
        made.files.append(File(drop_in / OURS[1], shipped(LOOPBACK_DROP_IN)))
    if loaded.config.loop.cpu >= 0:
        # all cores: a machine that isolates some gives a service none of these by itself
        cores = f"[Service]\nCPUAffinity=0-{max((os.cpu_count() or 1) - 1, loaded.config.loop.cpu)}\n"
        made.files.append(File(drop_in / OURS[2], cores.encode()))
    if group := loaded.config.gateway.group:
        if made.live:
            group_id(group)  # systemd refuses to start a unit with a group that is not there
        made.files.append(File(drop_in / OURS[3], _GROUP_DROP_IN.format(group=group).encode()))
    # of an earlier rig file: a network, a core or a group that this one does not ask for
    wanted = {file.path for file in made.files}
    made.stale += [path for path in (drop_in / ours for ours in OURS) if path.exists() and path not in wanted]
    if made.live:
        made.commands += [
            ["systemd-sysusers", str(etc / "sysusers.d/rtctl.conf")],
            ["systemctl", "daemon-reload"],
            ["udevadm", "control", "--reload"],
            # devices that are there already
            ["udevadm", "trigger", "--settle", "--subsystem-match=misc", "--subsystem-match=tty"],
        ]
        made.commands.append(compile_command(command, etc / "rtctl" / f"{name}.toml"))
        # last: what it starts needs all that comes before
        made.commands.append(["systemctl", "enable", *(["--now"] if start else []), f"rtctl@{name}.service"])
    return made


def _loser(name: str, file: File, folder: Path) -> str:
    """The rig whose file this one, which rig `name` brings along, would replace; empty for none."""
    part = file.path.relative_to(folder)
    if part == Path(f"{name}.toml"):
        return name
    if not file.path.is_file() or file.path.read_bytes() == file.content:
        return ""
    others = {one.stem: one for one in sorted(folder.glob("*.toml")) if one.stem != name}
    return next((rig for rig, one in others.items() if one == file.path or names(one, part)), "")


def compile_command(command: str, rig: Path) -> list[str]:
    """What compiles for a rig as the service will run it: as its user, in its cache, which systemd makes as
    it does for the service."""
    mode = ["-p", "CacheDirectory=rtctl", "-p", "CacheDirectoryMode=0700", "-p", "UMask=0027"]
    whose = ["-p", "User=rtctl", "-p", "Group=rtctl"]
    how = ["--quiet", "--wait", "--pipe", "--collect", *whose, *mode]
    return [COMPILER, *how, *shlex.split(command), "compile", str(rig)]


def needs_network(loaded: LoadedConfig) -> bool:
    """True when the rig file has a device or an endpoint beyond serial ports and this machine."""
    devices = any(registry.lookup(device.kind).network for device in loaded.config.device)
    return devices or bool(loaded.config.gateway.bind)


def needs_loopback(loaded: LoadedConfig) -> bool:
    """True when it opens a port on 127.0.0.1: the live view, telemetry for viewers."""
    return loaded.config.telemetry.plotjuggler or loaded.config.view is not None


def apply(
    made: Installation, say: Callable[[str], None], run: Callable[[list[str]], None], *, dry_run: bool
) -> None:
    """Carry out the steps, telling each; those already done are left out."""
    for file in made.files:
        if file.up_to_date:
            say(f"unchanged {file.path}")
            continue
        say(f"{'would write' if dry_run else 'write'} {file.path}")
        if not dry_run:
            file.write()
    for path in made.stale:
        say(f"{'would remove' if dry_run else 'remove'} {path}")
        if not dry_run:
            path.unlink()
    for command in made.commands:
        say(f"{'would run' if dry_run else 'run'} {' '.join(command)}")
        if not dry_run:
            run(command)


def removal(name: str, root: Path, *, last: bool, purge: bool) -> tuple[list[list[str]], list[Path]]:
    """Commands and paths that take rig `name` away; `last`: also what all rigs share; `purge`: also its
    data.

    Raises ConfigError for a name that is none: `..` would be the folder of everybody's data."""
    data = rig_directory(name, root / "var/lib/rtctl")
    etc = root / "etc"
    commands = [["systemctl", "disable", "--now", f"rtctl@{name}.service"]] if root == Path("/") else []
    paths = [etc / f"systemd/system/rtctl@{name}.service.d"]
    if purge:
        paths += [etc / "rtctl" / f"{name}.toml", data]
    if last:
        paths += [
            etc / "systemd/system" / UNIT,
            etc / "sysusers.d/rtctl.conf",
            etc / "udev/rules.d/60-rtctl.rules",
            root / "var/cache/rtctl",
            root / "run/rtctl",
        ]
        if purge:
            paths += [etc / "rtctl", root / "var/lib/rtctl"]
    return commands, [path for path in paths if path.exists()]


def installed(root: Path) -> list[str]:
    """Rigs that have a rig file in /etc/rtctl."""
    return sorted(path.stem for path in (root / "etc/rtctl").glob("*.toml"))
