"""Layouts of exports that were misread once: traces of a CAN bus, MATLAB's objects, German dates and marks,
DataFrames in JSON (`other_layouts`).
"""

from __future__ import annotations

import json
import struct
from datetime import timedelta
from pathlib import Path

import numpy as np
from other_layouts import BEGUN, called, layout, rows_of, write
from other_loggers import Log

KT = "--torque-constant"


def frames(log: Log) -> list[tuple[float, int, bytes]]:
    """What an ODrive sends: place and speed in turns (Get_Encoder_Estimates), currents 0.2 ms later
    (Get_Iq).
    """
    turns, found = log.position / (2 * np.pi), []
    for t, x, v, i in zip(log.time, turns, log.velocity / (2 * np.pi), log.current, strict=True):
        found.append((t, 0x069, struct.pack("<ff", x, v)))
        found.append((t + 2e-4, 0x074, struct.pack("<ff", i, i)))
    return found


@layout("candump -L")
def candump(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(f"({1761436788 + t:.6f}) can0 {i:03X}#{b.hex().upper()}" for t, i, b in frames(log))
    path = write(folder / "candump.log", rows)
    return called(path, "time=#1", "position=#3:rev", "current=#4", more=(KT, str(log.kt)))


@layout("candump -t a")
def candump_shown(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(f" ({t:.6f})  can0  {i:03X}   [8]  {b.hex(' ').upper()}" for t, i, b in frames(log))
    return called(write(folder / "can.txt", rows), "time=time", "position=pos:rev", "torque=iq")


@layout("two messages, a row each, the other held")
def two_messages(log: Log, folder: Path) -> list[str]:
    held = np.concatenate([log.torque[:1], log.torque[:-1]])
    pairs = np.stack([log.time, log.position, held, log.time + 2e-4, log.position, log.torque], axis=1)
    path = write(folder / "log.csv", "t,x,tau", rows_of(*pairs.reshape(-1, 3).T))
    return called(path, "time=t", "position=x", "torque=tau")


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matlab_object(name: str, kind: str) -> bytes:
    """A variable of a file of version 7 that is an object: its name, class, and a number by which MATLAB
    finds it.
    """
    number = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 6, 1)) + element(1, b"")
    number += element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))
    words = b"".join(element(1, word.encode()) for word in (name, "MCOS", kind))
    return element(14, element(6, struct.pack("<II", 17, 0)) + words + element(14, number))


@layout("MATLAB arrays beside objects")
def beside_objects(log: Log, folder: Path) -> list[str]:
    from scipy.io import savemat

    path = folder / "run.mat"
    savemat(path, {"t": log.time, "q": log.position, "tau": log.torque}, do_compression=True)
    objects = matlab_object("logsout", "Simulink.SimulationData.Dataset") + matlab_object("ts", "timeseries")
    path.write_bytes(path.read_bytes() + objects)
    return called(path, "time=t", "position=q", "torque=tau")


@layout("MATLAB timeseries")
def timeseries(log: Log, folder: Path) -> list[str]:
    path = Path(beside_objects(log, folder)[1])
    return called(path, "time=t", "position=ts", "torque=tau")


def dated(log: Log, folder: Path, form: str, *, between: str = ";", comma: bool = True) -> list[str]:
    """A table with dates; `{ms}` of the form are milliseconds."""
    rows = []
    for t, x, tau in zip(log.time, log.position, log.torque, strict=True):
        when = BEGUN + timedelta(seconds=round(float(t), 3))
        numbers = f"{x:.7f}{between}{tau:.6f}"
        stamp = when.strftime(form).replace("{ms}", f"{when.microsecond // 1000:03d}")
        rows.append(f"{stamp}{between}{numbers.replace('.', ',') if comma else numbers}")
    path = write(folder / "d.csv", between.join(["Zeit", "Winkel", "Moment"]), "\n".join(rows), end="\r\n")
    return called(path, "time=Zeit", "position=Winkel", "torque=Moment")


@layout("German dates and decimal commas")
def german(log: Log, folder: Path) -> list[str]:
    return dated(log, folder, "%d.%m.%Y %H:%M:%S,{ms}")


@layout("MATLAB's dates, the month by name")
def month_by_name(log: Log, folder: Path) -> list[str]:
    return dated(log, folder, "%d-%b-%Y %H:%M:%S.{ms}", between=",", comma=False)


