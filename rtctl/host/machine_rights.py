"""Real-time rights: as this shell has them, and as systemd would grant them to the service."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rtctl.host.machine_line import Line, text

UNIT = "rtctl@.service"
UNIT_FOLDERS = (
    "etc/systemd/system",
    "run/systemd/system",
    "usr/local/lib/systemd/system",
    "usr/lib/systemd/system",
    "lib/systemd/system",
)
_SYS_NICE, _IPC_LOCK = 23, 14  # numbers of linux/capability.h
_NEEDED_LOCK = 512 * 1024 * 1024
"""Locked memory a rig needs at most (arrays, code, libraries): below it, mlockall is refused or the loop
dies."""


INSTALL = "sudo rtctl service install RIG.toml"
"""What gives a rig all rights it needs: as a service, by a user of its own."""


def check(root: Path, rig: str, priority: int, install: str = INSTALL) -> list[Line]:
    """Who runs this, and limits of the shell and of the unit of `rig` (or of any rig, when empty).

    `install` is the command that makes the rig a service on this machine."""
    return [*user(root, install), *shell(root, priority, install), *service(root, rig, priority, install)]


def user(root: Path, install: str = INSTALL) -> Iterator[Line]:
    """Whether this is root: nothing of rtctl needs that but installing the service."""
    for line in (text(root / "proc/self/status") or "").splitlines():
        # real, effective, saved, file system (proc(5)): the effective one counts
        if line.startswith("Uid:") and line.split()[2:3] == ["0"]:
            fix = (
                "work as an ordinary user of group dialout (sudo usermod -aG dialout NAME, log in again); "
                f"real-time rights come with the service: {install}"
            )
            yield Line(
                "user", "warn", "root: a fault of any program part may then change the whole machine", fix
            )


def shell(root: Path, priority: int, install: str = INSTALL) -> list[Line]:
    """What a daemon started from this shell gets."""
    limits, held = _limits(root), _capabilities(root)
    rtprio, memlock = limits.get("Max realtime priority", 0.0), limits.get("Max locked memory", 0.0)
    where = f"as a service it has them: {install}; in this shell log in again after: "
    out = []
    if held >> _SYS_NICE & 1:  # it allows any priority, whatever RLIMIT_RTPRIO says (sched(7))
        out.append(Line("shell rtprio", "ok", "any (CAP_SYS_NICE)"))
    elif rtprio >= priority:
        out.append(Line("shell rtprio", "ok", f"{rtprio:g}, the loop asks {priority}"))
    else:
        fix = f"echo '@realtime - rtprio {priority}' | sudo tee -a /etc/security/limits.d/rtctl.conf"
        out.append(
            Line("shell rtprio", "warn", f"{rtprio:g}, the loop asks {priority}", where + fix + _GROUP)
        )
    if held >> _IPC_LOCK & 1:
        out.append(Line("shell memlock", "ok", "unlimited (CAP_IPC_LOCK)"))
    elif memlock >= _NEEDED_LOCK:
        out.append(Line("shell memlock", "ok", _bytes(memlock)))
    else:
        fix = "echo '@realtime - memlock unlimited' | sudo tee -a /etc/security/limits.d/rtctl.conf"
        out.append(Line("shell memlock", "warn", _bytes(memlock), where + fix + _GROUP))
    return out


_GROUP = " && sudo groupadd -f realtime && sudo usermod -aG realtime $USER"


def service(root: Path, rig: str, priority: int, install: str = INSTALL) -> list[Line]:
    """What systemd would grant: the installed unit with its drop-ins."""
    # by its files, not by `systemctl show`: that tells of units that are loaded, on a machine that runs
    # systemd
    settings = unit_settings(root, rig)
    if settings is None:
        return [Line("service unit", "warn", f"{UNIT} is not installed", install)]
    edit = f"{install} (puts the unit right), or sudo systemctl edit {UNIT}: [Service] "
    out = [Line("service unit", "ok", settings.get("", UNIT))]
    rtprio = _limit(settings.get("LimitRTPRIO", "0"))
    right = rtprio >= priority
    out.append(
        Line(
            "service rtprio",
            "ok" if right else "fail",
            f"LimitRTPRIO={settings.get('LimitRTPRIO', '0')}, the loop asks {priority}",
            "" if right else f"{edit}LimitRTPRIO={priority}",
        )
    )
    # systemd's own default
    memlock = _limit(settings.get("LimitMEMLOCK", "8M"))
    right = memlock >= _NEEDED_LOCK
    out.append(
        Line(
            "service memlock",
            "ok" if right else "fail",
            f"LimitMEMLOCK={settings.get('LimitMEMLOCK', '8M (default)')}",
            "" if right else f"{edit}LimitMEMLOCK=infinity",
        )
    )
    return out


def unit_settings(root: Path, rig: str) -> dict[str, str] | None:
    """Settings of the unit's [Service] section with drop-ins applied; the file's path under "". None: no
    unit."""
    main = next((path for folder in UNIT_FOLDERS if (path := root / folder / UNIT).is_file()), None)
    if main is None:
        return None
    found = {"": "/" + main.relative_to(root).as_posix()}
    for path in [main, *_drop_ins(root, rig)]:
        found.update(_service_section(path))
    return found


def _drop_ins(root: Path, rig: str) -> list[Path]:
    """In the order systemd applies them: by file name, the folder of higher rank winning."""
    names = [f"{UNIT}.d"] + ([f"rtctl@{rig}.service.d"] if rig else [])
    by_name: dict[str, Path] = {}
    for folder in reversed(UNIT_FOLDERS):
        for name in names:  # lowest rank first, so that a file of higher rank takes the place of its namesake
            for path in sorted((root / folder / name).glob("*.conf")):
                by_name[path.name] = path
    return [by_name[name] for name in sorted(by_name)]


def _service_section(path: Path) -> Iterator[tuple[str, str]]:
    section = ""
    for line in (text(path) or "").splitlines():
        stripped = line.strip()
        if stripped.startswith("["):
            section = stripped
        # both begin a comment (systemd.syntax(7))
        elif section == "[Service]" and "=" in stripped and stripped[0] not in "#;":
            key, _, value = stripped.partition("=")
            yield key.strip(), value.strip()


def _limit(value: str) -> float:
    """A systemd limit: the soft one of `soft:hard`; infinity; K, M, G, T. 0 when it is not one."""
    soft = value.partition(":")[0].strip()
    if soft == "infinity":
        return float("inf")
    scale = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}.get(soft[-1:].upper(), 0)
    digits = soft[:-1] if scale else soft
    return float(digits) * (scale or 1) if digits.isdigit() else 0.0


def _limits(root: Path) -> dict[str, float]:
    """Soft limits of this process from /proc/self/limits."""
    out = {}
    for line in (text(root / "proc/self/limits") or "").splitlines()[1:]:
        # the kernel pads names to a fixed width, and they hold spaces themselves
        name, rest = line[:26].strip(), line[26:].split()
        if rest:
            out[name] = float("inf") if rest[0] == "unlimited" else float(rest[0])
    return out


def _capabilities(root: Path) -> int:
    for line in (text(root / "proc/self/status") or "").splitlines():
        if line.startswith("CapEff:"):
            return int(line.split()[1], 16)
    return 0


def _bytes(number: float) -> str:
    return "unlimited" if number == float("inf") else f"{number / (1 << 20):g} MiB"
