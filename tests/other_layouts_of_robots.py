"""Layouts of robots' and small boards' programs, and of one's own scripts (`other_layouts`)."""

from __future__ import annotations

import gzip
import math
from datetime import timedelta
from pathlib import Path

import numpy as np
from other_layouts import BEGUN, called, layout, rows_of, write
from other_loggers import Log


@layout("dates and times of day, pandas")
def dated(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f"{k},{BEGUN + timedelta(seconds=float(t))},{x:.8g},{tau:.6g}"
        for k, (t, x, tau) in enumerate(zip(log.time, log.position, log.torque, strict=True))
    )
    path = write(folder / "run.csv", ",timestamp,angle_rad,torque_nm", rows)
    return called(path, "time=timestamp", "position=angle_rad", "torque=torque_nm")


@layout("ISO times with a zone")
def iso(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f"{(BEGUN + timedelta(seconds=float(t))).isoformat(timespec='microseconds')}Z;{x:.8g};{tau:.6g}"
        for t, x, tau in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(folder / "run.csv", "time;angle_rad;torque_nm", rows)
    return called(path, "time=time", "position=angle_rad", "torque=torque_nm")


@layout("serial monitor with the time of day")
def serial_monitor(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f"{(BEGUN + timedelta(seconds=float(t))).strftime('%H:%M:%S.%f')[:-3]} -> {x:.6f},{tau:.4f}"
        for t, x, tau in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(
        folder / "putty.log", "14:02:11.101 -> boot ok", "14:02:11.120 -> angle,torque", rows, end="\r\n"
    )
    return called(path, "position=angle", "torque=torque", more=("--rate-hz", "1000"))


@layout("PlotJuggler of two topics, cells left empty")
def plotjuggler(log: Log, folder: Path) -> list[str]:
    rows = []
    for k, (t, x, tau) in enumerate(zip(log.time, log.position, log.torque, strict=True)):
        rows.append(f"{1709820131 + t:.6f},,,{x:.9f},{tau:.9f}")
        if k % 10 == 3:
            rows.append(f"{1709820131 + t + 2e-4:.6f},0.01,31.5,,")
    path = write(
        folder / "bag.csv",
        "__time,/imu/gyro/x,/motor/temperature,/joint_states/elbow/position,/joint_states/elbow/effort",
        "\n".join(rows),
    )
    return called(
        path, "time=__time", "position=/joint_states/elbow/position", "torque=/joint_states/elbow/effort"
    )


@layout("ros2 topic echo --csv")
def ros2_echo(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f"{1709820131 + int(t)},{round((t % 1) * 1e9)},base,shoulder,elbow,0.1,{x:.12f},0.0,{v:.9f},0.0,"
        f"{tau:.9f}"
        for t, x, v, tau in zip(log.time, log.position, log.velocity, log.torque, strict=True)
    )
    path = write(folder / "echo.csv", rows)
    return called(path, "position=#7", "torque=#11", more=("--rate-hz", "1000"))


@layout("UR RTDE, blanks")
def rtde(log: Log, folder: Path) -> list[str]:
    zero = np.zeros(len(log.time))
    body = rows_of(
        18873.104 + log.time, log.position, zero + 1.2, log.current, zero + 0.4, form="%.6f", between=" "
    )
    path = write(
        folder / "robot_data.csv", "timestamp actual_q_0 actual_q_1 actual_current_0 actual_current_1", body
    )
    return called(
        path,
        "time=timestamp",
        "position=actual_q_0",
        "current=actual_current_0",
        more=("--torque-constant", str(log.kt)),
    )


@layout("ODrive, turns and amperes")
def odrive(log: Log, folder: Path) -> list[str]:
    turns = log.position / (2 * math.pi)
    path = write(
        folder / "odrive.csv",
        "time,axis0.pos_estimate,axis0.vel_estimate,axis0.motor.foc.Iq_measured",
        rows_of(log.time, turns, log.velocity / 2 / math.pi, log.current),
    )
    return called(
        path,
        "time=time",
        "position=axis0.pos_estimate:rev",
        "velocity=axis0.vel_estimate:rev/s",
        "current=axis0.motor.foc.Iq_measured",
        more=("--torque-constant", str(log.kt)),
    )


@layout("ODrive, turns taken for radians")
def odrive_wrong(log: Log, folder: Path) -> list[str]:
    line = odrive(log, folder)
    return [word.replace(":rev/s", "").replace(":rev", "") for word in line]


@layout("moteus, three registers a line")
def moteus(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f"{1709820131 + t:.6f},1,10,{x / 2 / math.pi:.7f},{v / 2 / math.pi:.6f},{tau:.5f},24.1,31,0"
        for t, x, v, tau in zip(log.time, log.position, log.velocity, log.torque, strict=True)
    )
    path = write(
        folder / "moteus.csv",
        "timestamp,id,mode,position_rev,velocity_rev_s,torque_Nm,voltage,temperature,fault",
        rows,
    )
    return called(
        path,
        "time=timestamp",
        "position=position_rev:rev",
        "velocity=velocity_rev_s:rev/s",
        "torque=torque_Nm",
    )


@layout("pandas, gzipped, microseconds since 1970")
def epoch(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f"{1709820131000000 + round(t * 1e6)},{x:.8g},{tau:.6g}"
        for t, x, tau in zip(log.time, log.position, log.torque, strict=True)
    )
    path = folder / "run.csv.gz"
    path.write_bytes(gzip.compress(f"t,q,tau\n{rows}\n".encode()))
    return called(path, "time=t:us", "position=q", "torque=tau")


@layout("microseconds of a counter of 32 bits that overflows")
def overflows(log: Log, folder: Path) -> list[str]:
    us = (np.round(log.time * 1e6).astype(np.int64) + 2**32 - 3_000_000) % 2**32
    path = write(
        folder / "mcu.csv",
        "us,q,tau",
        "\n".join(f"{t},{x:.8g},{tau:.6g}" for t, x, tau in zip(us, log.position, log.torque, strict=True)),
    )
    return called(path, "time=us:us", "position=q", "torque=tau")


@layout("stamps of whole milliseconds at 1 kHz, some twice")
def coarse_stamps(log: Log, folder: Path) -> list[str]:
    late = log.time + np.random.default_rng(5).uniform(0, 0.0008, len(log.time))
    path = write(
        folder / "log.csv",
        "ms,q,tau",
        "\n".join(
            f"{t:.0f},{x:.8g},{tau:.6g}"
            for t, x, tau in zip(late * 1e3, log.position, log.torque, strict=True)
        ),
    )
    return called(path, "time=ms:ms", "position=q", "torque=tau")


@layout("names quoted, true and false beside them")
def quoted(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f'"{t:.6f}","{x:.8g}","{tau:.6g}","TRUE","OK, running"'
        for t, x, tau in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(folder / "q.csv", '"Time (s)","Joint Angle (rad)","Torque (N·m)","Enabled","State"', rows)
    return called(path, "time=Time (s)", "position=Joint Angle (rad)", "torque=Torque (N·m)")


@layout("last row cut off")
def cut_off(log: Log, folder: Path) -> list[str]:
    path = write(
        folder / "cut.csv", "t,q,tau", rows_of(log.time, log.position, log.torque, form="%.9g")[:-14]
    )
    return called(path, "time=t", "position=q", "torque=tau")


@layout("zeros above and below, as a buffer not yet full")
def buffer(log: Log, folder: Path) -> list[str]:
    zeros = "\n".join(["0,0,0"] * 300)
    path = write(
        folder / "buffer.csv", "t,q,tau", rows_of(log.time, log.position, log.torque, form="%.9g"), zeros
    )
    return called(path, "time=t", "position=q", "torque=tau")


@layout("names in other letters and with blanks about them")
def blanks(log: Log, folder: Path) -> list[str]:
    path = write(folder / "b.csv", "Time ,  Position, Torque", rows_of(log.time, log.position, log.torque))
    return called(path, "time=Time", "position=Position", "torque=Torque")


@layout("the wrong case in the name")
def wrong_case(log: Log, folder: Path) -> list[str]:
    path = write(folder / "b.csv", "Time,Position,Torque", rows_of(log.time, log.position, log.torque))
    return called(path, "time=time", "position=position", "torque=torque")
