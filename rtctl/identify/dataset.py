"""The data set of an identification: a folder that is whole at any moment.

    dataset.json        provenance, settings, sessions, points
    points_train.csv    what `rtctl fit` reads
    points_test.csv     points at other speeds, to judge the fit by
    ticks/NAME.npz      the ticks behind each point (RAW_FIELDS), without pickle

Every file is written beside its name and renamed, so a cut-off leaves the last complete state.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import platform
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numba
import numpy as np

from rtctl import __version__
from rtctl.config import LoadedConfig
from rtctl.errors import DataError
from rtctl.identify.plan import Task, tasks
from rtctl.identify.session import Bias, Point
from rtctl.identify.settings import Settings

SCHEMA = 1
HEADER = "dataset.json"
RAW_FIELDS = ("tick", "position_rad", "current_a", "force_n", "temperature_c", "torque_applied_nm")
"""Fields kept of the ticks behind each point: what was measured, and what was sent."""
COLUMNS = ("velocity_rad_s", "friction_torque_nm", "std_nm", "count", "direction", "temperature_c")
_NUMBER = {"velocity_rad_s": ".9g", "count": "d", "direction": "d", "temperature_c": ".2f"}


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that at any moment either the old or the new content is there. Raises DataError."""
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with beside.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except OSError as error:
        raise DataError(
            f"{path}: cannot write: {error.strerror}; free space or choose another --out"
        ) from error
    finally:
        beside.unlink(missing_ok=True)  # gone already when the rename was done


class Dataset:
    """A data set being filled. `Dataset.create` or `Dataset.resume` make one.

    Attributes
    ----------
    folder
        Where it lives.
    document
        What `dataset.json` holds.
    """

    def __init__(self, folder: Path, document: dict[str, Any], axis: int) -> None:
        self.folder, self.document, self._axis = folder, document, axis
        self._names = {point["name"] for point in document["points"]}

    @classmethod
    def create(cls, folder: Path, loaded: LoadedConfig, settings: Settings, *, simulated: bool) -> Dataset:
        """Begin a data set in a new or empty folder.

        Raises
        ------
        DataError
            The folder holds something already, or cannot be made.
        """
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise DataError(f"{folder}: exists and is not empty; choose another --out, or give --resume")
        try:
            (folder / "ticks").mkdir(parents=True)
        except OSError as error:
            raise DataError(
                f"{folder}: cannot make the folder: {error.strerror}; choose another --out"
            ) from error
        document = {
            "schema": SCHEMA,
            "kind": "rtctl friction data set",
            "rig": loaded.config.rig.name,
            "axis_name": loaded.config.axis[settings.axis].name,
            "config": loaded.path.name,
            "config_sha256": loaded.sha256,
            "simulated": simulated,
            "settings": asdict(settings),
            "complete": False,
            "sessions": [],
            "points": [],
        }
        dataset = cls(folder, document, settings.axis)
        dataset.save()
        return dataset

    @classmethod
    def resume(cls, folder: Path, loaded: LoadedConfig, settings: Settings, *, simulated: bool) -> Dataset:
        """Continue a data set.

        Raises
        ------
        DataError
            It is not there, is damaged, or was begun with another rig file or other settings.
        """
        document = read_document(folder)
        same = {
            "rig file": (document["config_sha256"], loaded.sha256),
            "rig": (document["rig"], loaded.config.rig.name),
            "simulated": (document["simulated"], simulated),
            "settings": (document["settings"], asdict(settings)),
        }
        for what, (before, now) in same.items():
            if before != now:
                raise DataError(
                    f"{folder}: was begun with another {what} ({_difference(before, now)}); "
                    "points of two would not belong together: use the same, or begin a new --out"
                )
        return cls(folder, document, settings.axis)

    def has(self, task: Task) -> bool:
        """True when the point of `task` is complete."""
        return task.name in self._names

    def begin(self, bias: Bias) -> None:
        """Note a session: when, with which versions, and what the sensors showed at rest."""
        self.document["sessions"].append(
            {
                "date": datetime.now(UTC).isoformat(timespec="seconds"),
                "versions": {
                    "rtctl": __version__,
                    "python": platform.python_version(),
                    "numpy": np.__version__,
                    "numba": numba.__version__,
                },
                "host": platform.node(),
                "bias": asdict(bias),
                "points_before": len(self._names),
            }
        )
        self.save()

    def add(self, point: Point, rows: list[np.ndarray]) -> None:
        """Keep one complete point: its ticks first, then its figures."""
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **self._raw(rows))  # type: ignore[arg-type] # stub takes allow_pickle only
        content = buffer.getvalue()
        write_whole(self.folder / "ticks" / f"{point.name}.npz", content)
        entry = {
            **asdict(point),
            "session": len(self.document["sessions"]) - 1,
            "ticks_sha256": hashlib.sha256(content).hexdigest(),
        }
        self.document["points"].append(entry)
        self._names.add(point.name)
        self.save()

    def _raw(self, rows: list[np.ndarray]) -> dict[str, np.ndarray]:
        """Columns of the ticks, of this axis, and where each measurement begins in them."""
        ends = np.cumsum([len(part) for part in rows])
        columns: dict[str, np.ndarray] = {"measurement_start": np.concatenate([[0], ends[:-1]])}
        for name in RAW_FIELDS:
            values = np.concatenate([part[name] for part in rows])
            columns[name] = values if name in ("tick", "force_n") else values[:, self._axis]
        return columns

    def save(self) -> None:
        """Write the header and the points."""
        settings = Settings(**self.document["settings"])
        self.document["complete"] = all(self.has(task) for task in tasks(settings))
        for use in ("train", "test"):
            write_whole(self.folder / f"points_{use}.csv", self._csv(use).encode())
        text = json.dumps(self.document, indent=1, allow_nan=False)
        write_whole(self.folder / HEADER, (text + "\n").encode())

    def _csv(self, use: str) -> str:
        chosen = [point for point in self.document["points"] if point["use"] == use]
        out = io.StringIO()
        out.write(f"# rig {self.document['rig']}, config sha256 {self.document['config_sha256']}\n")
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(COLUMNS)
        for point in sorted(chosen, key=lambda p: (-p["direction"], abs(p["target_rad_s"]))):
            writer.writerow([format(point[name], _NUMBER.get(name, ".7f")) for name in COLUMNS])
        return out.getvalue()


def read_document(folder: Path) -> dict[str, Any]:
    """The header of a data set.

    Raises
    ------
    DataError
        Missing, not JSON, or not of this schema.
    """
    path = folder / HEADER
    try:
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise DataError(
            f"{path}: cannot read: {error.strerror}; there is nothing to resume in {folder}"
        ) from error
    except ValueError as error:
        raise DataError(f"{path}: damaged ({error}); begin a new --out") from error
    keys = {"config_sha256", "rig", "simulated", "settings", "sessions", "points"}
    if not isinstance(document, dict) or document.get("schema") != SCHEMA or not keys <= document.keys():
        raise DataError(f"{path}: not a data set of schema {SCHEMA}; begin a new --out")
    return document


def _difference(before: object, now: object) -> str:
    if isinstance(before, dict) and isinstance(now, dict):
        names = [name for name in {**before, **now} if before.get(name) != now.get(name)]
        return ", ".join(f"{name} {before.get(name)} then, {now.get(name)} now" for name in names)
    return f"{str(before)[:12]} then, {str(now)[:12]} now"
