"""Layouts that are no text: MATLAB, TDMS, JSON, bags, and what nothing reads (`other_layouts`)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from other_layouts import called, deg, layout, rows_of, write
from other_loggers import Log


def structures(fields: Iterable[dict[str, object]]) -> np.ndarray:
    """MATLAB structures of one name."""
    entries = list(fields)
    found = np.empty((1, len(entries)), [(name, object) for name in entries[0]])
    for k, entry in enumerate(entries):
        found[0, k] = tuple(entry.values())
    return found


@layout("dSPACE ControlDesk, MATLAB")
def dspace(log: Log, folder: Path) -> list[str]:
    from scipy.io import savemat

    signals = (
        ("Model Root/Enc/phi", log.position),
        ("Model Root/Drive/iq", log.current),
        ("Model Root/Torque", log.torque),
    )
    y = structures(
        {"Name": name, "Type": "MEASUREMENT", "Data": data[None, :], "XIndex": 1} for name, data in signals
    )
    x = structures([{"Name": "Time", "Data": (log.time - log.time[0])[None, :], "Unit": "s"}])
    savemat(
        folder / "meas_001.mat",
        {"meas_001": {"X": x, "Y": y, "Description": {"General": {"DateTime": "07-Mar-2024"}}}},
    )
    return called(
        folder / "meas_001.mat",
        "time=meas_001.X.Data",
        "position=meas_001.Y(1).Data",
        "torque=meas_001.Y(3).Data",
    )


@layout("Simulink To File, signals in rows")
def to_file(log: Log, folder: Path) -> list[str]:
    from scipy.io import savemat

    savemat(folder / "quarc.mat", {"ans": np.stack([log.time, log.position, log.velocity, log.torque])})
    return called(folder / "quarc.mat", "time=ans#1", "position=ans#2", "torque=ans#4")


@layout("Simulink structure with time")
def with_time(log: Log, folder: Path) -> list[str]:
    from scipy.io import savemat

    signals = structures(
        {"values": v[:, None], "dimensions": 1, "label": name}
        for name, v in (("theta", log.position), ("tau", log.torque))
    )
    savemat(
        folder / "scope.mat",
        {"ScopeData": {"time": log.time[:, None], "signals": signals, "blockName": "model/Scope"}},
    )
    return called(
        folder / "scope.mat",
        "time=ScopeData.time",
        "position=ScopeData.signals(1).values",
        "torque=ScopeData.signals(2).values",
    )


@layout("MATLAB System Identification, no time")
def iddata(log: Log, folder: Path) -> list[str]:
    from scipy.io import savemat

    savemat(folder / "z.mat", {"u": log.torque[:, None], "y": log.position[:, None], "Ts": 1e-3})
    return called(folder / "z.mat", "position=y", "torque=u", more=("--rate-hz", "1000"))


@layout("JSON, a line a row")
def json_lines(log: Log, folder: Path) -> list[str]:
    rows = "\n".join(
        f'{{"t": {t:.6f}, "q": {x:.8g}, "tau": {tau:.6g}}}'
        for t, x, tau in zip(log.time, log.position, log.torque, strict=True)
    )
    path = write(folder / "log.jsonl", rows)
    return called(path, "time=t", "position=q", "torque=tau")


@layout("an .xlsx given as it is")
def xlsx(log: Log, folder: Path) -> list[str]:
    import zipfile

    path = folder / "log.xlsx"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/worksheets/sheet1.xml", "<worksheet/>")
    return called(path, "time=t", "position=q", "torque=tau")


@layout("HDF5")
def hdf5(log: Log, folder: Path) -> list[str]:
    import h5py

    path, records = folder / "log.h5", np.zeros(len(log.time), [("q", "f8"), ("name", "S3"), ("tau", "f4")])
    records["q"], records["tau"] = log.position, log.torque
    with h5py.File(path, "w") as file:
        run = file.create_group("run 3/arm")
        run.create_dataset("time", data=log.time / 86400 + 739000.4, compression="gzip")  # MATLAB's datenum
        run.create_dataset("joint", data=records)
    return called(
        path, "time=run 3/arm/time:d", "position=run 3/arm/joint/q:radian", "torque=run 3/arm/joint/tau"
    )


@layout("TDMS called .dat")
def tdms_called_otherwise(log: Log, folder: Path) -> list[str]:
    path = folder / "log.dat"
    path.write_bytes(b"TDSm\x0e\x00\x00\x00" + bytes(range(256)) * 20)
    return called(path, "time=t", "position=q", "torque=tau")


@layout("TDMS of a DAQ task: channels of a rate")
def tdms(log: Log, folder: Path) -> list[str]:
    nptdms = pytest.importorskip("nptdms")
    path = folder / "log.tdms"
    clock = {"wf_start_time": np.datetime64("2024-03-07T14:02:11.25"), "wf_start_offset": 0.0}
    clock |= {"wf_increment": float(np.median(np.diff(log.time))), "wf_samples": 100}
    with nptdms.TdmsWriter(path) as file:
        for part in np.array_split(np.arange(len(log.time)), 5):  # LabVIEW appends as it measures
            file.write_segment(
                [
                    nptdms.ChannelObject("Motion", "Angle", deg(log)[part], {**clock, "unit_string": "deg"}),
                    nptdms.ChannelObject(
                        "Motion", "Torque", log.torque[part], {**clock, "unit_string": "Nm"}
                    ),
                    nptdms.ChannelObject("Notes", "Who", ["me"]),
                ]
            )
    return called(path, "time=Motion/Angle/time", "position=Motion/Angle:deg", "torque=Motion/Torque")


@layout("TDMS with a channel of times")
def tdms_with_times(log: Log, folder: Path) -> list[str]:
    nptdms = pytest.importorskip("nptdms")
    path = folder / "log.tdms"
    stamps = np.datetime64("2024-03-07T14:02:11.25") + (1e6 * log.time).round().astype("timedelta64[us]")
    with nptdms.TdmsWriter(path) as file:
        channels = {"Zeit": stamps, "q": log.position, "tau": log.torque.astype(np.float32)}
        file.write_segment([nptdms.ChannelObject("run 3", name, one) for name, one in channels.items()])
    return called(path, "time=run 3/Zeit", "position=run 3/q", "torque=run 3/tau")


@layout("a bag of ROS 2 with joint states")
def bag(log: Log, folder: Path) -> list[str]:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        for t, x, v, tau in zip(log.time, log.position, log.velocity, log.torque, strict=True):
            stamp = kinds["builtin_interfaces/msg/Time"](
                sec=1709820131 + int(t), nanosec=round(t % 1 * 1e9) % 10**9
            )
            header = kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="base_link")
            places, speeds, efforts = (np.array(pair) for pair in ((0.1, x), (0.0, v), (0.0, tau)))
            message = kinds["sensor_msgs/msg/JointState"](
                header=header, name=["shoulder", "elbow"], position=places, velocity=speeds, effort=efforts
            )
            kind, gripper = "sensor_msgs/msg/JointState", replace(message, name=["gripper"])
            for each in (gripper, message):  # of another node on the same topic
                writer.write(topic, round((1709820131 + t) * 1e9), store.serialize_cdr(each, kind))
    (path,) = (folder / "bag").glob("*.mcap")
    return called(path, "position=/joint_states/elbow/position", "torque=/joint_states/elbow/effort")


@layout("a bag of ROS 2 without joint states")
def other_bag(log: Log, folder: Path) -> list[str]:
    from mcap.writer import Writer

    path = folder / "bag_0.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="libmcap 1.0")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/chatter", "cdr", schema)
        for k in range(50):
            writer.add_message(channel, k * 10**6, bytes(64), k * 10**6)
        writer.finish()
    return called(path, "position=/joint_states/elbow/position", "torque=effort")


@layout("SQLite bag")
def sqlite(log: Log, folder: Path) -> list[str]:
    path = folder / "bag_0.db3"
    path.write_bytes(b"SQLite format 3\x00" + bytes(500))
    return called(path, "time=t", "position=q", "torque=tau")


@layout("dSPACE ControlDesk, CSV")
def control_desk_csv(log: Log, folder: Path) -> list[str]:
    names = (
        "trace_index,1,2,3",
        "type,X-Axis,Y-Axis,Y-Axis",
        ",time,theta,tau",
        "unit,s,rad,Nm",
        "trace_values",
    )
    rows = rows_of(log.time, log.position, log.torque).replace("\n", "\n,")
    path = write(folder / "rec.csv", '"descriptions"', '"date","2023-05-04"', *names, f",{rows}")
    return called(path, "time=time", "position=theta", "torque=tau")


@layout("settings above that name the columns")
def named_twice(log: Log, folder: Path) -> list[str]:
    """The first line that has the names has them one place further on, among as many cells."""
    rows = rows_of(log.time, log.position, log.torque, 20.0 + 0 * log.time, between=" ")
    path = write(folder / "run.dat", "# columns: t q tau", "# kt = 0.05", "# t q tau temp", rows)
    return called(path, "time=t", "position=q", "torque=tau")


@layout("N cm, read as N m")
def newton_centimetres(log: Log, folder: Path) -> list[str]:
    path = write(
        folder / "m.csv", "t [s],phi [rad],M [N cm]", rows_of(log.time, log.position, 100 * log.torque)
    )
    return called(path, "time=t [s]", "position=phi [rad]", "torque=M [N cm]")
