"""Commands as a person can run them here: with this installation's program, and files that are on this
machine."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

from rtctl.cli.command_table import COMMANDS


def program() -> str:
    """How this rtctl is called from the present folder: by its name where that finds it, else by its path."""
    beside = Path(sys.executable).parent / "rtctl"
    # `python -m rtctl` has a module as its name: the program beside this Python does the same
    called = Path(sys.argv[0]) if Path(sys.argv[0]).name == "rtctl" else beside
    if not called.is_file():
        return f"{shlex.quote(sys.executable)} -m rtctl"
    found = shutil.which("rtctl")
    # else another rtctl comes first in PATH
    if found is not None and Path(found).samefile(called):
        return "rtctl"
    return shown(called)


def shown(path: Path) -> str:
    """A path for a command line: relative below the present folder, quoted where it needs to be."""
    absolute = Path(os.path.abspath(path))  # noqa: PTH100 - the program of a venv is a link, and must stay one
    try:
        here = Path.cwd()
    except FileNotFoundError:  # removed since this process was started in it
        return shlex.quote(str(absolute))
    return shlex.quote(str(absolute.relative_to(here) if absolute.is_relative_to(here) else absolute))


# not in a path or address (`/opt/rtctl`, `rtctl@mock`); the longest name first: `stop-rig` is not `stop`
_COMMAND = re.compile(rf"(?<![\w/.@-])rtctl (?=(?:{'|'.join(sorted(COMMANDS, key=len, reverse=True))})\b)")
_PIP = re.compile(r"(?<!-m )(?<![\w/.-])pip install ")
_EXTRA = re.compile(r"'rtctl\[(\w+)\]'")


def as_run(text: str) -> str:
    """`text` with every command in it as it runs here: this rtctl, the pip of its Python, packages that there
    are."""
    # most texts have neither, and the pattern below is of all commands
    if "rtctl" not in text and "pip install" not in text:
        return text
    text = _EXTRA.sub(lambda found: " ".join(map(shlex.quote, packages_of(found[1]))), text)
    text = _PIP.sub(lambda _: f"{shlex.quote(sys.executable)} -m pip install ", text)
    called = program()
    return text if called == "rtctl" else _COMMAND.sub(lambda _: f"{called} ", text)


def packages_of(extra: str) -> list[str]:
    """What an extra of rtctl asks for: rtctl itself is in no registry of packages."""
    try:
        wanted = requires("rtctl") or []
    except PackageNotFoundError:  # run from a folder that was never installed
        wanted = []
    marker = re.compile(rf"extra == ['\"]{extra}['\"]")
    return [one.partition(";")[0].strip() for one in wanted if marker.search(one)] or [f"rtctl[{extra}]"]
