"""How other makes write a log to disk: one function a layout, and the options a stranger gives
`rtctl identify` for it.

Each takes a log of `other_rigs` and a folder, writes a file as that program does (names, units, header lines,
marks, clocks), and returns the command line.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import datetime, timedelta
from importlib import import_module
from pathlib import Path

import numpy as np
from other_loggers import Log

Layout = Callable[[Log, Path], list[str]]

LAYOUTS: dict[str, Layout] = {}

BEGUN = datetime(2024, 3, 7, 14, 2, 11, 250_000)


def layout(name: str) -> Callable[[Layout], Layout]:
    def put(function: Layout) -> Layout:
        LAYOUTS[name] = function
        return function

    return put


def every_layout() -> dict[str, Layout]:
    """All layouts: those of controllers here, and those of the files beside this one."""
    for beside in ("robots", "data", "exports", "strangers", "carriages", "labs", "instruments"):
        import_module(f"other_layouts_of_{beside}")
    return LAYOUTS


def called(path: Path, *columns: str, more: tuple[str, ...] = ()) -> list[str]:
    """The command line for a file and its columns."""
    return ["--log", str(path), *(word for column in columns for word in ("--column", column)), *more]


def rows_of(*columns: np.ndarray, form: str = "%.7g", between: str = ",", comma: bool = False) -> str:
    text = "\n".join(between.join(form % cell for cell in row) for row in zip(*columns, strict=True))
    return text.replace(".", ",") if comma else text


def write(path: Path, *parts: str, end: str = "\n", encoding: str = "utf-8") -> Path:
    path.write_bytes((end.join("\n".join(parts).split("\n")) + end).encode(encoding))
    return path


def deg(log: Log) -> np.ndarray:
    return np.degrees(log.position)


@layout("TwinCAT Scope, a time for each channel")
def twincat(log: Log, folder: Path) -> list[str]:
    ms = (log.time - log.time[0]) * 1e3
    head = "\n".join(
        [
            "Name\tScope Project\t\t\t\t", "File\tC:\\scope\\axis.csv\t\t\t\t",
            "StartRecord\t133543009312500000\t7. March 2024\t14:02:11\t\t",
            "EndRecord\t133543009612500000\t7. March 2024\t14:02:41\t\t", "",
            "Name\tActPos\tName\tActCurrent\tName\tActVelo",
            "NetId\t192.168.1.20.3.1\tNetId\t192.168.1.20.3.1\tNetId\t192.168.1.20.3.1",
            "Port\t501\tPort\t501\tPort\t501", "SampleTime[ms]\t1\tSampleTime[ms]\t1\tSampleTime[ms]\t1",
            "SymbolName\tAxes.Axis 1.Enc.ActPos\tSymbolName\tAxes.Axis "
            "1.Drive.Current\tSymbolName\tAxes.Axis 1.Enc.ActVelo",
            "Data-Type\tREAL64\tData-Type\tREAL64\tData-Type\tREAL64", "",
        ]
    )  # fmt: skip
    body = rows_of(ms, deg(log), ms, log.current, ms, np.degrees(log.velocity), between="\t", comma=True)
    path = write(folder / "scope.csv", head, body, "EOF", end="\r\n")
    return called(
        path,
        "time=#1:ms",
        "position=ActPos:deg",
        "current=ActCurrent:A",
        more=("--torque-constant", str(log.kt)),
    )


@layout("LabVIEW measurement, decimal comma")
def labview(log: Log, folder: Path) -> list[str]:
    head = "\n".join(
        [
            "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab",
            "Decimal_Separator\t,", "Multi_Headings\tNo",
            "X_Columns\tOne", "Time_Pref\tRelative", "Operator\tlab", "Date\t2024/03/07", "Time\t14:02:11,25",
            "***End_of_Header***\t", "",
            "Channels\t2\t\t", f"Samples\t{len(log.time)}\t{len(log.time)}\t",
            "Date\t2024/03/07\t2024/03/07\t", "Time\t14:02:11,25\t14:02:11,25\t",
            "Y_Unit_Label\tdeg\tN m\t", "X_Dimension\tTime\tTime\t",
            "X0\t0,0000000000000000E+0\t0,0000000000000000E+0\t",
            f"Delta_X\t{0.001:.6f}\t{0.001:.6f}\t".replace(".", ","),
            "***End_of_Header***\t\t\t", "X_Value\tAngle\tTorque\tComment",
        ]
    )  # fmt: skip
    path = write(
        folder / "motion.lvm",
        head,
        rows_of(log.time - log.time[0], deg(log), log.torque, form="%.6f", between="\t", comma=True),
        end="\r\n",
    )
    return called(path, "time=X_Value", "position=Angle:deg", "torque=Torque")


@layout("LabVIEW measurement without times")
def labview_without_times(log: Log, folder: Path) -> list[str]:
    head = "\n".join(
        ["LabVIEW Measurement\t", "Separator\tTab", "X_Columns\tNo", "***End_of_Header***\t", "",
            "Channels\t2\t\t", "Delta_X\t0.001000\t0.001000", "***End_of_Header***\t\t\t",
            "X_Value\tAngle\tTorque\tComment"]
    )  # fmt: skip
    path = write(
        folder / "motion.lvm",
        head,
        "\n".join("\t" + row for row in rows_of(deg(log), log.torque, form="%.6f", between="\t").split("\n")),
        end="\r\n",
    )
    return called(path, "position=Angle:deg", "torque=Torque", more=("--rate-hz", "1000"))


@layout("MATLAB timetable, written as text")
def timetable(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f"{t:.3f} sec,{x:.8g},{tau:.6g}" for t, x, tau in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(folder / "timetable.csv", "Time,theta,tau", rows)
    return called(path, "time=Time", "position=theta", "torque=tau")


@layout("Rockwell trend, date and time in two columns")
def rockwell(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f'"Data","{w:%m/%d/%Y}","{w:%H:%M:%S};{w.microsecond // 1000:03d}",{x:.6f},{tau:.5f}'
        for w, x, tau in (
            (BEGUN + timedelta(seconds=float(t)), x, tau)
            for t, x, tau in zip(log.time, deg(log), log.torque, strict=True)
        )
    )
    head = (
        '"Controller Name:","Cell"\n"Trend Name:","Axis"\n"Total Samples:","30000"\n'
        '"Header:","Date","Time","Axis.ActualPosition","Axis.TorqueReference"'
    )
    path = write(folder / "trend.csv", head, rows, end="\r\n")
    return called(path, "time=Time", "position=Axis.ActualPosition:deg", "torque=Axis.TorqueReference:Nm")


@layout("Elmo recorder, counts and a unit row")
def elmo(log: Log, folder: Path) -> list[str]:
    counts = np.round(log.position / (2 * math.pi) * 65536)
    path = write(
        folder / "elmo.csv",
        "Time,Position [UU],Active Current [A]",
        "sec,counts,A",
        rows_of(log.time, counts, log.current, form="%.8g"),
    )
    return called(
        path,
        "time=Time",
        "position=Position [UU]:counts",
        "current=Active Current [A]",
        more=("--counts-per-rev", "65536", "--torque-constant", str(log.kt)),
    )


@layout("Kollmorgen Workbench, a blank behind each comma")
def kollmorgen(log: Log, folder: Path) -> list[str]:
    body = rows_of(log.time * 1e3, deg(log), log.current * 1e3, form="%.5f", between=", ")
    path = write(folder / "scope.csv", "Workbench recording", "", "Time (ms), PL.FB (deg), IL.FB (mA)", body)
    return called(
        path,
        "time=Time (ms):ms",
        "position=PL.FB (deg):deg",
        "current=IL.FB (mA):mA",
        more=("--torque-constant", str(log.kt)),
    )


@layout("CiA 402, per mille of rated torque")
def cia402(log: Log, folder: Path) -> list[str]:
    share = np.round(log.torque / 2.4 * 1000)
    counts = np.round(log.position / (2 * math.pi) * 65536)
    path = write(
        folder / "trace.csv",
        "t_us;0x6064 position;0x6077 torque actual (0.1%)",
        rows_of(np.round(log.time * 1e6), counts, share, form="%d", between=";"),
    )
    return called(
        path,
        "time=t_us:us",
        "position=0x6064 position:counts",
        "torque=0x6077 torque actual (0.1%):Nm:0.0024",
        more=("--counts-per-rev", "65536"),
    )


@layout("CiA 402, per mille taken for newton-metres")
def cia402_wrong(log: Log, folder: Path) -> list[str]:
    return [word.replace(":Nm:0.0024", "") for word in cia402(log, folder)]


@layout("Siemens trace, German")
def siemens(log: Log, folder: Path) -> list[str]:
    body = rows_of(
        np.arange(len(log.time)),
        np.round(log.time * 1e3, 3),
        deg(log),
        log.torque,
        form="%.6g",
        between=";",
        comma=True,
    )
    path = write(
        folder / "trace.csv",
        "sep=;",
        "Index;Zeit [ms];r2521 Lageistwert [°];r80 Drehmomentistwert [Nm]",
        body,
        encoding="cp1252",
        end="\r\n",
    )
    return called(
        path, "time=Zeit [ms]:ms", "position=r2521 Lageistwert [°]:deg", "torque=r80 Drehmomentistwert [Nm]"
    )


@layout("Simulation Data Inspector, one time for each rate")
def inspector(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f"{t:.6g},{x:.8g},{t:.6g},{tau:.6g}"
        for t, x, tau in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(
        folder / "sdi.csv", "time,theta,time,tau", "Type: double,Type: double,Type: double,Type: double", rows
    )
    return called(path, "time=time", "position=theta", "torque=tau")


@layout("oscilloscope, volts of a torque sensor")
def scope(log: Log, folder: Path) -> list[str]:
    path = write(
        folder / "scope.csv",
        "Model,SDS1104\nRecord Length,30000\nVertical Units,V,V\nSource,CH1,CH2\nSecond,Volt,Volt",
        rows_of(log.time, log.position / 0.5, log.torque / 0.2),
    )
    return called(path, "time=Second:s", "position=#2:rad:0.5", "torque=#3:Nm:0.2")
