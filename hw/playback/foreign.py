"""Files that are no tables and that nothing here reads: what they are, and how they become something that is
read."""

from __future__ import annotations

import re

_AS_TEXT = "export its columns as CSV"

_DECODED = (
    "what the bytes of its frames mean stands in the drive's DBC file (or manual): decode it into a table, "
    "a column for each signal and a row for each frame of the position, the others filled in by time "
    "(docs/logs.md has the lines for Python)"
)

FOREIGN: tuple[tuple[bytes, str, str], ...] = (
    (b"PK\x03\x04", "a spreadsheet, or another archive", "save the sheet as CSV, or unpack the archive"),
    (b"\x28\xb5\x2f\xfd", "packed by zstd", "unpack it (zstd -d)"),
    (b"\x04\x22\x4d\x18", "packed by LZ4", "unpack it (lz4 -d)"),
    (b"7z\xbc\xaf", "an archive of 7-Zip", "unpack it"),
    (b"\x89HDF", "HDF5", "let its name end in .h5"),
    (b"PAR1", "Parquet", "let its name end in .parquet"),
    (b"\x89MCAP", "MCAP", "let its name end in .mcap"),
    (b"TDSm", "a TDMS file of LabVIEW", "let its name end in .tdms"),
    (
        b"SQLite format 3",
        "an SQLite data base (a bag of ROS 2?)",
        "export the topic as CSV, or convert the bag to MCAP (ros2 bag convert, storage_id: mcap)",
    ),
    (b"#ROSBAG", "a bag of ROS 1", "export the topic as CSV (rostopic echo -b BAG -p TOPIC)"),
    (b"LOGG", "a trace of a CAN bus (BLF)", _DECODED),
    (b"MDF     ", "an MDF measurement", _AS_TEXT + ", or as .mat"),
    (b"ULog", "a ULog of PX4", _AS_TEXT + " (ulog2csv)"),
    (b"\xd0\xcf\x11\xe0", "an old Excel file", "save the sheet as CSV"),
    (b"ARROW1", "a Feather or Arrow file", "let its name end in .feather"),
    (
        b"\xff\xff\xff\xff",
        "a stream of Arrow",
        "write it as a file (pyarrow.feather.write_feather of pyarrow.ipc.open_stream(FILE).read_all())",
    ),
    (b"header:\n  stamp:", "what ros2 topic echo shows", "write a table (ros2 topic echo --csv TOPIC)"),
    (b"version https://git-lfs", "a pointer of Git LFS", "fetch the file itself (git lfs pull)"),
    (b"<", "a page of HTML or XML", "save the table in it as CSV"),
    (b"\x80\x04", "a Python pickle", "save the arrays as .npz (numpy.savez)"),
    (b"\x80\x05", "a Python pickle", "save the arrays as .npz (numpy.savez)"),
)
"""First bytes, what the file is, what to do with it."""

_CAN_TEXT = re.compile(
    rb"\s*(\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]{3,8}(#|\s+\[\d+\])|[a-z]+\d\s+[0-9A-Fa-f]{3,8}\s+\[\d+\]"
    rb"|;\$FILEVERSION=|date .*\s+base (hex|dec)|timestamp,arbitration_id,)"
)
"""How candump (`-L`, `-t a`, without stamps), PCAN (.trc), Vector (.asc) and python-can (.csv) begin."""


def what_it_is(raw: bytes) -> str:
    """What a file is that is no table, and what makes a log of it; "" if it is not known."""
    # by the bytes, not by the ending: files are renamed, and a wrong ending is what brings them here
    for first, name, remedy in FOREIGN:
        if raw.startswith(first):
            return f"this is {name}: {remedy}"
    return f"this is a trace of a CAN bus: {_DECODED}" if _CAN_TEXT.match(raw) else ""
