"""How recorders of drives, test benches and data bases write a log (`other_layouts`), each with what is odd
about it: a time for each channel, indices in brackets, lists in cells, stamps of a block, remarks.
"""

from __future__ import annotations

import math
from datetime import timedelta
from pathlib import Path

import numpy as np
from other_layouts import BEGUN, called, deg, layout, rows_of, write
from other_loggers import Log

NS = 1_709_820_131_250_000_000


def rpm(log: Log) -> np.ndarray:
    return log.velocity * 30 / math.pi


@layout("LabVIEW measurement, multi headings: a time for each channel")
def multi_headings(log: Log, folder: Path) -> list[str]:
    t = log.time - log.time[0]
    head = "\n".join(
        ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t.",
         "Multi_Headings\tYes", "X_Columns\tMulti", "Time_Pref\tAbsolute", "***End_of_Header***\t", "",
         "Channels\t3\t\t\t\t", f"Samples\t{len(t)}\t\t{len(t)}\t\t{len(t)}",
         "Y_Unit_Label\tdeg\t\tmNm\t\trpm",
         "X_Dimension\tTime\t\tTime\t\tTime", "***End_of_Header***\t\t\t\t\t",
         "X_Value\tAngle\tX_Value\tTorque\tX_Value\tSpeed\tComment"]
    )  # fmt: skip
    body = rows_of(t, deg(log), t, 1e3 * log.torque, t, rpm(log), form="%.6f", between="\t")
    path = write(folder / "multi.lvm", head, body.replace("\n", "\t\n") + "\t", end="\r\n")
    return called(path, "time=#1", "position=Angle:deg", "torque=Torque:mNm", "velocity=Speed:rpm")


@layout("rostopic echo -p, nanoseconds since 1970 under a % sign")
def rostopic(log: Log, folder: Path) -> list[str]:
    names = "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.name0,field.position0"
    rows = (
        f"{NS + round(t * 1e9) + 41_000},{k},{NS + round(t * 1e9)},,elbow,{x:.12g},{v:.9g},{tau:.9g}"
        for k, (t, x, v, tau) in enumerate(zip(log.time, log.position, log.velocity, log.torque, strict=True))
    )
    path = write(folder / "joint.csv", f"{names},field.velocity0,field.effort0", *rows)
    return called(
        path,
        "time=field.header.stamp:ns",
        "position=field.position0",
        "velocity=field.velocity0",
        "torque=field.effort0",
    )


@layout("ulog2csv of PX4, indices in brackets")
def px4(log: Log, folder: Path) -> list[str]:
    us, zero = np.round(log.time * 1e6) + 83_112_407, np.zeros(len(log.time))
    rows = rows_of(us, us - 212, zero, log.position, zero, log.torque, form="%.10g")
    head = "timestamp,timestamp_sample,angle[0],angle[1],torque[0],torque[1]"
    path = write(folder / "log_0_joint_0.csv", head, rows)
    return called(path, "time=timestamp:us", "position=angle[1]:rad", "torque=torque[1]:Nm")


