"""Layouts of linear axes: stages, gantries and linear motors in mm, um, N and kgf (`other_layouts`).

The joint of the log, seen from a handle at `LEVER_M`, is the carriage. Header lines are those of the vendors'
documents: Beckhoff's page on the export of Scope 2, Panasonic's on traces, CODESYS' on its trace in ASCII,
Maxon's EPOS Studio as in `../shared/data/screw_drives`; names of columns are a user's.
"""

from __future__ import annotations

import math
from datetime import timedelta
from pathlib import Path

import numpy as np
from other_layouts import BEGUN, called, layout, rows_of, write
from other_loggers import Log

LEVER_M = 0.1
LEAD_M = 0.005


def mm(log: Log) -> np.ndarray:
    return 1e3 * LEVER_M * log.position


def newton(log: Log) -> np.ndarray:
    return log.torque / LEVER_M


def screw(log: Log) -> tuple[np.ndarray, np.ndarray]:
    """Turns of a screw, and the torque on it, N m."""
    return LEVER_M * log.position / LEAD_M, newton(log) * LEAD_M / (2 * math.pi)


@layout("carriage: TwinCAT Scope 2, a time for each channel")
def scope_2(log: Log, folder: Path) -> list[str]:
    head = "\n".join(
        [
            "Name\tScope01", "File\t",
            "StartRecord\t128783093223690000\tDonnerstag, 5. Februar 2009\t13:08:42",
            "EndRecord\t128783093339880000\tDonnerstag, 5. Februar 2009\t13:08:53", "",
            "Name\tActPos\tName\tActForce", "NetId\t172.16.8.205.1.1\tNetId\t172.16.8.205.1.1",
            "Port\t801\tPort\t801", "SampleTime[ms]\t1\tSampleTime[ms]\t1",
            "SymbolBased\tTRUE\tSymbolBased\tTRUE", "SymbolName\tMAIN.X\tSymbolName\tMAIN.F",
            "SymbolComment\t\tSymbolComment\t", "IndexGroup\t16448\tIndexGroup\t16448",
            "IndexOffset\t608\tIndexOffset\t612", "Data-Type\tADST_REAL32\tData-Type\tADST_REAL32",
            "VariableSize\t4\tVariableSize\t4", "",
        ]
    )  # fmt: skip
    ms = np.round((log.time - log.time[0]) * 1e3)
    body = rows_of(ms, mm(log), ms, newton(log), form="%.9g", between="\t", comma=True)
    path = write(folder / "scope.csv", head, body, end="\r\n")
    return called(path, "time=#1:ms", "position=#2:mm", "torque=#4:N")


@layout("carriage: EPOS Studio, the screw's motor")
def epos(log: Log, folder: Path) -> list[str]:
    turns, on_screw = screw(log)
    head = "Date:;2020-07-10 20:12:00\nFirmware Version:;0x0120;0x6150\nEPOS Studio Version:;3.6.1.0"
    names = "Time [ms];Position actual value [inc];Torque actual value averaged [mNm]"
    counts = np.round(turns * 4096)
    body = rows_of(1e3 * log.time, counts, 1e3 * on_screw, form="%.7g", between=";")
    path = write(folder / "epos.csv", head, names, body)
    return called(
        path,
        "time=Time [ms]:ms",
        "position=Position actual value [inc]:counts",
        "torque=Torque actual value averaged [mNm]:mNm",
        more=("--counts-per-rev", "4096", "--lead-m", str(LEAD_M)),
    )


@layout("carriage: kilograms of a load cell, told their scale")
def load_cell(log: Log, folder: Path) -> list[str]:
    path = write(
        folder / "cell.csv",
        "Time (s),Displacement (mm),Force (kgf)",
        rows_of(log.time, mm(log), newton(log) / 9.80665),
    )
    return called(path, "time=Time (s)", "position=Displacement (mm):mm", "torque=Force (kgf):N:9.80665")


@layout("carriage: kilograms of a load cell, taken for newtons")
def load_cell_wrong(log: Log, folder: Path) -> list[str]:
    return [word.replace(":9.80665", "") for word in load_cell(log, folder)]


@layout("carriage: kN in the header, taken for newtons")
def kilonewtons(log: Log, folder: Path) -> list[str]:
    path = write(
        folder / "press.csv",
        "Zeit;Weg;Kraft\ns;mm;kN",
        rows_of(log.time, mm(log), newton(log) / 1e3, between=";", comma=True),
    )
    return called(path, "time=Zeit", "position=Weg:mm", "torque=Kraft:N")


