"""Commands as a person can run them here: with this installation's program, and files that are on this machine."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from pathlib import Path

from rtctl.cli import COMMANDS


def program() -> str:
    """How this rtctl is called from the present folder: by its name where that finds it, else by its path."""
    beside = Path(sys.executable).parent / "rtctl"
    called = Path(sys.argv[0]) if Path(sys.argv[0]).name == "rtctl" else beside
    if not called.is_file():
        return f"{shlex.quote(sys.executable)} -m rtctl"
    found = shutil.which("rtctl")
    if found is not None and Path(found).samefile(called):
        return "rtctl"
    return shown(called)


def shown(path: Path) -> str:
    """A path for a command line: relative below the present folder, quoted where it needs to be."""
    absolute = Path(os.path.abspath(path))  # noqa: PTH100 - the program of a venv is a link, and must stay one
    here = Path.cwd()
    return shlex.quote(str(absolute.relative_to(here) if absolute.is_relative_to(here) else absolute))


_COMMAND = re.compile(rf"(?<![\w/.@-])rtctl (?=(?:{'|'.join(sorted(COMMANDS, key=len, reverse=True))})\b)")


def as_run(text: str) -> str:
    """`text` with every command of rtctl in it as it runs here."""
    called = program()
    return text if called == "rtctl" else _COMMAND.sub(lambda _: f"{called} ", text)
