"""Files that are no text and that nothing here reads: what they are, and how they become something that is read."""

from __future__ import annotations

_AS_TEXT = "export its columns as CSV"

FOREIGN: tuple[tuple[bytes, str, str], ...] = (
    (b"PK\x03\x04", "a spreadsheet, or another archive", "save the sheet as CSV, or unpack the archive"),
    (b"\x89HDF", "HDF5", "save the arrays as .npz (numpy.savez) or as .mat with save(..., '-v7')"),
    (b"TDSm", "a TDMS file of LabVIEW", _AS_TEXT + ", or as .mat"),
    (
        b"SQLite format 3",
        "an SQLite data base (a bag of ROS 2?)",
        "export the topic as CSV, or convert the bag to MCAP",
    ),
    (b"#ROSBAG", "a bag of ROS 1", "export the topic as CSV (rostopic echo -b BAG -p TOPIC)"),
    (b"MDF     ", "an MDF measurement", _AS_TEXT + ", or as .mat"),
    (b"ULog", "a ULog of PX4", _AS_TEXT + " (ulog2csv)"),
    (b"\xd0\xcf\x11\xe0", "an old Excel file", "save the sheet as CSV"),
    (b"ARROW1", "a Feather or Arrow file", "save it as Parquet"),
    (b"\x80\x04", "a Python pickle", "save the arrays as .npz (numpy.savez)"),
    (b"\x80\x05", "a Python pickle", "save the arrays as .npz (numpy.savez)"),
)
"""First bytes, what the file is, what to do with it."""


def what_it_is(raw: bytes) -> str:
    """What a binary file is and what makes a log of it; "" if it is not known."""
    for first, name, remedy in FOREIGN:
        if raw.startswith(first):
            return f"this is {name}: {remedy}"
    return ""