@layout("clocks put back in the middle, with their zones")
def clocks_put_back(log: Log, folder: Path) -> list[str]:
    half = len(log.time) // 2
    path = Path(dated(log, folder, "%Y-%m-%d %H:%M:%S.{ms}+02:00", between=",", comma=False)[1])
    lines = path.read_text().splitlines()
    back = [line.replace(" 14:", " 13:").replace("+02:00", "+01:00") for line in lines[half:]]
    return called(write(path, *lines[:half], *back), "time=Zeit", "position=Winkel", "torque=Moment")


@layout("points between thousands of whole numbers, decimal commas of others")
def thousands(log: Log, folder: Path) -> list[str]:
    def whole(numbers: np.ndarray) -> list[str]:
        return [f"{round(each):,}".replace(",", ".") for each in numbers.tolist()]

    counts = whole(log.position / (2 * np.pi) * 65536)
    torque = [f"{each:.2f}".replace(".", ",") for each in (1e3 * log.torque).tolist()]
    rows = "\n".join(map(";".join, zip(whole(1e6 * log.time), counts, torque, strict=True)))
    path = write(folder / "t.csv", "t [us];Lage [Inc];M [mNm]", rows)
    more = ("--counts-per-rev", "65536")
    return called(path, "time=t [us]:us", "position=Lage [Inc]:counts", "torque=M [mNm]:mNm", more=more)


@layout("UTF-16 without a mark")
def unmarked(log: Log, folder: Path) -> list[str]:
    body = rows_of(log.time, log.position, log.torque, between="\t", comma=True)
    path = write(folder / "u.txt", "Zeit\tWinkel\tMoment", body, encoding="utf-16-le")
    return called(path, "time=Zeit", "position=Winkel", "torque=Moment")


@layout("a DataFrame in JSON, as pandas writes it")
def data_frame(log: Log, folder: Path) -> list[str]:
    keys = [str(round(1.7e12 + 1e3 * t)) for t in log.time]
    columns = {"q": log.position, "tau": log.torque}
    table = {name: dict(zip(keys, values.tolist(), strict=True)) for name, values in columns.items()}
    path = write(folder / "frame.json", json.dumps(table))
    return called(path, "time=index:ms", "position=q", "torque=tau")


@layout("a DataFrame in JSON, names and rows apart")
def data_frame_split(log: Log, folder: Path) -> list[str]:
    rows = np.stack([log.position, log.torque], axis=1).tolist()
    table = {"columns": ["q", "tau"], "index": log.time.tolist(), "data": rows}
    path = write(folder / "frame.json", json.dumps(table))
    return called(path, "time=index", "position=q", "torque=tau")


@layout("LabVIEW measurement in segments")
def segments(log: Log, folder: Path) -> list[str]:
    text = ["LabVIEW Measurement\t", "Separator\tTab", "Multi_Headings\tYes", "***End_of_Header***\t", ""]
    for part in np.array_split(np.arange(len(log.time)), 3):
        text += ["Channels\t2\t\t", f"Samples\t{len(part)}\t{len(part)}\t", "***End_of_Header***\t\t\t"]
        text += ["X_Value\tAngle\tTorque\tComment"]
        text += [rows_of(log.time[part], log.position[part], log.torque[part], form="%.6f", between="\t"), ""]
    path = write(folder / "motion.lvm", *text, end="\r\n")
    return called(path, "time=X_Value", "position=Angle", "torque=Torque")


@layout("a bag of ROS 2, each message packed")
def bag_of_packed(log: Log, folder: Path) -> list[str]:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds, kind = store.types, "sensor_msgs/msg/JointState"
    writer = Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection("/joint_states", kind, typestore=store)
        for t, x, tau in zip(log.time[:50], log.position, log.torque, strict=False):
            stamp = kinds["builtin_interfaces/msg/Time"](sec=1, nanosec=round(1e9 * t) % 10**9)
            header = kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="")
            place, effort = np.array([x]), np.array([tau])
            said = kinds[kind](header=header, name=["elbow"], position=place, velocity=place, effort=effort)
            writer.write(topic, round(1e9 * (1 + t)), store.serialize_cdr(said, kind))
    (path,) = (folder / "bag").glob("*.mcap")
    return called(path, "position=/joint_states/elbow/position", "torque=/joint_states/elbow/effort")


