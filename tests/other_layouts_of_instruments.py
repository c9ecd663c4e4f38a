"""Layouts of oscilloscopes, of MATLAB 7.3, of the ODrive's own program, of pandas and of a bag in SQLite
(`other_layouts`)."""

from __future__ import annotations

import sqlite3
import struct
from pathlib import Path

import numpy as np
from other_layouts import BEGUN, called, deg, layout, rows_of, write
from other_loggers import Log

VOLTS = (2.0, 5.0)
"""Of a rad and of a N m, on a scope."""

SCOPE = (f"{1 / VOLTS[0]}", f"{1 / VOLTS[1]}")


def volts(log: Log) -> tuple[np.ndarray, np.ndarray]:
    return VOLTS[0] * log.position, VOLTS[1] * log.torque


@layout("Tektronix, MSO: a header of settings")
def tektronix(log: Log, folder: Path) -> list[str]:
    head = "\n".join(
        ["Model,MSO44", "Firmware Version,1.28.7", "", "Waveform Type,ANALOG,,", "Point Format,Y,,",
         "Horizontal Units,s,,", "Horizontal Scale,3,,", "Sample Interval,0.001,,",
         f"Record Length,{len(log.time)},,", "Gating,0.0% to 100.0%,,", "Probe Attenuation,1,1,",
         "Vertical Units,V,V,", "Vertical Offset,0,0,", ",,,", "Label,,,", "TIME,CH1,CH2,"]
    )  # fmt: skip
    body = rows_of(log.time, *volts(log), form="%.8g").replace("\n", ",\n") + ","
    path = write(folder / "tek0001.csv", head, body, end="\r\n")
    return called(path, "time=TIME", f"position=CH1:rad:{SCOPE[0]}", f"torque=CH2:Nm:{SCOPE[1]}")


@layout("Tektronix, TDS: settings beside the rows, no names")
def tds(log: Log, folder: Path) -> list[str]:
    settings = ["Record Length,3.0e+03", "Sample Interval,1.0e-03", "Trigger Point,1.5e+03", ",", ","]
    rows = rows_of(log.time, *volts(log), form="%.8g").split("\n")
    lines = [f"{settings[k] if k < len(settings) else ','},,{row}," for k, row in enumerate(rows)]
    path = write(folder / "F0000CH1.CSV", "\n".join(lines), end="\r\n")
    return called(path, "time=#4", f"position=#5:rad:{SCOPE[0]}", f"torque=#6:Nm:{SCOPE[1]}")


@layout("Rigol, a counter for the time and its step above")
def rigol(log: Log, folder: Path) -> list[str]:
    rows = rows_of(*volts(log), form="%.8g").split("\n")
    body = "\n".join(f"{k},{row}," for k, row in enumerate(rows))
    path = write(
        folder / "NewFile1.csv", "X,CH1,CH2,Start,Increment,", "Sequence,Volt,Volt,-6.0e+00,1.0e-03", body
    )
    return called(path, "time=X:s:0.001", f"position=CH1:rad:{SCOPE[0]}", f"torque=CH2:Nm:{SCOPE[1]}")


@layout("Keysight, x-axis and numbers of channels")
def keysight(log: Log, folder: Path) -> list[str]:
    body = rows_of(log.time, *volts(log), form="%+.9E")
    path = write(folder / "scope_0.csv", "x-axis,1,2", "second,Volt,Volt", body, end="\r\n")
    return called(path, "time=x-axis", f"position=1:rad:{SCOPE[0]}", f"torque=2:Nm:{SCOPE[1]}")


@layout("PicoScope, units in brackets below the names and an empty row")
def picoscope(log: Log, folder: Path) -> list[str]:
    body = rows_of(1e3 * log.time, *volts(log), form="%.8f")
    path = write(folder / "pico.csv", "Time,Channel A,Channel B", "(ms),(V),(V)", "", body, end="\r\n")
    return called(
        path, "time=Time:ms", f"position=Channel A:rad:{SCOPE[0]}", f"torque=Channel B:Nm:{SCOPE[1]}"
    )


@layout("oscilloscope, volts taken for what they stand for")
def no_scale(log: Log, folder: Path) -> list[str]:
    called_as = keysight(log, folder)
    return called(Path(called_as[1]), "time=x-axis", "position=1:rad", "torque=2:Nm")


