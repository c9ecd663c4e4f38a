"""The example package as if pip had installed it: its folder and the metadata pip would write, on the
path.
"""

from __future__ import annotations

import importlib
import os
import sys
import tomllib
from contextlib import contextmanager
from pathlib import Path

from hw import registry

FOLDER = Path(__file__).parents[2] / "docs" / "example-backend"
KIND = "udp-board"


def write_metadata(target, kind=KIND):
    """What an installer makes of `pyproject.toml`, with this name for the backend."""
    project = tomllib.loads((FOLDER / "pyproject.toml").read_text())["project"]
    name = project["name"].replace("-", "_") + kind.removeprefix(KIND)
    info = Path(target) / f"{name}-{project['version']}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {project['version']}\n")
    lines = [
        line
        for group, entries in project["entry-points"].items()
        for line in (f"[{group}]", *(f"{kind} = {value}" for value in entries.values()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")


def python_path(target):
    """PYTHONPATH for child processes."""
    return os.pathsep.join([str(FOLDER), str(target), os.environ.get("PYTHONPATH", "")])


@contextmanager
def installed(target, kind=KIND):
    """Within it, this process and its children find the package. Another `kind` is one that nobody has
    installed.
    """
    write_metadata(target, kind)
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = python_path(target)
    sys.path[:0] = [str(FOLDER), str(target)]
    importlib.invalidate_caches()
    try:
        yield
    finally:
        for entry in (str(FOLDER), str(target)):
            sys.path.remove(entry)
        if before is None:
            del os.environ["PYTHONPATH"]
        else:
            os.environ["PYTHONPATH"] = before
        registry.lookup.cache_clear()


_boards = []


def board():
    """A new simulated board; `close_all` ends it."""
    simulator = importlib.import_module("rtctl_udp_board.simulator")
    _boards.append(simulator.Board())
    return _boards[-1]


def close_all():
    while _boards:
        _boards.pop().close()