@layout("carriage: kN, read as that")
def kilonewtons_read(log: Log, folder: Path) -> list[str]:
    return [word.replace("Kraft:N", "Kraft:kN") for word in kilonewtons(log, folder)]


@layout("carriage: micrometres of a nano stage, no times")
def nano_stage(log: Log, folder: Path) -> list[str]:
    head = (
        "# REM\n# VERSION = 1\n# TYPE = 1\n# SEPARATOR = 32\n# DIM = 2\n# SAMPLE_TIME = 0.001\n"
        f"# NDATA = {len(log.time)}\n# NAME0 = Actual Position of Axis 1\n# NAME1 = Motor Output of Axis 1\n"
        "# END_HEADER"
    )
    path = write(folder / "gcs.dat", head, rows_of(1e3 * mm(log), 1e3 * newton(log), between=" "))
    return called(path, "position=#1:um", "torque=#2:mN", more=("--rate-hz", "1000"))


@layout("carriage: Panasonic trace, six lines of header")
def panasonic(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f"{w:%Y/%m/%d},{w:%H:%M:%S}.{w.microsecond // 1000:03d},{x:.6f},{f:.5f}"
        for w, x, f in (
            (BEGUN + timedelta(seconds=float(t)), x, f)
            for t, x, f in zip(log.time, mm(log), newton(log), strict=True)
        )
    )
    head = "Date,Time,DT100,DT102\n,,Position,Thrust\n,,axis X,axis X\n,,FLT,FLT\n,,mm,N"
    path = write(folder / "trace.csv", head, rows, end="\r\n", encoding="utf-8-sig")
    return called(path, "time=Time", "position=DT100:mm", "torque=DT102:N")


@layout("carriage: CODESYS trace in ASCII")
def codesys(log: Log, folder: Path) -> list[str]:
    head = "BODAS Trace\nD:\\PROJECTS\\GANTRY.PRO\nCycle PLC_PRG.ActPos PLC_PRG.ActForce"
    ms = np.round(1e3 * log.time)
    path = write(folder / "trace.txt", head, rows_of(ms, mm(log), newton(log), form="%.9g", between=" "))
    return called(path, "time=Cycle:ms", "position=PLC_PRG.ActPos:mm", "torque=PLC_PRG.ActForce:N")


@layout("carriage: a Japanese drive, rated thrust in per cent")
def rated_thrust(log: Log, folder: Path) -> list[str]:
    path = write(
        folder / "trace.csv",
        "時間[ms],位置[mm],推力指令[%]",
        rows_of(1e3 * log.time, mm(log), 100 * newton(log) / 48.0),
        encoding="cp932",
    )
    return called(path, "time=時間[ms]:ms", "position=位置[mm]:mm", "torque=推力指令[%]:N:0.48")


@layout("carriage: current of a linear motor, counts of a scale")
def linear_motor(log: Log, folder: Path) -> list[str]:
    counts = np.round(1e3 * mm(log) / 0.5)  # a scale of .5 um
    path = write(
        folder / "motor.csv", "t_ms,Encoder_counts,Iq_A", rows_of(1e3 * log.time, counts, log.current)
    )
    return called(
        path,
        "time=t_ms:ms",
        "position=Encoder_counts:mm:0.0005",
        "current=Iq_A",
        more=("--torque-constant", str(log.kt / LEVER_M)),
    )


@layout("carriage: inches and pounds, told their scales")
def inches(log: Log, folder: Path) -> list[str]:
    path = write(
        folder / "log.csv",
        "Time,Stroke (in),Load (lbf)",
        rows_of(log.time, mm(log) / 25.4, newton(log) / 4.448222),
    )
    return called(path, "time=Time", "position=Stroke (in):mm:25.4", "torque=Load (lbf):N:4.448222")


@layout("carriage: millimetres and newton-metres")
def both_motions(log: Log, folder: Path) -> list[str]:
    path = write(folder / "log.csv", "t,x_mm,tau_nm", rows_of(log.time, mm(log), log.torque))
    return called(path, "time=t", "position=x_mm:mm", "torque=tau_nm:Nm")


@layout("carriage: a Chinese table, columns by their places")
def by_place(log: Log, folder: Path) -> list[str]:
    body = rows_of(1e3 * log.time, mm(log), newton(log), between="\t")
    path = write(folder / "log.txt", "时间/ms\t位移/mm\t推力/N", body, encoding="gb18030")
    return called(path, "time=#1:ms", "position=#2:mm", "torque=#3:N")