@layout("ODrive's own program, milliseconds and axis0")
def odrive_gui(log: Log, folder: Path) -> list[str]:
    head = "time(ms),axis0.pos_vel_mapper.pos_rel,axis0.pos_vel_mapper.vel,axis0.motor.foc.Iq_measured"
    turns = 1 / (2 * np.pi)
    body = rows_of(1e3 * log.time, turns * log.position, turns * log.velocity, log.current, form="%.9g")
    path = write(folder / "odrive.csv", head, body)
    return called(
        path, "time=time(ms):ms", "position=axis0.pos_vel_mapper.pos_rel:rev",
        "current=axis0.motor.foc.Iq_measured", more=("--torque-constant", str(log.kt)),
    )  # fmt: skip


@layout("pandas, an index without a name")
def index_column(log: Log, folder: Path) -> list[str]:
    rows = rows_of(log.time, log.position, log.torque).split("\n")
    path = write(folder / "df.csv", ",t,q,tau", "\n".join(f"{k},{row}" for k, row in enumerate(rows)))
    return called(path, "time=t", "position=q", "torque=tau")


@layout("pandas, two rows of names")
def two_rows_of_names(log: Log, folder: Path) -> list[str]:
    rows = rows_of(log.position, log.torque, log.position * 0.1).split("\n")
    body = "\n".join(f"{t:.6g},{row}" for t, row in zip(log.time, rows, strict=True))
    path = write(folder / "df.csv", ",arm,arm,gripper", ",q,tau,q", "t,,,", body)
    return called(path, "time=#1", "position=#2", "torque=#3")


@layout("pandas, two rows of names, asked for by the upper one")
def by_the_upper_name(log: Log, folder: Path) -> list[str]:
    path = two_rows_of_names(log, folder)[1]
    return called(Path(path), "time=t", "position=arm", "torque=arm")


@layout("pandas, an index of two levels")
def index_of_two_levels(log: Log, folder: Path) -> list[str]:
    rows = rows_of(log.position, log.torque).split("\n")
    body = "\n".join(f"run 1,{t:.6g},{row}" for t, row in zip(log.time, rows, strict=True))
    path = write(folder / "df.csv", "run,t,q,tau", body)
    return called(path, "time=t", "position=q", "torque=tau")


@layout("Simulink, structure with time in MATLAB 7.3")
def with_time_73(log: Log, folder: Path) -> list[str]:
    import h5py

    path = folder / "out.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        top = file.create_group("simout")
        top["time"] = log.time[None, :]
        values = np.stack([log.position, log.torque])
        top.create_group("signals")["values"] = values
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + struct.pack("<HH", 0x0200, 0x4D49)
    path.write_bytes(head.ljust(512, b"\0") + path.read_bytes()[512:])
    return called(
        path, "time=simout.time", "position=simout.signals.values#1", "torque=simout.signals.values#2"
    )


@layout("Siemens trace of TIA, semicolons and a time in ms")
def tia(log: Log, folder: Path) -> list[str]:
    head = "\n".join(
        ['"Trace";"Trace_1"', '"Recording level";"Technology object"', "",
         '"Number";"Time [ms]";"Axis_1.ActualPosition [deg]";"Axis_1.StatusDrive.ActualTorque [Nm]"']
    )  # fmt: skip
    rows = rows_of(1e3 * log.time, deg(log), log.torque, form="%.6f", between=";", comma=True).split("\n")
    body = "\n".join(f"{k};{row}" for k, row in enumerate(rows))
    path = write(folder / "trace.csv", head, body, end="\r\n", encoding="utf-8-sig")
    return called(
        path, "time=Time [ms]:ms", "position=Axis_1.ActualPosition [deg]:deg",
        "torque=Axis_1.StatusDrive.ActualTorque [Nm]:Nm",
    )  # fmt: skip


@layout("a bag of ROS 2 in SQLite, with its table of messages")
def db3(log: Log, folder: Path) -> list[str]:
    path = folder / "bag_0.db3"
    with sqlite3.connect(path) as base:
        base.execute("CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        base.execute("INSERT INTO messages VALUES (1, 1, 1700000000000000000, x'00010000')")
    base.close()
    return called(
        path, "time=time_s", "position=/joint_states/elbow/position", "torque=/joint_states/elbow/effort"
    )


@layout("times of the wall beside a counter that is 20 % off")
def wrong_clock(log: Log, folder: Path) -> list[str]:
    from datetime import timedelta

    rows = rows_of(log.time / 1.2, log.position, log.torque).split("\n")
    wall = ((BEGUN + timedelta(seconds=float(t))).isoformat(sep=" ") for t in log.time)
    body = "\n".join(f"{at},{row}" for at, row in zip(wall, rows, strict=True))
    return called(write(folder / "log.csv", "logged,t,q,tau", body), "time=t", "position=q", "torque=tau")
