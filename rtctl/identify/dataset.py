"""The data set of an identification: a folder that is whole at any moment.

    dataset.json        provenance, settings, sessions, points
    points_train.csv    what `rtctl fit` reads
    points_test.csv     points at other speeds, to judge the fit by
    points_places.csv   the training points place by place, for `rtctl fit --places`
    points_sweep.csv    a slow turn each way, likewise
    ticks/NAME.npz      every tick of the bias, the warm-up and each point (`ticks.FIELDS`), without pickle

Every file is written beside its name and renamed, so a cut-off leaves the last complete state."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numba
import numpy as np

from hw.motion import named
from rtctl import __version__
from rtctl.errors import DataError
from rtctl.identify.bias import Bias
from rtctl.identify.columns import points_csv
from rtctl.identify.dataset_files import HEADER, SCHEMA, read_document, write_whole
from rtctl.identify.measurement_order import Known, Task, remaining
from rtctl.identify.place_rows import Row, places_csv, rows_of
from rtctl.identify.rest import raise_break_away
from rtctl.identify.session import Point
from rtctl.identify.settings import Settings
from rtctl.identify.tick_readings import Measurement
from rtctl.identify.ticks import TickBlock
from rtctl.rig_file.config import LoadedConfig


class Dataset:
    """A data set being filled. `Dataset.create` or `Dataset.resume` make one.

    Attributes
    ----------
    folder
        Where it lives.
    document
        What `dataset.json` holds, under the names of a rotary axis; the file has those of the axis's motion.
    ticks
        Give it every tick of the rig; it is kept with the point, the bias or the warm-up it belongs to."""

    def __init__(self, folder: Path, document: dict[str, Any], axis: int, period_s: float) -> None:
        self.folder, self.document = folder, document
        self._motion = str(document.get("motion", "rotary"))
        self.ticks = TickBlock(axis, round(1e9 * period_s), self._motion)
        # asked before each task: a list of hundreds of points would be read through each time
        self._names = {point["name"] for point in document["points"]}

    @classmethod
    def create(cls, folder: Path, loaded: LoadedConfig, settings: Settings, *, simulated: bool) -> Dataset:
        """Begin a data set in a new or empty folder, or in one where an earlier start was refused before it
        measured anything.

        Raises
        ------
        DataError
            The folder holds something already, or cannot be made."""
        # hours on a rig are in such a folder: nothing in it is ever written over
        if folder.exists() and not (folder.is_dir() and _holds_nothing(folder)):
            raise DataError(f"{folder}: exists and is not empty; choose another --out, or give --resume")
        try:
            (folder / "ticks").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise DataError(
                f"{folder}: cannot make the folder: {error.strerror}; choose another --out"
            ) from error
        document = {
            "schema": SCHEMA,
            "kind": "rtctl friction data set",
            "rig": loaded.config.rig.name,
            "axis_name": loaded.config.axis[settings.axis].name,
            "motion": loaded.config.axis[settings.axis].motion,
            "config": loaded.path.name,
            "config_sha256": loaded.sha256,
            "simulated": simulated,
            "settings": asdict(settings),
            "complete": False,
            "sessions": [],
            "skipped": [],
            "points": [],
        }
        dataset = cls(folder, document, settings.axis, loaded.config.period_s)
        dataset.save()
        return dataset

    @classmethod
    def resume(cls, folder: Path, loaded: LoadedConfig, settings: Settings, *, simulated: bool) -> Dataset:
        """Continue a data set.

        Raises
        ------
        DataError
            It is not there, is damaged, or was begun with another rig file or other settings."""
        document = read_document(folder)
        same = {
            "another rig file": (document["config_sha256"], loaded.sha256),
            "another rig": (document["rig"], loaded.config.rig.name),
            # points of the simulated rig among measured ones would be believed
            "a simulated rig, or not": (document["simulated"], simulated),
            # a setting that came later has its default in an older data set
            "other settings": (asdict(replace(Settings(), **document["settings"])), asdict(settings)),
        }
        for other, (before, now) in same.items():
            if before != now:
                raise DataError(
                    f"{folder}: was begun with {other} ({_difference(before, now)}); "
                    "points of two would not belong together: use the same, or begin a new --out"
                )
        document["skipped"] = []  # whatever was given up is tried again
        return cls(folder, document, settings.axis, loaded.config.period_s)

    def has(self, task: Task) -> bool:
        """True when the point of `task` is complete."""
        return task.name in self._names

    def begin(self, bias: Bias) -> None:
        """Note a session: when, with which versions, and what the sensors showed at rest, tick by tick."""
        now = datetime.now(UTC)
        self.document["sessions"].append(
            {
                "date": now.isoformat(timespec="seconds"),
                "began_s": self._began_s(now),
                "versions": {
                    "rtctl": __version__,
                    "python": platform.python_version(),
                    "numpy": np.__version__,
                    "numba": numba.__version__,
                },
                "host": platform.node(),
                "bias": asdict(bias),
                "points_before": len(self._names),
                "ticks_sha256": {},
            }
        )
        self._keep_of_session("bias")

    def warmed_up(self) -> None:
        """Keep the ticks of arming and warm-up."""
        self._keep_of_session("warm_up")

    def _keep_of_session(self, what: str) -> None:
        number = len(self.document["sessions"]) - 1
        name = f"session{number:02d}_{what}"
        self.document["sessions"][-1]["ticks_sha256"][name] = self._keep(name)
        self.save()

    def _began_s(self, now: datetime) -> float:
        """Seconds from the first session to one that begins now; simulated time outruns the wall's."""
        if not self.document["sessions"]:
            return 0.0
        passed = now - datetime.fromisoformat(self.document["sessions"][0]["date"])
        # never before a point that is there: simulated time outruns the wall's, and a clock may be set back
        return max(
            [passed.total_seconds(), *(self._time_s(point) or 0.0 for point in self.document["points"])]
        )

    def _time_s(self, point: dict[str, Any]) -> float | None:
        """Time of a point since the first session began; None in a data set begun before times were kept."""
        session = self.document["sessions"][point["session"]]
        known = "time_s" in point and "began_s" in session
        return float(point["time_s"] + session["began_s"]) if known else None

    def add(self, point: Point, measurements: Sequence[Measurement]) -> None:
        """Keep one complete point: its ticks first, then its figures."""
        entry = {
            **asdict(point),
            "session": len(self.document["sessions"]) - 1,
            "places": rows_of(point.direction, measurements),
            # before the header names it: a cut-off leaves a file too many, not one too few
            "ticks_sha256": self._keep(point.name, measurements),
        }
        self.document["points"].append(entry)
        self._names.add(point.name)
        # a slow speed may tell more of an older point at rest
        raise_break_away(self.document["points"], self.known())
        self.save()

    def skip(self, task: Task, why: str) -> None:
        """Note a point that could not be measured; a later session tries it again."""
        self.document["skipped"].append({"name": task.name, "why": why})
        self.save()

    def lacks_sweep(self) -> bool:
        """True until a slow two-way sweep is kept."""
        return not self.document.get("sweep")

    def swept(self, rows: Sequence[Row]) -> None:
        """Keep a slow two-way sweep, with its ticks."""
        self.document["sweep"] = rows
        self._keep_of_session("sweep")

    def known(self) -> list[Known]:
        """Points that are complete."""
        return [
            Known(
                point["direction"],
                abs(point["target_rad_s"]),
                abs(point["friction_torque_nm"]),
                point.get("presliding_rad"),
            )
            for point in self.document["points"]
        ]

    @property
    def left(self) -> list[Task]:
        """Points still to measure, less those that were given up."""
        given_up = {one["name"] for one in self.document["skipped"]}
        settings = Settings(**self.document["settings"])
        return remaining(settings, lambda task: self.has(task) or task.name in given_up, self.known())

    def _keep(self, name: str, measurements: Sequence[Measurement] = ()) -> str:
        """Write the ticks since the last call; returns their SHA-256."""
        content = self.ticks.take([(one.first_tick, one.ticks) for one in measurements])
        write_whole(self.folder / "ticks" / f"{name}.npz", content)
        return hashlib.sha256(content).hexdigest()

    def save(self) -> None:
        """Write the header and the points."""
        # anew each time: a point may ask for a lower speed (`remaining`)
        self.document["complete"] = not self.left
        for use in ("train", "test"):
            write_whole(self.folder / f"points_{use}.csv", self._csv(use).encode())
        places = [
            row for one in self.document["points"] if one["use"] == "train" for row in one.get("places", ())
        ]
        for name, rows in (("places", places), ("sweep", self.document.get("sweep"))):
            if rows:
                text = places_csv(rows, self.document["rig"], self.document["config_sha256"], self._motion)
                write_whole(self.folder / f"points_{name}.csv", text.encode())
        text = json.dumps(named(self.document, self._motion), indent=1, allow_nan=False)
        write_whole(self.folder / HEADER, (text + "\n").encode())

    def _csv(self, use: str) -> str:
        rows = [
            {**point, "time_s": self._time_s(point)}
            for point in self.document["points"]
            if point["use"] == use
        ]
        return points_csv(rows, self.document["rig"], self.document["config_sha256"], self._motion)


def _holds_nothing(folder: Path) -> bool:
    """Whether a folder is empty, or a data set whose every start was refused before it had measured the
    bias."""
    names = {one.name for one in folder.iterdir()}
    # somebody's file: not ours to write beside
    if HEADER not in names or names - {HEADER, "points_train.csv", "points_test.csv", "ticks"}:
        return not names
    return not read_document(folder)["sessions"] and not any((folder / "ticks").iterdir())


def _difference(before: object, now: object) -> str:
    if isinstance(before, dict) and isinstance(now, dict):
        names = [name for name in {**before, **now} if before.get(name) != now.get(name)]
        return ", ".join(f"{name} {before.get(name)} then, {now.get(name)} now" for name in names)
    return f"{str(before)[:12]} then, {str(now)[:12]} now"
