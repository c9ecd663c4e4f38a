"""One line of the doctor's report."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

Status = Literal["ok", "warn", "fail"]


@dataclass(frozen=True)
class Line:
    """One thing looked at.

    Attributes
    ----------
    check
        What was looked at.
    status
        `fail`: the rig will refuse to run, or be unsafe or useless. `warn`: it runs, less well.
    found
        What is there.
    fix
        The command or the line of a file that puts it right; empty when it is right."""

    check: str
    status: Status
    found: str
    fix: str = ""

    def as_dict(self) -> dict[str, str]:
        """Plain values for JSON."""
        return asdict(self)


def text(path: Path) -> str | None:
    """Content of a small file, stripped; None when it cannot be read."""
    try:
        # replaced: files of /proc hold names of programs, which need not be UTF-8
        return path.read_text(errors="replace").strip()
    except OSError:
        return None


def is_rtctl(root: Path, pid: int) -> bool:
    """Whether a process is one of rtctl, by its program or module, or by its name where that is hidden: a
    stranger's program may lie in a folder called rtctl."""
    folder = root / "proc" / str(pid)
    words = (text(folder / "cmdline") or text(folder / "comm") or "").split("\0")
    # the program, the script or module that it runs, and options of Python before that
    return any(Path(word).name in ("rtctl", "rtctl.rt") for word in words[:4])
