"""Columns of a log file by name, whatever wrote it: text (packed or not), npz, npy, MATLAB, HDF5, Parquet,
TDMS, JSON.

Arrays of a binary file are named as in it: `pos`; column k of a matrix is `data#k`, a field of a structure
`log.pos`."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hw.interface import BackendError
from hw.playback.arrow import read_arrow
from hw.playback.foreign import what_it_is
from hw.playback.json_rows import read_json
from hw.playback.matlab import read_matlab
from hw.playback.matlab_hdf import read_hdf
from hw.playback.packed import most_unpacked, read_unpacked
from hw.playback.spelt_out import spelt_out
from hw.playback.tdms import read_tdms
from hw.playback.text_table import PLACE, NoColumnError, Table, read_text
from hw.playback.wrong_cells import in_rows

if TYPE_CHECKING:
    from numpy.lib.npyio import NpzFile

MIN_SAMPLES = 2

Reader = Callable[[Path, tuple[str, ...]], Mapping[str, np.ndarray]]

CODE_PAGES = ("cp1252", "cp932", "gb18030", "cp1251", "latin-1")
"""Code pages of Windows: Western (a degree sign in a header), Japanese, Chinese, Cyrillic; any byte is of the
last."""

READERS: dict[str, Reader] = {}
"""Readers of further endings, of who knows them: file and names -> arrays by name. They raise
`BackendError`."""


def read_table(
    path: Path, names: tuple[str, ...], delimiter: str | None = None, decimal: str | None = None
) -> Table:
    """The named columns of a log.

    Returns
    -------
    Table
        Float arrays of one length, all finite.

    Raises
    ------
    BackendError
        Unreadable or truncated file, missing or ambiguous column, a cell that is no finite number
        (with its row, counted from 1 below the header), columns of different lengths, fewer than two rows."""
    order = tuple(dict.fromkeys(names))
    ending = path.suffix.lower()
    if ending in READERS or ending in BINARY:
        found = READERS[ending](path, order) if ending in READERS else _opened(path, ending, order)
        whole = spelt_out(path, found if isinstance(found, Table) else Table(dict(found)), order, decimal)
        # dates become seconds (`_seconds`): another unit that was given for them is refused by this one
        stamps = [name for name in order if np.asarray(whole.columns.get(name)).dtype.kind in "mM"]
        units = whole.units | dict.fromkeys(stamps, "s")
        table = Table(_flat(path, whole.columns, order), units, whole.step_s)
    else:
        text = _text(path, order)
        if not text.strip():
            raise BackendError(f"{path}: the file is empty; a header line and rows are needed")
        table = read_text(path, text, order, delimiter, decimal)
    _require_sound(path, table.columns)
    return table


def _require_sound(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{name!r} {n}" for name, n in lengths.items())
        raise BackendError(f"{path}: columns of different lengths ({told}); map columns of one recording")
    rows = next(iter(lengths.values()))
    if rows < MIN_SAMPLES:
        raise BackendError(f"{path}: {rows} row(s); at least {MIN_SAMPLES} are needed")
    bad = np.argwhere(~np.isfinite(np.column_stack(list(columns.values()))))
    if len(bad):
        row, k = bad[0]
        name = list(columns)[k]
        raise BackendError(
            f"{path}: column {name!r} row {row + 1}: {columns[name][row]} is not a finite number "
            f"({len(bad)} such cells); drop the rows (a gap in the stamps is fine), or repair the log"
        )


def _text(path: Path, names: tuple[str, ...]) -> str:
    raw = read_unpacked(path)
    if told := what_it_is(raw):
        raise BackendError(f"{path}: no table; {told}")
    try:
        return _decoded(raw, names).replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        raise BackendError(f"{path}: not a text file ({error.reason} at byte {error.start})") from error


def _decoded(raw: bytes, names: tuple[str, ...]) -> str:
    """UTF-8, UTF-16 by its mark or by the zeros of plain letters, or the one of `CODE_PAGES` in which the
    text has the wanted names, else the first that it can be in."""
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16")
    for order, zeros, letters in (("le", raw[1:40:2], raw[:40:2]), ("be", raw[:40:2], raw[1:40:2])):
        if len(raw) >= 40 and not any(zeros) and all(letters):
            return raw.decode(f"utf-16-{order}")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        if any(byte < 9 for byte in raw[:4096]):  # control characters: no text of any code page
            raise
    texts = [text for page in CODE_PAGES if (text := _in_page(raw, page)) is not None]
    wanted = [name for name in names if not PLACE.fullmatch(name)]
    return next((text for text in texts if all(name in text for name in wanted)), texts[0])


def _in_page(raw: bytes, page: str) -> str | None:
    try:
        return raw.decode(page)
    except UnicodeDecodeError:
        return None


def _opened(path: Path, ending: str, names: tuple[str, ...]) -> Mapping[str, Any] | Table:
    raw = read_unpacked(path)
    try:
        return BINARY[ending](path, raw, names)
    except BackendError:
        raise
    # SciPy has an error of its own that is only an Exception, JSON that is nested too deeply a
    # RecursionError, NumPy's header a TokenError
    except Exception as error:  # whatever a library stumbles over in damaged bytes
        raise BackendError(
            f"{path}: not a sound {ending} file ({str(error)[:200]}); copy or save it again"
        ) from error


def _npz(path: Path, raw: bytes, names: tuple[str, ...]) -> Mapping[str, Any]:
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        # by the archive's own word, before anything is unpacked
        size = sum(info.file_size for info in archive.infolist())
    if size > most_unpacked(len(raw)):
        raise BackendError(f"{path}: unpacks to {size} bytes, which no log does; cut it into parts")
    with np.load(io.BytesIO(raw), allow_pickle=False) as arrays:  # a pickle runs whatever code it holds
        sound = [name for name in arrays.files if not _needs_code(arrays, name)]
        others = [name for name in arrays.files if name not in sound]
        for name in names:
            stem = name if name in arrays.files else re.split(r"[.#]", name)[0]
            # a column that is nowhere else may be in there
            if others and stem not in sound:
                within = stem if stem in others else others[0]
                raise BackendError(
                    f"{path}: {within!r} holds Python objects (a dict, a list of unlike rows), which only "
                    "code in the file could make; save each column as numbers: np.savez(path, "
                    "q=np.asarray(log['q'], float), ...)"
                )
        return {own: array for name in sound for own, array in _named(name, arrays[name]).items()}


def _needs_code(arrays: NpzFile, name: str) -> bool:
    """Whether an array holds objects, which only code in the file could make."""
    try:
        arrays[name]
    except ValueError:
        return True
    return False


def _npy(_path: Path, raw: bytes, _names: tuple[str, ...]) -> Mapping[str, Any]:
    return _named("", np.load(io.BytesIO(raw), allow_pickle=False))


def _named(name: str, array: np.ndarray) -> dict[str, np.ndarray]:
    """An array by its name, or the fields of one of records."""
    if not array.dtype.names:
        return {name: array}
    return {f"{name}.{field}" if name else field: array[field] for field in array.dtype.names}


def _mat(path: Path, raw: bytes, names: tuple[str, ...]) -> Table:
    return read_matlab(path, raw, names, most_unpacked(len(raw)))


def _hdf(path: Path, raw: bytes, names: tuple[str, ...]) -> Table:
    return read_hdf(path, raw, names, most_unpacked(len(raw)), "/")


def _tdms(path: Path, raw: bytes, names: tuple[str, ...]) -> Table:
    return read_tdms(path, raw, names, most_unpacked(len(raw)))


BINARY: dict[str, Callable[[Path, bytes, tuple[str, ...]], Mapping[str, Any] | Table]] = {
    ".npz": _npz,
    ".npy": _npy,
    ".mat": _mat,
    ".h5": _hdf,
    ".hdf5": _hdf,
    ".hdf": _hdf,
    ".parquet": read_arrow,
    ".feather": read_arrow,
    ".arrow": read_arrow,
    ".tdms": _tdms,
    ".json": read_json,
    ".jsonl": read_json,
    ".ndjson": read_json,
}
"""How the content of a file is read, by its ending."""


def _flat(path: Path, arrays: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """The wanted arrays, each (n,)."""
    return {name: _column(path, arrays, name) for name in names}


def _column(path: Path, arrays: Mapping[str, Any], name: str) -> np.ndarray:
    stem, _, place = name.rpartition("#")
    matrix = PLACE.fullmatch(f"#{place}") is not None and name not in arrays
    if (stem if matrix else name) not in arrays:
        known = ", ".join(map(_shown, arrays.items()))
        words = {own: np.asarray(each) for own, each in arrays.items()}
        of = [own for own, each in words.items() if each.dtype.kind in "OU" for cell in each if cell == name]
        raise NoColumnError(
            name, f"{path}: no column {name!r}; the file has: {known[:500]}{in_rows(name, of)}"
        )
    array = np.asarray(arrays[stem if matrix else name])
    if array.dtype.kind not in "fiub" and array.dtype.kind not in "mM":
        raise BackendError(
            f"{path}: {name!r} is not an array of real numbers ({array.dtype}); map another one"
        )
    if array.dtype.kind in "mM":
        array = _seconds(array)
    array = np.asarray(array, float)
    # MATLAB has no vector: what is one there comes with axes of length 1
    if array.ndim > 2:
        array = array.reshape([n for n in array.shape if n > 1])  # (n, 1, 3)
    if matrix and array.ndim == 2:
        k = int(place) - 1
        array = _upright(array)
        if not 0 <= k < array.shape[1]:
            raise BackendError(f"{path}: {stem or 'the array'} has {array.shape[1]} columns, not {place}")
        return np.ascontiguousarray(array[:, k])
    if array.ndim == 2 and 1 in array.shape:
        array = array.reshape(-1)
    if array.ndim != 1 or matrix:
        remedy = (
            f"save one column of it: x = {name}[:, 0, 0]"
            if array.ndim > 2
            else f"name one column of it: {name}#1, {name}#2, ..."
            if array.ndim == 2
            else f"it has no columns: name it {stem}"
            if matrix
            else "map one that has a value for each row"
        )
        raise BackendError(f"{path}: {name!r} has shape {array.shape}; {remedy}")
    return array


def _seconds(stamps: np.ndarray) -> np.ndarray:
    """Dates or durations as s since the first one that is one; NaN where there is none."""
    stamped = stamps[~np.isnat(stamps)]
    if not stamped.size:
        return np.full(stamps.shape, np.nan)
    # months have no length of their own: NumPy would take a mean one
    if stamps.dtype.kind == "M" and np.datetime_data(stamps.dtype)[0] in ("Y", "M"):
        stamps, stamped = stamps.astype("datetime64[D]"), stamped.astype("datetime64[D]")
    # from the first on: ns since 1970 have more digits than a float64. Divided and not cast to ns: those of a
    # clock that was never set (the year 1601) run over after 292 years, without a word
    return np.asarray((stamps - stamped[0]) / np.timedelta64(1, "s"))


def _upright(array: np.ndarray) -> np.ndarray:
    """A matrix with a column for each signal: Simulink's To File writes a row for each."""
    return array.T if array.shape[0] < array.shape[1] else array


def _shown(item: tuple[str, Any]) -> str:
    name, value = item
    shape = np.shape(value)
    return f"{name}#1..{min(shape)}" if len(shape) == 2 and 1 not in shape else name
