"""Packed logs (gzip, xz, bzip2, a zip of one file), unpacked no further than a log's could be."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zipfile
import zlib
from pathlib import Path
from typing import IO

from hw.interface import BackendError
from hw.outside import read_bounded

MAX_BYTES = 1 << 30
"""Largest log, after decompression too."""

MOST_RATIO, LEAST_UNPACKED = 100, 1 << 20
"""How many times its size a file may unpack to, and what it always may: logs reach 5 to 20, a bomb 1,000."""


def most_unpacked(packed: int) -> int:
    """Bytes that a file of so many may unpack to."""
    return min(MAX_BYTES, LEAST_UNPACKED + MOST_RATIO * packed)


def read_unpacked(path: Path) -> bytes:
    """The content of a file, unpacked if it is packed.

    Raises
    ------
    BackendError
        A file that cannot be read, is cut off or no sound archive, unpacks to more than a log does, or is an
        archive of several files."""
    # what an error calls the file that was not looked into yet
    kind = "packed"
    try:
        raw = read_bounded(path, MAX_BYTES)
        # by the bytes where they say it: logs are renamed, and sent with an ending that mail lets through
        kind = _kind(path, raw)
        return _unpacked(path, raw, kind) if kind else raw
    except EOFError as error:
        raise BackendError(f"{path}: the {kind} file is cut off; copy it again") from error
    except (gzip.BadGzipFile, zlib.error, lzma.LZMAError, zipfile.BadZipFile, RuntimeError) as error:
        raise BackendError(f"{path}: not a sound {kind} file ({error}); copy it again") from error
    except OSError as error:
        if kind == "bzip2":
            raise BackendError(f"{path}: not a sound bzip2 file ({error}); copy it again") from error
        raise BackendError(f"{path}: cannot read the log: {error.strerror or error}") from error


def _kind(path: Path, raw: bytes) -> str:
    """What a file is packed by; "" if it is not."""
    if path.suffix == ".gz" or raw[:2] == b"\x1f\x8b":
        return "gzip"
    if raw[:6] == b"\xfd7zXZ\x00":
        return "xz"
    # BZh, the block size, then pi in decimal digits: a text may begin with BZh alone
    if raw[:3] == b"BZh" and raw[4:10] == b"1AY&SY":
        return "bzip2"
    return "zip" if path.suffix.lower() == ".zip" and raw[:4] == b"PK\x03\x04" else ""


def _unpacked(path: Path, raw: bytes, kind: str) -> bytes:
    most = most_unpacked(len(raw))
    with _opened(path, io.BytesIO(raw), kind) as stream:
        # one byte more than may be: read and not asked, for sizes in an archive are its writer's word
        text = stream.read(most + 1)
    if len(text) > most:
        raise BackendError(
            f"{path}: its {len(raw)} bytes unpack to more than {most}, which no log does; unpack it "
            "yourself, or cut it into parts"
        )
    return text


def _opened(path: Path, raw: IO[bytes], kind: str) -> io.BufferedIOBase | IO[bytes]:
    if kind == "gzip":
        return gzip.GzipFile(fileobj=raw)
    if kind == "xz":
        return lzma.open(raw)
    if kind == "bzip2":
        return bz2.open(raw)
    archive = zipfile.ZipFile(raw)
    # what macOS packs beside each file is no log
    files = [name for name in archive.namelist() if not name.endswith("/") and "__MACOSX" not in name]
    if len(files) != 1:
        raise BackendError(
            f"{path}: an archive of {len(files)} files ({', '.join(files)[:300]}); unpack it and give the log"
        )
    return archive.open(files[0])