@layout("a bag as csv, lists in quoted cells")
def lists_in_cells(log: Log, folder: Path) -> list[str]:
    rows = (
        f'{NS + round(t * 1e9)},"[0.1, {x:.9g}]","[0.0, {tau:.9g}]"'
        for t, x, tau in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(folder / "bag.csv", "Time,position,effort", *rows)
    return called(path, "time=Time:ns", "position=position", "torque=effort")


@layout("InfluxDB, annotated CSV")
def influx(log: Log, folder: Path) -> list[str]:
    stamps = ((BEGUN + timedelta(seconds=float(t))).isoformat(timespec="microseconds") for t in log.time)
    rows = (
        f",,0,{at}Z,bench,{x:.9g},{tau:.9g}"
        for at, x, tau in zip(stamps, log.position, log.torque, strict=True)
    )
    path = write(
        folder / "influx.csv",
        "#group,false,false,false,true,false,false",
        "#datatype,string,long,dateTime:RFC3339,string,double,double",
        "#default,_result,,,,,",
        ",result,table,_time,host,angle,torque",
        *rows,
        end="\r\n",
    )
    return called(path, "time=_time", "position=angle", "torque=torque")


@layout("Siemens trace, a DINT in LU and remarks behind the rows")
def siemens_counts(log: Log, folder: Path) -> list[str]:
    counts = np.round(deg(log) * 1000)
    rows = rows_of(np.arange(len(counts)), log.time * 1e6, counts, 1e3 * log.torque, form="%.9g", between=";")
    lines = rows.split("\n")
    lines[0] += ";(* trigger *)"
    path = write(folder / "tia.csv", "Index;Timestamp;Axis.ActPos_LU;Axis.Torque_mNm", *lines, end="\r\n")
    return called(
        path, "time=Timestamp:us", "position=Axis.ActPos_LU:deg:0.001", "torque=Axis.Torque_mNm:mNm"
    )


@layout("EPOS 4 recorder, per mille of rated torque and rpm, no times")
def epos_4(log: Log, folder: Path) -> list[str]:
    rated = 2.4
    rows = "\n".join(
        f"{k};{row}" for k, row in enumerate(rows_of(
            np.round(log.position / (2 * math.pi) * 65536), np.round(rpm(log)),
            log.torque / rated * 1000, form="%.9g", between=";").split("\n"))
    )  # fmt: skip
    head = "Sample;Position actual value [inc];Velocity actual value [rpm];Torque actual value [per mille]"
    path = write(folder / "epos4.csv", head, rows, end="\r\n")
    return called(
        path,
        "position=Position actual value [inc]:counts",
        "velocity=Velocity actual value [rpm]:rpm",
        f"torque=Torque actual value [per mille]:Nm:{rated / 1000}",
        more=("--counts-per-rev", "65536", "--rate-hz", "1000"),
    )


@layout("blocks of a USB transfer: 64 rows of one stamp each")
def blocks(log: Log, folder: Path) -> list[str]:
    t = log.time[np.minimum(np.arange(len(log.time)) // 64 * 64 + 63, len(log.time) - 1)]
    path = write(folder / "usb.csv", "t,q,tau", rows_of(t, log.position, log.torque, form="%.9g"))
    return called(path, "time=t", "position=q", "torque=tau")


@layout("two decimals of the time: ten rows of one stamp each")
def two_decimals(log: Log, folder: Path) -> list[str]:
    rows = rows_of(log.position, log.torque, form="%.7g").split("\n")
    lines = (f"{t:.2f},{row}" for t, row in zip(log.time, rows, strict=True))
    path = write(folder / "short.csv", "t,q,tau", *lines)
    return called(path, "time=t", "position=q", "torque=tau")


@layout("remarks behind some rows")
def remarks(log: Log, folder: Path) -> list[str]:
    lines = rows_of(log.time, log.position, log.torque).split("\n")
    lines[1000] += "  # hand on the lever"
    lines[2000] += "  # hand off"
    path = write(folder / "notes.csv", "t,q,tau", *lines, end="\r\n")
    return called(path, "time=t", "position=q", "torque=tau")


@layout("Grafana, a prefix of its own in each cell")
def grafana(log: Log, folder: Path) -> list[str]:
    def shown(tau: float) -> str:
        return f"{tau:.3g} N·m" if abs(tau) >= 1 else f"{1e3 * tau:.3g} mN·m"

    rows = (
        f"{t:.3f},{x:.7g},{shown(tau)}" for t, x, tau in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(folder / "panel.csv", "Time,angle,torque", *rows)
    return called(path, "time=Time", "position=angle", "torque=torque")


@layout("16-bit encoder whose counts wrap, velocity in counts/s")
def wrapped_counts(log: Log, folder: Path) -> list[str]:
    whole = np.round(log.position / (2 * math.pi) * 2**20)
    wrapped = (whole + 32768) % 65536 - 32768
    speed = log.velocity / (2 * math.pi) * 2**20
    path = write(
        folder / "enc.csv",
        "t_us,enc [counts],v [counts/s],tau",
        rows_of(1e6 * log.time, wrapped, speed, log.torque, form="%.9g"),
    )
    return called(
        path,
        "time=t_us:us",
        "position=enc [counts]:counts",
        f"velocity=v [counts/s]:rad/s:{2 * math.pi / 2**20:.9g}",
        "torque=tau",
        more=("--counts-per-rev", str(2**20)),
    )


@layout("Data Inspector, times of all signals in one column and empty cells")
def all_times(log: Log, folder: Path) -> list[str]:
    rows = (
        f"{t:.6g},{x:.8g},{f'{tau:.6g}' if k % 5 == 0 else ''}"
        for k, (t, x, tau) in enumerate(zip(log.time, log.position, log.torque, strict=True))
    )
    path = write(folder / "sdi.csv", "time,theta,tau", *rows)
    return called(path, "time=time", "position=theta", "torque=tau")


@layout("a trigger in the middle: times below zero, and a row of units in brackets")
def pretrigger(log: Log, folder: Path) -> list[str]:
    body = rows_of(1e3 * (log.time - 15), deg(log), 1e3 * log.torque, form="%.6f", between="\t")
    path = write(folder / "pre.txt", "Time\tPosition\tTorque", "[ms]\t[°]\t[mNm]", body, encoding="utf-16")
    return called(path, "time=Time:ms", "position=Position:deg", "torque=Torque:mNm")


@layout("catman, names with a rate behind them and a cp1252 micro sign")
def catman(log: Log, folder: Path) -> list[str]:
    head = "\n".join(
        [
            "HBM_CATMAN_DATAFILE_40",
            "3",
            "30000",
            "Time  1 - default sample rate \tAngle \tM1 ",
            "s\t°\tµNm",
            "",
        ]
    ).rstrip()
    body = rows_of(log.time, deg(log), 1e6 * log.torque, form="%.6f", between="\t")
    path = write(folder / "catman.asc", head, body, encoding="cp1252", end="\r\n")
    return called(path, "time=Time  1 - default sample rate", "position=Angle:deg", "torque=M1:Nm:1e-6")


@layout("µNm taken for newton-metres")
def micro_wrong(log: Log, folder: Path) -> list[str]:
    return [word.replace(":Nm:1e-6", ":Nm") for word in catman(log, folder)]