@layout("the folder of a bag")
def folder_of_bag(log: Log, folder: Path) -> list[str]:
    words = bag_of_packed(log, folder)
    return ["--log", str(folder / "bag"), *words[2:]]


@layout("Copley, names and cells quoted behind comma and blank")
def copley(log: Log, folder: Path) -> list[str]:
    head = '"Time (ms)", "Actual Position (rad)", "Actual Torque (Nm)"'
    rows = rows_of(log.time * 1e3, log.position, log.torque, between=", ")
    path = write(folder / "trace.csv", head, rows)
    return called(path, "time=Time (ms):ms", "position=Actual Position (rad)", "torque=Actual Torque (Nm)")


@layout("a counter in hexadecimal")
def hexadecimal(log: Log, folder: Path) -> list[str]:
    rows = rows_of(log.position, log.torque).splitlines()
    stamps = (f"0x{round(t * 1e6):08X}" for t in log.time)
    stamped = "\n".join(f"{tick},{row}" for tick, row in zip(stamps, rows, strict=True))
    return called(write(folder / "h.csv", "tick,q,tau", stamped), "time=tick:us", "position=q", "torque=tau")


@layout("seconds in single precision, three hours after the start")
def single(log: Log, folder: Path) -> list[str]:
    stamps = (log.time + 10800).astype(np.float32)
    np.savez(folder / "f.npz", t=stamps, q=log.position, tau=log.torque)
    return called(folder / "f.npz", "time=t", "position=q", "torque=tau")


@layout("mean and deviation below the rows")
def footer(log: Log, folder: Path) -> list[str]:
    rows = rows_of(log.time, log.position, log.torque)
    path = write(folder / "foot.csv", "t,q,tau", rows, "Mean,0.1,0.2", "StdDev,0.3,0.1")
    return called(path, "time=t", "position=q", "torque=tau")


@layout("TwinCAT, the torque at a quarter of the rate with its own times")
def rates(log: Log, folder: Path) -> list[str]:
    n = len(log.time)
    slow = rows_of(log.time[::4], log.torque[::4], between=";").splitlines()
    fast = rows_of(log.time, log.position, between=";").splitlines()
    rows = "\n".join(f"{row};{slow[k] if k < len(slow) else ';'}" for k, row in enumerate(fast[:n]))
    path = write(folder / "scope.csv", "Name;ActPos;Name;ActTorque", rows)
    return called(path, "time=#1", "position=#2", "torque=#4")


@layout("a dict in an npz")
def pickled(log: Log, folder: Path) -> list[str]:
    np.savez(folder / "o.npz", log=np.array({"t": log.time}, dtype=object))
    return called(folder / "o.npz", "time=log.t", "position=log.q", "torque=log.tau")


@layout("nanoseconds since 1970 taken for seconds, some twice")
def nanoseconds(log: Log, folder: Path) -> list[str]:
    stamps = [1_700_000_000_000_000_000 + round(t * 1e3) * 1_000_000 for t in log.time]
    stamps[4] = stamps[3]
    rows = rows_of(log.position, log.torque).splitlines()
    path = write(
        folder / "r.csv", "%time,q,tau", *(f"{t},{row}" for t, row in zip(stamps, rows, strict=True))
    )
    return called(path, "time=%time", "position=q", "torque=tau")


@layout("Unix time in six digits")
def six_digits(log: Log, folder: Path) -> list[str]:
    rows = rows_of(log.position, log.torque).splitlines()
    stamps = (f"{1.7e9 + t:.5E}" for t in log.time)
    path = write(folder / "e.csv", "t,q,tau", *(f"{t},{row}" for t, row in zip(stamps, rows, strict=True)))
    return called(path, "time=t", "position=q", "torque=tau")


@layout("a row for each signal")
def a_row_each(log: Log, folder: Path) -> list[str]:
    rows = (
        f"{t:.6f},q,{x:.7g}\n{t:.6f},tau,{u:.7g}"
        for t, x, u in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(folder / "long.csv", "time,signal,value", *rows)
    return called(path, "time=time", "position=value", "torque=value")
