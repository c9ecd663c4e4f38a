"""Layouts of which a stranger was told something else than was wrong, or that were not read although they say
all (`other_layouts`).
"""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from other_layouts import called, deg, layout, rows_of, write
from other_loggers import Log


def stamped(log: Log, folder: Path, stamps: list[str], name: str = "t") -> Path:
    rows = rows_of(log.position, log.torque).splitlines()
    lines = (f"{stamp},{row}" for stamp, row in zip(stamps, rows, strict=True))
    return write(folder / "log.csv", f"{name},q,tau", *lines)


@layout("no time, and no rate given")
def no_time(log: Log, folder: Path) -> list[str]:
    path = write(folder / "log.csv", "q,tau", rows_of(log.position, log.torque))
    return called(path, "position=q", "torque=tau")


@layout("no time in an npz, and no rate given")
def no_time_in_npz(log: Log, folder: Path) -> list[str]:
    np.savez(folder / "log.npz", q=log.position, tau=log.torque)
    return called(folder / "log.npz", "position=q", "torque=tau")


@layout("a row for each signal, asked for by their names")
def long_by_name(log: Log, folder: Path) -> list[str]:
    rows = (
        f"{t:.6f},q,{x:.7g}\n{t:.6f},tau,{u:.7g}"
        for t, x, u in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(folder / "long.csv", "time,signal,value", *rows)
    return called(path, "time=time", "position=q", "torque=tau")


@layout("a row for each signal in an npz, asked for by their names")
def long_in_npz(log: Log, folder: Path) -> list[str]:
    named = np.tile(["q", "tau"], len(log.time))
    value = np.column_stack([log.position, log.torque]).ravel()
    np.savez(folder / "long.npz", time=np.repeat(log.time, 2), signal=named, value=value)
    return called(folder / "long.npz", "time=time", "position=q", "torque=tau")


@layout("TwinCAT Scope 3, an empty row below the settings")
def scope_3(log: Log, folder: Path) -> list[str]:
    head = (
        "Name;Pos;Name;Trq\nData-Type;LREAL;Data-Type;INT16\nUnit;°;Unit;Nm\nScaleFactor;1;ScaleFactor;1\n;;;"
    )
    ms = log.time * 1e3
    path = write(
        folder / "s.csv", head, rows_of(ms, deg(log), ms, log.torque, form="%.9g", between=";", comma=True)
    )
    return called(path, "time=#1:ms", "position=Pos:deg", "torque=Trq")


@layout("durations of pandas")
def durations(log: Log, folder: Path) -> list[str]:
    start = timedelta(hours=23, minutes=59, seconds=55)
    stamps = []
    for t in log.time:
        days, seconds = divmod((start + timedelta(seconds=round(float(t), 6))).total_seconds(), 86400)
        minutes, second = divmod(seconds, 60)
        stamps.append(f"{days:.0f} days {minutes // 60:02.0f}:{minutes % 60:02.0f}:{second:09.6f}")
    return called(stamped(log, folder, stamps), "time=t", "position=q", "torque=tau")


@layout("a name that says hours, minutes and seconds")
def named_hours(log: Log, folder: Path) -> list[str]:
    stamps = [f"14:02:{t:09.6f}" for t in log.time]
    name = "Time [hh:mm:ss.f]"
    return called(stamped(log, folder, stamps, name), f"time={name}", "position=q", "torque=tau")


@layout("a night in which summer time ends, without zones")
def summer_ends(log: Log, folder: Path) -> list[str]:
    half, began = len(log.time) // 2, datetime(2026, 10, 25, 2, 59, 57)
    stamps = [
        f"{began + timedelta(seconds=round(float(t), 6) - 3600 * (k >= half)):%Y-%m-%d %H:%M:%S.%f}"
        for k, t in enumerate(log.time)
    ]
    return called(stamped(log, folder, stamps), "time=t", "position=q", "torque=tau")


@layout("ros2 topic echo as it is shown")
def echo(log: Log, folder: Path) -> list[str]:
    shown = "header:\n  stamp:\n    sec: {}\nposition:\n- {}\neffort:\n- {}\n---"
    rows = (shown.format(*row) for row in zip(range(50), log.position, log.torque, strict=False))
    return called(write(folder / "echo.txt", *rows), "time=sec", "position=position", "torque=effort")
