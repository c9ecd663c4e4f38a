"""Versions, and whether rig file, friction models and coupling are fit to run."""

from __future__ import annotations

import shlex
import sys

from rtctl.check import law_plan as plan
from rtctl.check import stability_report
from rtctl.errors import ConfigError, ModelError
from rtctl.host.machine_line import Line
from rtctl.rig_file.config import LoadedConfig, load

PYTHON_LEAST = (3, 11)
# what the wheels of pyzmq 26 bring, which pyproject.toml asks for
LIBZMQ_LEAST = (4, 3, 5)


def versions(python: tuple[int, ...], libzmq: tuple[int, ...], *, curve: bool) -> list[Line]:
    """Whether the libraries are new enough."""
    out = [_version("python", python, PYTHON_LEAST, "install a newer one, make the environment again")]
    out.append(_version("libzmq", libzmq, LIBZMQ_LEAST, "pip install -U 'pyzmq>=26'"))
    if not curve:
        fix = "pip install -U --force-reinstall pyzmq (its wheels have it)"
        out.append(Line("libzmq CURVE", "warn", "built without it: the rig cannot be reached by TCP", fix))
    return out


def installed() -> list[Line]:
    """Lines of `versions` for this process."""
    import zmq

    return versions(sys.version_info[:3], zmq.zmq_version_info(), curve=bool(zmq.has("curve")))


def _version(name: str, found: tuple[int, ...], least: tuple[int, ...], fix: str) -> Line:
    shown = ".".join(map(str, found))
    if found >= least:
        return Line(name, "ok", shown)
    return Line(name, "fail", f"{shown}, needs {'.'.join(map(str, least))}", fix)


def rig_file(path: str) -> tuple[LoadedConfig | None, list[Line]]:
    """Load a rig file; every fault of it is a line."""
    try:
        loaded = load(path)
    except ConfigError as error:
        # a file that is no TOML has no faults, only that
        texts = error.faults or (str(error),)
        return None, [
            Line("rig file", "fail", text, f"correct it, then: rtctl check {shlex.quote(path)}")
            for text in texts
        ]
    return loaded, [Line("rig file", "ok", f"{loaded.path}, rig {loaded.config.rig.name}")]


def model(loaded: LoadedConfig) -> list[Line]:
    """Whether the friction models are whole and this rig's own, and the coupling provably passive."""
    try:
        plan.build(loaded)
        report = stability_report.examine(loaded, telling=False)
    except ModelError as error:
        return [
            Line("friction model", "fail", str(error), "identify the rig again: rtctl identify, rtctl fit")
        ]
    named = [axis.friction.model for axis in loaded.config.axis if axis.friction.model]
    out = [Line("friction model", "ok", ", ".join(named) or "none named")]
    if report.ok:
        out.append(Line("stability", "ok", "coupling provably passive"))
    else:
        out.append(
            Line("stability", "fail", report.refusal(), f"rtctl check {shlex.quote(str(loaded.path))}")
        )
    return out
