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

# each costs some hundred bytes of directory, and an array object; ours have a hundred
MOST_MEMBERS = 10_000

_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""What NumPy writes. Python unpacks bzip2 and LZMA without a bound, whatever size is asked for."""


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
            # by the archive's own list: asked before anything is unpacked, and held to below
            if size > most or len(members) > MOST_MEMBERS:
                msg = f"{len(members)} arrays of {size} bytes, at most {MOST_MEMBERS} of {most} are read"
                raise ValueError(msg)
            return {info.filename.removesuffix(".npy"): _array(_unpacked(archive, info)) for info in members}
    except (
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        NotImplementedError,
        RuntimeError,
        MemoryError,
    ) as error:
        raise ValueError(str(error) or type(error).__name__) from error


def _unpacked(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> bytes:
    """The bytes of one member: no more than its head in the archive says."""
    if info.compress_type not in _PACKED:
        raise ValueError(f"{info.filename} is packed by method {info.compress_type}")
    # with a size: `archive.read` unpacks up to 2 GB at once, and only then cuts it to what the head says
    with archive.open(info) as member:
        return member.read(info.file_size)


def _array(data: bytes) -> np.ndarray:
    """One npy file. Its head is believed only when it says as much as there is."""
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    # 3.0 is for field names that are not Latin-1: no array of ours has such
    read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    if version not in read:
        raise ValueError(f"array of version {version}")
    shape, by_columns, dtype = read[version](stream)
    if (
        dtype.hasobject
        or dtype.itemsize == 0
        or dtype.itemsize * math.prod(shape) != len(data) - stream.tell()
    ):
        raise ValueError(f"an array that claims to be {dtype} {shape}")
    flat = np.frombuffer(data, dtype, offset=stream.tell())
    # a copy: what lies in `bytes` is read-only, and behind a head of any length not aligned
    return flat.reshape(shape, order="F" if by_columns else "C").copy()
