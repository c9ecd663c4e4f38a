"""Reading the arrays of an npz file that somebody else may have written: bounded before anything is built.

An npz is a zip of arrays: a small one may unpack to gigabytes, and the head of an array may claim any shape.
"""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from typing import BinaryIO

import numpy as np

MOST_MEMBERS = 10_000


def read_arrays(file: BinaryIO, most: int) -> dict[str, np.ndarray]:
    """Every array of an npz file, by name.

    Parameters
    ----------
    most
        Bytes that all of it may have, unpacked.

    Raises
    ------
    ValueError
        Not such a file, damaged, or larger."""
    try:
        with zipfile.ZipFile(file) as archive:
            members = [info for info in archive.infolist() if info.filename.endswith(".npy")]
            size = sum(info.file_size for info in members)
            if size > most or len(members) > MOST_MEMBERS:
                msg = f"{len(members)} arrays of {size} bytes, at most {MOST_MEMBERS} of {most} are read"
                raise ValueError(msg)
            return {info.filename.removesuffix(".npy"): _array(archive.read(info)) for info in members}
    except (
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        NotImplementedError,
        RuntimeError,
        MemoryError,
    ) as error:
        raise ValueError(str(error) or type(error).__name__) from error


def _array(data: bytes) -> np.ndarray:
    """One npy file. Its head is believed only when it says as much as there is."""
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    if version not in read:
        msg = f"array of version {version}"
        raise ValueError(msg)
    shape, by_columns, dtype = read[version](stream)
    if (
        dtype.hasobject
        or dtype.itemsize == 0
        or dtype.itemsize * math.prod(shape) != len(data) - stream.tell()
    ):
        msg = f"an array that claims to be {dtype} {shape}"
        raise ValueError(msg)
    flat = np.frombuffer(data, dtype, offset=stream.tell())
    return flat.reshape(shape, order="F" if by_columns else "C").copy()
